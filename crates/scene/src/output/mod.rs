//! Runs as CSV: the [`tables`] of every run, and the tutorial's [`trajectory`].

mod csv_reader;
mod rows;
pub mod tables;
pub mod trajectory;

pub use csv_reader::{MOST_ROW_BYTES, RowsError};
