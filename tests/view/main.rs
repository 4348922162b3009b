//! `meniscus view` as a user meets it: a real window, on a display without a screen, with real keys and a mouse.

mod display;
mod window;
