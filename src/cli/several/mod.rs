//! Several bodies on the command line: scenario files with `[[bodies]]`, their runs and tables.

mod describe;
mod film;
mod job;
mod run_file;
mod simulate;
mod tables;
mod verify;

use super::input;
use super::names::FileKind;
use super::outcome::Failure;
use super::settings::Settings;
use std::path::Path;
use tumble::world::World;

pub use film::film;
pub use simulate::run as simulate;
pub use tables::RunTables;
pub use tumble::scenario::several::{is_scenario, model};
pub use verify::run as verify;

/// The world of the scenario `path`, whose text is `text`.
pub fn world(path: &Path, text: &str) -> Result<World, Failure> {
    let job = job::Job::of(Settings::default(), path, text, &input::bytes);
    Ok(job.map_err(|failure| failure.in_file(path, FileKind::Scenario, &[]))?.world)
}
