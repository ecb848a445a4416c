//! A validation as a page: problems with closed-form answers, and what each solver made of
//! them.

mod chart;
pub mod number;
mod page;
mod report;
pub(crate) mod style;
pub(crate) mod table;

pub use page::page;
pub use report::{Curve, Experiment, Quantity, Report, Series, Solver, Trial};
