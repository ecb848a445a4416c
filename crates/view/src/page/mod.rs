//! Building blocks of HTML pages: style, tables and numbers.

mod number;
mod style;
mod table;

pub use crate::markup::escape;
pub use number::figure;
pub use style::opening;
pub use table::{number, table};
