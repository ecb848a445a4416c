//! Values that files of robots, scenes and plans have in common: shapes, places, grids of heights, colours,
//! names, and errors about them.

#![deny(unsafe_code)]

pub mod colour;
pub mod failure;
pub mod fields;
pub mod heights;
pub mod joint;
pub mod nearest;
pub mod packed;
pub mod shown;

use std::io;
use std::path::Path;

/// Function that reads the file at a path, of at most the given number of bytes.
pub type ReadFile<'a> = &'a dyn Fn(&Path, u64) -> io::Result<Vec<u8>>;
