//! What a run that is killed leaves to be continued from: its state now and then, beside the temporary files of its
//! rows.

use super::continued::{ContinuedNotes, state_bytes};
use super::directory::OutputDirectory;
use super::outcome::Failure;
use super::output::PendingFile;
use super::table_file::WrittenRows;
use serde::{Deserialize, Serialize};
use std::time::Duration;
use tumble_core::simulation::Saved;
use tumble_core::simulation::save::{from_bytes, to_bytes};

/// The name of the file.
pub const FILE: &str = "checkpoint.bin";

/// A run at some step.
#[derive(Serialize, Deserialize)]
pub struct Checkpoint {
    /// The text of a run.json with the scene.
    pub run_json: String,
    /// What a state.bin has.
    pub state: Vec<u8>,
}

impl Checkpoint {
    /// What the bytes of a checkpoint say.
    pub fn of_bytes(bytes: &[u8]) -> Result<Self, Failure> {
        Ok(from_bytes(bytes)?)
    }
}

/// Writes the checkpoints of a run to one file, each in place of the one before.
pub struct CheckpointWriter<'a> {
    /// Where the run writes.
    pub directory: &'a OutputDirectory,
    /// The text of a run.json with the scene.
    pub run_json: String,
    /// The time between two of them.
    pub every: Duration,
}

impl CheckpointWriter<'_> {
    /// Writes the checkpoint of a run in the state `saved`, which came to `notes` and whose tables have these `rows`.
    pub fn write(
        &self,
        saved: Saved,
        notes: ContinuedNotes,
        rows: Vec<WrittenRows>,
    ) -> Result<(), Failure> {
        let (run_json, state) =
            (self.run_json.clone(), state_bytes(saved, &notes.with_rows(rows))?);
        let file = PendingFile::create(self.directory, FILE)?;
        file.write(&to_bytes(&Checkpoint { run_json, state })?)?;
        file.publish().map(drop)
    }
}
