//! Siconos' text format of contact problems (`.dat`): local problems with a dense, block or sparse
//! matrix, and global problems.
//!
//! The text consists of numbers between blanks. A local problem has the dimension of a contact, the
//! number of contacts, W, q and μ. A global problem has M, H, f, w and μ instead of W, q and μ. A
//! matrix begins with its storage (0 dense, 1 blocks, 2 sparse), its rows and its columns. Dense
//! matrices and blocks are in column-major order. The first component of an impulse is the normal
//! one.

mod reader;
mod writer;

pub use reader::{DatError, read};
pub use writer::write;
