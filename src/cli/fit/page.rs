//! The report page of a fit.

use super::results::Results;
use super::task::Task;

pub fn page(_task: &Task, _results: &Results) -> String {
    String::new()
}
