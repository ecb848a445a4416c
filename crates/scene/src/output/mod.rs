//! Runs as tables: the tutorial's table of one body ([`trajectory`]), those of any number of bodies ([`tables`]), and the
//! reading of both.

mod points;
mod rows;
mod sheet;
pub mod tables;
pub mod trajectory;

pub use sheet::{MOST_ROW_BYTES, RowsError};
