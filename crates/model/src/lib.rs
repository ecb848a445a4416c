//! A scene as data: bodies, shapes, joints, gears and what is fixed, as run.json has them, and the
//! [`World`](tumble_core::world::World) that they make. Scenario files, robots and plans all become a [`Model`].

#![deny(unsafe_code)]

pub mod colour;
mod drawn;
pub mod failure;
pub mod fields;
pub mod gear;
pub mod joint;
mod model;
pub mod names;
pub mod parameters;
pub mod shape;
pub mod shown;

pub use drawn::{DrawnModel, state_at};
pub use model::*;

use std::io;
use std::path::Path;

/// Reads the file of a name, of at most so many bytes.
pub type ReadFile<'a> = &'a dyn Fn(&Path, u64) -> io::Result<Vec<u8>>;
