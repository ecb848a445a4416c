//! Scenario files, read.

use super::outcome::Failure;
use super::{input, shown};
use std::path::Path;
use tumble::scenario::{LARGEST_FILE, Scenario};

/// Reads and checks a file.
pub fn read(path: &Path) -> Result<Scenario, Failure> {
    Scenario::of_text(&read_text(path)?, path)
}

/// The text of a file that may be a scenario.
pub fn read_text(path: &Path) -> Result<String, Failure> {
    input::text(path, LARGEST_FILE).map_err(|error| {
        let file = shown::path(path);
        Failure::Input(format!("{file}: cannot be read as a scenario: {error}"))
    })
}
