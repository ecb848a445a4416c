//! Several bodies on the command line: scenario files with `[[bodies]]`, their runs and tables.

mod copies;
mod describe;
mod entries;
mod job;
mod masses;
mod model;
mod run_file;
mod scene;
mod shape;
mod simulate;
mod verify;

pub use run_file::refuse_run_of_several;
pub use simulate::run as simulate;
pub use verify::run as verify;

use super::outcome::Failure;
use run_file::SeveralRun;
use std::path::Path;

/// Whether a scenario's text is of several bodies: whether it has a table that one body's has not.
pub fn is_scenario(text: &str) -> bool {
    let table: Result<toml::Table, _> = toml::from_str(text);
    table.is_ok_and(|table| {
        table.contains_key("bodies") || (table.contains_key("fixed") && !table.contains_key("body"))
    })
}

/// Whether the run.json beside `file` is of several bodies.
pub fn is_run(file: &Path) -> Result<bool, Failure> {
    Ok(SeveralRun::read(&file.with_file_name("run.json"))?.is_some())
}
