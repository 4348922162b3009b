//! Everything that needs no device: files, preparation, twins against closed forms.

#[cfg(feature = "io")]
mod bgeo;
#[cfg(feature = "io")]
mod collections;
#[cfg(feature = "io")]
mod environment;
#[cfg(feature = "io")]
mod forms;
#[cfg(feature = "io")]
mod hostile;
mod house;
#[cfg(feature = "io")]
mod io;
#[cfg(feature = "io")]
mod lammps;
mod prepare;
mod shared_blocks;
mod smooth;
#[cfg(feature = "study")]
mod study;
#[cfg(feature = "io")]
mod tables;
mod twin_normals;
mod twin_optics;
mod twin_plane_fit;
mod twin_walk;
#[cfg(feature = "io")]
mod velocities;
#[cfg(feature = "io")]
mod vtk_xml;
