//! File names in a run.json.

use pyo3::prelude::*;
use tumble_scene::run_file::RunFile;

/// Names of the files of the run with this text of run.json; empty for an invalid text.
#[pyfunction]
pub fn listed_files(text: &str) -> Vec<String> {
    RunFile::listed_files(text)
}
