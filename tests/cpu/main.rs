//! Everything that needs no device: files, preparation, twins against closed forms.

#[cfg(feature = "io")]
mod io;
mod prepare;
