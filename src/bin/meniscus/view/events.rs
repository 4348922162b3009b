//! From what the window tells to what the viewer does: keys, mouse, size.

use super::{
    error::ViewError,
    keys::{self, Command},
    viewer::Viewer,
};
use glam::DVec2;
use std::time::Instant;
use winit::{
    application::ApplicationHandler,
    dpi::PhysicalSize,
    event::{ElementState, KeyEvent, MouseButton, MouseScrollDelta, WindowEvent},
    event_loop::ActiveEventLoop,
    keyboard::{Key, KeyCode, ModifiersState, NamedKey, PhysicalKey},
    window::{Window, WindowAttributes, WindowId},
};

/// Distances to the target that flying goes in a second; with Shift.
const SPEED: [f64; 2] = [0.5, 2.0];
/// Pixels of a touchpad that are a notch of a wheel.
const NOTCH: f64 = 40.0;

/// Makes the window, as soon as there may be one.
pub struct Opener {
    pub attributes: WindowAttributes,
    pub made: Option<Result<Window, String>>,
}

impl ApplicationHandler for Opener {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        let attributes = self.attributes.clone();
        self.made.get_or_insert_with(|| event_loop.create_window(attributes).map_err(|e| e.to_string()));
    }

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, _: WindowEvent) {}
}

/// What a drag does.
#[derive(Clone, Copy, PartialEq)]
enum Drag {
    Orbit,
    Look,
    Pan,
    Scrub,
}

pub struct Events<'a> {
    pub viewer: Viewer<'a>,
    /// Width and height of the window in pixels.
    pub size: [u32; 2],
    held: Vec<KeyCode>,
    modifiers: ModifiersState,
    mouse: DVec2,
    drag: Option<Drag>,
    last: Instant,
    pub failed: Option<ViewError>,
}

impl<'a> Events<'a> {
    pub fn new(viewer: Viewer<'a>, window: &Window) -> Events<'a> {
        let PhysicalSize { width, height } = window.inner_size();
        Events {
            viewer,
            size: [width, height],
            held: Vec::new(),
            modifiers: ModifiersState::empty(),
            mouse: DVec2::ZERO,
            drag: None,
            last: Instant::now(),
            failed: None,
        }
    }

    /// Whether something moves by itself.
    pub fn moves(&self) -> bool {
        self.viewer.clock.playing || (self.viewer.navigator.is_some() && keys::flight(&self.held).length() > 0.0)
    }

    /// What time brings: frames of the sequence, and flight.
    pub fn tick(&mut self) {
        let now = Instant::now();
        // After a pause it goes on from where it was.
        let seconds = now.duration_since(self.last).as_secs_f64().min(0.25);
        self.last = now;
        let direction = keys::flight(&self.held);
        if direction.length() > 0.0
            && let Some(n) = &mut self.viewer.navigator
        {
            n.fly(direction.normalize() * SPEED[usize::from(self.modifiers.shift_key())] * seconds);
            self.viewer.dirty = true;
        }
        let before = self.viewer.clock.frame();
        self.viewer.clock.advance(seconds);
        self.viewer.rewritten |= self.viewer.clock.frame() != before;
        self.viewer.update();
    }

    fn key(&mut self, event: &KeyEvent) -> Result<(), ViewError> {
        let pressed = event.state == ElementState::Pressed;
        if let PhysicalKey::Code(code) = event.physical_key {
            self.held.retain(|held| *held != code);
            if pressed && self.viewer.panel.typed.is_none() && !self.modifiers.control_key() {
                self.held.push(code);
            }
        }
        if !pressed {
            return Ok(());
        }
        if self.viewer.panel.typed.is_some() {
            self.typing(event);
            return Ok(());
        }
        match keys::command(&event.logical_key, self.modifiers.shift_key()) {
            // Held down these go on.
            Some(command @ (Command::Step(_) | Command::Select(_) | Command::Frame(_))) => self.viewer.obey(command),
            Some(command) if !event.repeat => self.viewer.obey(command),
            _ => Ok(()),
        }
    }

    /// A key while a value is typed.
    fn typing(&mut self, event: &KeyEvent) {
        let viewer = &mut self.viewer;
        viewer.rewritten = true;
        match &event.logical_key {
            Key::Named(NamedKey::Enter) => {
                let text = viewer.panel.typed.take().unwrap_or_default();
                if !text.trim().is_empty() {
                    viewer.typed(&text);
                }
            }
            Key::Named(NamedKey::Escape) => viewer.panel.typed = None,
            Key::Named(NamedKey::Backspace) => drop(viewer.panel.typed.as_mut().and_then(String::pop)),
            _ => {
                if let (Some(typed), Some(text)) = (&mut viewer.panel.typed, &event.text) {
                    typed.extend(text.chars().filter(|c| !c.is_control()));
                }
            }
        }
    }

    fn button(&mut self, state: ElementState, button: MouseButton) {
        let at = self.mouse.to_array();
        if state == ElementState::Released {
            self.drag = None;
            return;
        }
        if let Some(frame) = self.viewer.bar_at(at) {
            self.drag = Some(Drag::Scrub);
            self.viewer.seek(frame);
        } else if let Some(entry) = self.viewer.panel.entry_at(at) {
            (self.viewer.panel.chosen, self.viewer.panel.typed) = (entry, None);
            self.viewer.rewritten = true;
        } else if !self.viewer.panel.covers(at) {
            self.drag = match button {
                MouseButton::Left if self.modifiers.shift_key() => Some(Drag::Pan),
                MouseButton::Left => Some(Drag::Orbit),
                MouseButton::Right => Some(Drag::Look),
                MouseButton::Middle => Some(Drag::Pan),
                _ => None,
            };
        }
    }

    fn moved(&mut self, to: DVec2) {
        let moved = (to - self.mouse) / self.viewer.height();
        self.mouse = to;
        let Some(drag) = self.drag else { return };
        if drag == Drag::Scrub {
            let x = to.x.clamp(0.0, f64::from(self.size[0].max(1)) - 1.0);
            if let Some(frame) = self.viewer.bar_at([x, f64::from(self.size[1])]) {
                self.viewer.seek(frame);
            }
        }
        if let Some(n) = &mut self.viewer.navigator {
            match drag {
                Drag::Orbit => n.orbit(moved),
                Drag::Look => n.look(moved),
                Drag::Pan => n.pan(moved),
                Drag::Scrub => return,
            }
            self.viewer.dirty = true;
        }
    }

    fn wheel(&mut self, delta: MouseScrollDelta) {
        let notches = match delta {
            MouseScrollDelta::LineDelta(_, y) => f64::from(y),
            MouseScrollDelta::PixelDelta(by) => by.y / NOTCH,
        };
        if self.viewer.panel.covers(self.mouse.to_array()) {
            let steps = notches.signum() as i32 * (notches.abs().ceil() as i32).min(4);
            if steps != 0 {
                self.viewer.change(|entry, subject| entry.step(subject, steps));
            }
        } else if let Some(n) = &mut self.viewer.navigator {
            n.zoom(notches);
            self.viewer.dirty = true;
        }
    }
}

impl ApplicationHandler for Events<'_> {
    fn resumed(&mut self, _: &ActiveEventLoop) {}

    fn window_event(&mut self, _: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let done = match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => self.viewer.obey(Command::Quit),
            WindowEvent::Resized(PhysicalSize { width, height }) => {
                self.size = [width, height];
                (self.viewer.dirty, self.viewer.frames.stale) = (true, true);
                Ok(())
            }
            WindowEvent::ScaleFactorChanged { scale_factor, .. } => {
                (self.viewer.scale, self.viewer.dirty) = (scale_factor, true);
                Ok(())
            }
            WindowEvent::RedrawRequested | WindowEvent::Occluded(false) => {
                self.viewer.rewritten = true;
                Ok(())
            }
            WindowEvent::Focused(false) => {
                (self.drag, self.modifiers) = (None, ModifiersState::empty());
                self.held.clear();
                Ok(())
            }
            WindowEvent::ModifiersChanged(modifiers) => {
                self.modifiers = modifiers.state();
                Ok(())
            }
            // Keys that were down before the window had the focus.
            WindowEvent::KeyboardInput { is_synthetic: true, .. } => Ok(()),
            WindowEvent::KeyboardInput { event, .. } => self.key(&event),
            WindowEvent::MouseInput { state, button, .. } => {
                self.button(state, button);
                Ok(())
            }
            WindowEvent::CursorMoved { position, .. } => {
                self.moved(DVec2::new(position.x, position.y));
                Ok(())
            }
            WindowEvent::MouseWheel { delta, .. } => {
                self.wheel(delta);
                Ok(())
            }
            _ => Ok(()),
        };
        self.failed = self.failed.take().or(done.err());
    }
}
