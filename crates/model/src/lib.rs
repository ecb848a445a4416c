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

/// True where programs read files. In WebAssembly there are only robots of the page itself, without meshes. Its
/// program has no code for meshes, their decomposition and pictures of heights.
pub const READS_FILES: bool = !cfg!(target_arch = "wasm32");

/// Error about a file where there are none.
pub const NO_FILES: &str = "no files can be read here; write the shape into the scene";

/// Function that reads the file at a path, of at most the given number of bytes.
pub type ReadFile<'a> = &'a dyn Fn(&Path, u64) -> io::Result<Vec<u8>>;
