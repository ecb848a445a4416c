//! Tests of robots from URDF, SDF and MJCF files.

mod between;
mod broken;
mod details;
mod formats;
mod found;
mod gears;
mod held;
mod looks;
mod loose;
mod models;
mod moving;
mod names;
mod reading;
mod scenes;
mod sdf;
mod sensors;
mod sums;
