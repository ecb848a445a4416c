//! A fit as a page: parameters, errors, and recorded motions beside simulated ones.

mod charts;
mod page;
mod report;

pub use page::page;
pub use report::{Means, Motion, Parameter, Report, Toss};
