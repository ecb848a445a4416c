//! What a run.json says of the files of its run.

use pyo3::prelude::*;
use tumble_scene::run_file::RunFile;

/// The names of the files of the run whose run.json has this text; none of a text that is not as a run wrote it.
#[pyfunction]
pub fn listed_files(text: &str) -> Vec<String> {
    RunFile::listed_files(text)
}
