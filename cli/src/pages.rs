//! Buffers of records between the stepping thread and the writing thread.

use super::checkpoint::CheckpointWriter;
use super::outcome::Failure;
use super::results::RunResults;
use super::writer::RunWriter;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread::{Scope, ScopedJoinHandle};
use tumble_core::simulation::{Saved, StepRecord};

/// Number of buffers: one being filled, one being written, and one between. Slow steps and a slow
/// disk then do not wait for each other.
const PAGES: usize = 3;

/// Buffer for the records of some steps.
pub struct RecordBuffer {
    pub records: Vec<StepRecord>,
    /// Number of filled records.
    pub count: usize,
    /// State of the run after them, if a checkpoint is due.
    pub checkpoint: Option<(Saved, RunResults)>,
}

impl RecordBuffer {
    /// Filled records.
    pub fn filled(&self) -> &[StepRecord] {
        &self.records[..self.count]
    }
}

/// Buffers that circulate between stepping and writing, so that memory does not grow with a run.
pub struct RecordBuffers {
    full: SyncSender<RecordBuffer>,
    empty: Receiver<RecordBuffer>,
}

impl RecordBuffers {
    /// Creates buffers of `records` records, and the thread that writes them and the checkpoints in
    /// order.
    pub fn new<'scope, 'env>(
        scope: &'scope Scope<'scope, 'env>,
        writer: &'env mut RunWriter,
        checkpoints: Option<&'env CheckpointWriter<'env>>,
        records: usize,
    ) -> (Self, ScopedJoinHandle<'scope, Result<(), Failure>>) {
        let (full, to_write) = sync_channel(PAGES);
        let (written, empty) = channel();
        for _ in 0..PAGES {
            // The receiver exists in this function.
            let records = vec![StepRecord::new(); records];
            let _ = written.send(RecordBuffer { records, count: 0, checkpoint: None });
        }
        let writing = scope.spawn(move || write_all(writer, checkpoints, &to_write, &written));
        (Self { full, empty }, writing)
    }

    /// Returns an empty buffer, waiting if necessary. `None` if the writing thread ended with an
    /// error.
    pub fn empty(&mut self) -> Option<RecordBuffer> {
        let page = self.empty.recv().ok()?;
        Some(RecordBuffer { count: 0, ..page })
    }

    /// Sends a buffer to the writing thread. Its error is reported when the thread is joined.
    pub fn write(&mut self, page: RecordBuffer) {
        let _ = self.full.send(page);
    }
}

fn write_all(
    writer: &mut RunWriter,
    checkpoints: Option<&CheckpointWriter<'_>>,
    to_write: &Receiver<RecordBuffer>,
    written: &Sender<RecordBuffer>,
) -> Result<(), Failure> {
    for mut page in to_write {
        page.filled().iter().try_for_each(|record| writer.write(record))?;
        if let (Some(checkpoints), Some((saved, run))) = (checkpoints, page.checkpoint.take()) {
            checkpoints.write(saved, run, writer.synced_rows()?)?;
            writer.has_checkpoint = true;
        }
        // After the last buffer the receiver is gone.
        let _ = written.send(page);
    }
    Ok(())
}
