//! Everything that needs no device: files, preparation, twins against closed forms.

mod house;
#[cfg(feature = "io")]
mod io;
mod prepare;
