//! Checkpoints: periodic states of a run, next to its temporary files of rows, from which a killed
//! run continues.

use super::continued::{ContinuedNotes, state_bytes};
use super::directory::OutputDirectory;
use super::outcome::Failure;
use super::output::PendingFile;
use super::writer::RowsSoFar;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use tumble_core::simulation::Saved;
use tumble_core::simulation::save::{from_bytes, to_bytes};

/// Name of the checkpoint file.
pub const FILE: &str = "checkpoint.bin";

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
    pub fn of_bytes(bytes: &[u8]) -> Result<Self, Failure> {
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
    /// Writes the checkpoint of a run in the state `saved`, with its results `notes` and the
    /// `rows` so far.
    pub fn write(
        &self,
        saved: Saved,
        notes: ContinuedNotes,
        rows: RowsSoFar,
    ) -> Result<(), Failure> {
        let (run_json, state) =
            (self.run_json.clone(), state_bytes(saved, &notes.with_rows(rows))?);
        let file = PendingFile::create(self.directory, FILE)?;
        file.write(&to_bytes(&Checkpoint { run_json, state })?)?;
        file.publish().map(drop)
    }
}
