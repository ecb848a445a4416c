//! Robots from URDF and MJCF files.

mod between;
mod broken;
mod details;
mod found;
mod gears;
mod looks;
mod loose;
mod models;
mod reading;
mod scenes;
mod sums;
