//! Scenario files, read.

use super::outcome::Failure;
use super::{input, shown};
use std::path::Path;
use tumble::scenario::LARGEST_FILE;

/// The text of a file that may be a scenario.
pub fn read_text(path: &Path) -> Result<String, Failure> {
    input::text(path, LARGEST_FILE).map_err(|error| {
        let file = shown::path(path);
        Failure::Input(format!("{file}: cannot be read as a scenario: {error}"))
    })
}
