//! Siconos' text form of contact problems (`.dat`): local ones with a dense, a block or a sparse matrix,
//! and global ones.
//!
//! The text is numbers between blanks: the dimension of a contact, how many there are, W, q and μ; of a
//! global problem M, H, f, w and μ. A matrix begins with its storage (0 dense, 1 blocks, 2 sparse), its rows and
//! its columns. Dense matrices and blocks come column after column. An impulse's first component is the
//! normal one.

mod reader;
mod writer;

pub use reader::{DatError, read};
pub use writer::write;
