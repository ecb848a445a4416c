//! Records on their way from the stepping to the writing, which goes on at the same time.

use super::checkpoint::CheckpointWriter;
use super::continued::ContinuedNotes;
use super::outcome::Failure;
use super::writer::RunWriter;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel};
use std::thread::{Scope, ScopedJoinHandle};
use tumble_core::simulation::{Saved, StepRecord};

/// Pages there are: one that is filled, one that is written, and one between, so that neither waits for a slow
/// step or a slow disk at once.
const PAGES: usize = 3;

/// Records of some steps, one after another.
pub struct RowPage {
    pub records: Vec<StepRecord>,
    /// How many of them are filled.
    pub count: usize,
    /// The run after them, where a checkpoint is due.
    pub checkpoint: Option<(Saved, ContinuedNotes)>,
}

impl RowPage {
    /// The records that are filled.
    pub fn filled(&self) -> &[StepRecord] {
        &self.records[..self.count]
    }
}

/// A few pages, which go round between the steps and their writing: memory does not grow with a run.
pub struct Pages {
    full: SyncSender<RowPage>,
    empty: Receiver<RowPage>,
}

impl Pages {
    /// Pages of so many `records`, and the thread that writes them in the order in which they come, and the checkpoints.
    pub fn new<'scope, 'env>(
        scope: &'scope Scope<'scope, 'env>,
        writer: &'env mut RunWriter,
        checkpoints: Option<&'env CheckpointWriter<'env>>,
        records: usize,
    ) -> (Self, ScopedJoinHandle<'scope, Result<(), Failure>>) {
        let (full, to_write) = sync_channel(PAGES);
        let (written, empty) = channel();
        for _ in 0..PAGES {
            // The receiver is here.
            let records = vec![StepRecord::new(); records];
            let _ = written.send(RowPage { records, count: 0, checkpoint: None });
        }
        let writing = scope.spawn(move || write_all(writer, checkpoints, &to_write, &written));
        (Self { full, empty }, writing)
    }

    /// A page to fill, once there is one; `None` if the writing has ended, which it does by an error alone.
    pub fn empty(&mut self) -> Option<RowPage> {
        let page = self.empty.recv().ok()?;
        Some(RowPage { count: 0, ..page })
    }

    /// Has a page written. Of writing that has ended, its error is what is said.
    pub fn write(&mut self, page: RowPage) {
        let _ = self.full.send(page);
    }
}

fn write_all(
    writer: &mut RunWriter,
    checkpoints: Option<&CheckpointWriter<'_>>,
    to_write: &Receiver<RowPage>,
    written: &Sender<RowPage>,
) -> Result<(), Failure> {
    for mut page in to_write {
        page.filled().iter().try_for_each(|record| writer.write(record))?;
        if let (Some(checkpoints), Some((saved, notes))) = (checkpoints, page.checkpoint.take()) {
            checkpoints.write(saved, notes, writer.synced_rows()?)?;
            writer.has_checkpoint = true;
        }
        // Nobody wants it back after the last.
        let _ = written.send(page);
    }
    Ok(())
}
