//! Several bodies on the command line: scenario files with `[[bodies]]`, their runs and tables.

mod copies;
mod describe;
mod entries;
mod film;
mod job;
mod masses;
mod model;
mod run_file;
mod scene;
mod shape;
mod simulate;
mod tables;
mod verify;

use super::outcome::Failure;
use std::path::Path;
use tumble::world::World;

pub use film::film;
pub use simulate::run as simulate;
pub use tables::RunTables;
pub use verify::run as verify;

/// The world of the scenario `path`, whose text is `text`.
pub fn world(path: &Path, text: &str) -> Result<World, Failure> {
    Ok(job::Job::of_file(path, text)?.world)
}

/// Whether a scenario's text is of several bodies: whether it has a table that one body's has not.
pub fn is_scenario(text: &str) -> bool {
    let table: Result<toml::Table, _> = toml::from_str(text);
    table.is_ok_and(|table| {
        table.contains_key("bodies") || (table.contains_key("fixed") && !table.contains_key("body"))
    })
}
