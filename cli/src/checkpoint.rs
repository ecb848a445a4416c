//! Saved states of a run with its results, and checkpoints. A killed run continues from its
//! checkpoint, next to its temporary files of rows.

use super::directory::OutputDirectory;
use super::file_names::CHECKPOINT;
use super::outcome::Failure;
use super::output::PendingFile;
use super::results::RunResults;
use super::writer::RowsSoFar;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use tumble_core::simulation::Saved;
use tumble_core::simulation::save::{from_bytes, to_bytes};

/// Results of the run stored together with the simulation's state.
#[derive(Serialize, Deserialize)]
pub struct ContinuedNotes {
    /// Rows without the final one that only has the state.
    pub rows: RowsSoFar,
    pub run: RunResults,
}

/// Serialises the state of a run.
pub fn state_bytes(saved: Saved, notes: &ContinuedNotes) -> Result<Vec<u8>, Failure> {
    Ok(saved.with_notes(to_bytes(notes)?).to_bytes()?)
}

/// A run at some step.
#[derive(Serialize, Deserialize)]
pub struct Checkpoint {
    /// Text of a run.json with the scene.
    pub run_json: String,
    /// Content of a state.bin.
    pub state: Vec<u8>,
}

impl Checkpoint {
    /// Parses the bytes of a checkpoint.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(from_bytes(bytes)?)
    }
}

/// Writes the checkpoints of a run to one file, each replacing the previous one.
pub struct CheckpointWriter<'a> {
    /// Output directory of the run.
    pub directory: &'a OutputDirectory,
    /// Text of a run.json with the scene.
    pub run_json: String,
    /// Time between two checkpoints.
    pub every: Duration,
}

impl CheckpointWriter<'_> {
    /// Writes the checkpoint of a run in the state `saved`, with its results and the
    /// `rows` so far.
    pub fn write(&self, saved: Saved, run: RunResults, rows: RowsSoFar) -> Result<(), Failure> {
        let run_json = self.run_json.clone();
        let state = state_bytes(saved, &ContinuedNotes { rows, run })?;
        let file = PendingFile::create(self.directory, CHECKPOINT)?;
        file.write(&to_bytes(&Checkpoint { run_json, state })?)?;
        file.publish().map(drop)
    }
}
