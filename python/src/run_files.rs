//! Contents of a run.json.

use crate::errors::refused;
use crate::scene::in_python;
use pyo3::prelude::*;
use std::path::Path;
use tumble_scene::run_file::RunFile;
use tumble_scene::scene::Scene as Content;

/// Names of the files of the run with this text of run.json; empty for an invalid text.
#[pyfunction]
pub fn listed_files(text: &str) -> Vec<String> {
    RunFile::listed_files(text)
}

/// Parses the text of the run.json of a run of a scene.
///
/// # Errors
/// A text that is not a run.json, or that has other bodies than the scene.
pub fn run_of_scene(content: &Content, text: &str) -> PyResult<RunFile> {
    let file = RunFile::from_text(text, Path::new("run.json")).map_err(in_python)?;
    let (own, of_run) = (&content.document.bodies, &file.model.bodies);
    // Two bodies are the same if they have the same name, mass and inertia.
    let other = own.iter().zip(of_run).find(|(own, of_run)| {
        own.name != of_run.name || own.mass != of_run.mass || own.inertia != of_run.inertia
    });
    let difference = match other {
        Some((own, of_run)) => {
            let [own, of_run] =
                [own, of_run].map(|of| format!("{:?} of {} kg", of.name(), of.mass()));
            Some((own, of_run))
        }
        None if own.len() == of_run.len() => None,
        None => Some((format!("{} bodies", own.len()), format!("{} bodies", of_run.len()))),
    };
    match difference {
        None => Ok(file),
        Some((own, of_run)) => Err(refused(format!(
            "the run is of another scene: its run.json has {of_run} where the scene has {own}; give \
             the scene of the run"
        ))),
    }
}
