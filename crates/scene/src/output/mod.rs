//! Runs as CSV: the tutorial's table of one body ([`trajectory`]) and [`tables`] of any number of
//! bodies.

mod points;
mod rows;
mod sheet;
pub mod tables;
pub mod trajectory;

pub use sheet::{MOST_ROW_BYTES, RowsError};
