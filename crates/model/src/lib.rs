//! Scene as data: bodies, shapes, joints, gears and fixed geometry, with indices in place of names.
//!
//! A [`Model`] makes a [`World`](tumble_core::world::World). Documents, robots and plans all become a
//! [`Model`].

#![deny(unsafe_code)]

mod coefficients;
pub mod colour;
mod drawn;
pub mod failure;
pub mod fields;
pub mod groups;
pub mod heights;
pub mod joint;
mod model;
pub mod nearest;
pub mod packed;
pub mod shape;
pub mod shown;
mod terrain;

pub use coefficients::{CoefficientsModel, PairModel};
pub use drawn::{DrawnModel, state_at};
pub use model::*;
pub use terrain::TerrainModel;

use std::io;
use std::path::Path;

/// Function that reads the file at a path, of at most the given number of bytes.
pub type ReadFile<'a> = &'a dyn Fn(&Path, u64) -> io::Result<Vec<u8>>;
