//! Building blocks of HTML pages: style, tables, numbers and charts.

mod number;
mod style;
mod table;

pub use crate::chart::{Chart, dot_key, line_key};
pub use crate::markup::escape;
pub use crate::plot::panel::{LARGEST, shown as drawable};
pub use number::{brief, figure, html};
pub use style::opening;
pub use table::{number, table};
