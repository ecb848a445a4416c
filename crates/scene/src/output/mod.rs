//! Runs as CSV: the [`tables`] of every run, and the tutorial's [`trajectory`].

mod rows;
mod sheet;
pub mod tables;
pub mod trajectory;

pub use sheet::{MOST_ROW_BYTES, RowsError};
