//! Writer for the files of a run in either format.

use super::directory::OutputDirectory;
use super::file_names::{TRAJECTORY, file_of};
use super::outcome::Failure;
use super::output::PendingFile;
use super::scene::Scene;
use super::table_file::{TableSink, WrittenRows};
use serde::{Deserialize, Serialize};
use std::io;
use std::path::{Path, PathBuf};
use tumble_core::simulation::StepRecord;
use tumble_core::step::StepStatus;
use tumble_model::shown;
use tumble_scene::kept::KeptSteps;
use tumble_scene::output::tables::{StepRow, Streams, Table, TablesWriter};
use tumble_scene::output::trajectory::TrajectoryWriter;
use tumble_scene::run_file::Checksums;

/// Writer of the rows in one format.
enum TableWriters {
    Trajectory(Box<TrajectoryWriter<TableSink>>),
    Tables(Box<TablesWriter<TableSink>>),
}

/// Writes the rows of a run to temporary files, which are renamed at the end.
pub struct RunWriter {
    files: Vec<PendingFile>,
    rows: TableWriters,
    /// Rows before the final one, which only has the state.
    before_end: RowsSoFar,
    /// True if the run can be continued from a checkpoint.
    pub has_checkpoint: bool,
}

/// Files with all rows of a run.
pub struct WrittenFiles {
    pub files: Vec<PendingFile>,
    pub checksums: Checksums,
    /// Rows before the final one, which only has the state.
    pub before_end: RowsSoFar,
}

/// Rows of an unfinished run.
#[derive(Default, Serialize, Deserialize)]
pub struct RowsSoFar {
    /// Size of each table.
    pub tables: Vec<WrittenRows>,
    /// Row of the table `steps` that is not written yet.
    pub open: Option<StepRow>,
}

/// Rows written by an earlier run.
#[derive(Clone, Copy)]
pub struct Written<'a> {
    /// Directory of their files.
    pub directory: &'a Path,
    pub rows: &'a RowsSoFar,
}

impl RunWriter {
    /// Opens the files of a run of `scene` with the selection `kept`. Writes their headers, or
    /// copies the rows of an earlier run, `written`.
    pub fn create(
        scene: &Scene,
        kept: &KeptSteps,
        out: &OutputDirectory,
        written: Option<Written<'_>>,
    ) -> Result<Self, Failure> {
        let mut files = Vec::new();
        let mut open = |name: &str| {
            let name = file_of(name, kept.form);
            let file = PendingFile::create(out, &name)?;
            let mut stream = TableSink::new(file.open()?, kept.form);
            if let Some(written) = written {
                copy_rows(&written, &name, &mut stream)?;
            }
            files.push(file);
            Ok::<_, Failure>(stream)
        };
        let (goes_on, world) = (written.is_some(), &scene.world);
        let (every, first) = (kept.every, scene.start_index);
        let rows = if scene.trajectory {
            let stream = open(TRAJECTORY)?;
            let rows = if goes_on {
                TrajectoryWriter::after(stream, world)
            } else {
                TrajectoryWriter::new(stream, world)
            };
            rows.map(|rows| TableWriters::Trajectory(Box::new(rows.every(every, first))))
        } else {
            let has = |table: Table| has(scene, kept, table);
            let states = open(Table::States.name())?;
            let contacts =
                has(Table::Contacts).then(|| open(Table::Contacts.name())).transpose()?;
            let steps = open(Table::Steps.name())?;
            let joints = has(Table::Joints).then(|| open(Table::Joints.name())).transpose()?;
            let gears = has(Table::Gears).then(|| open(Table::Gears.name())).transpose()?;
            let ends = has(Table::Ends).then(|| open(Table::Ends.name())).transpose()?;
            let streams = Streams { states, contacts, steps, joints, gears, ends };
            let rows = if goes_on {
                Ok(TablesWriter::after(streams, world))
            } else {
                TablesWriter::new(streams, world)
            };
            let open = written.and_then(|written| written.rows.open.clone());
            rows.map(|rows| {
                let rows = rows.goes_on(open).driven(scene.courses.clone()).every(every, first);
                TableWriters::Tables(Box::new(rows))
            })
        };
        let rows = rows.map_err(|error| files[0].failed(&error))?;
        Ok(Self { files, rows, before_end: RowsSoFar::default(), has_checkpoint: false })
    }

    /// Names of the files that [`RunWriter::create`] opens.
    pub fn names(scene: &Scene, kept: &KeptSteps) -> Vec<String> {
        if scene.trajectory {
            return vec![file_of(TRAJECTORY, kept.form)];
        }
        let tables = Table::ALL.into_iter().filter(|table| has(scene, kept, *table));
        tables.map(|table| file_of(table.name(), kept.form)).collect()
    }

    /// File in `directory` through which a run of `scene` is opened.
    pub fn first_file(scene: &Scene, kept: &KeptSteps, directory: &Path) -> PathBuf {
        let name = if scene.trajectory { TRAJECTORY } else { Table::States.name() };
        directory.join(file_of(name, kept.form))
    }

    /// Writes the rows of one step, if it is selected.
    pub fn write(&mut self, record: &StepRecord) -> Result<(), Failure> {
        if record.report.status == StepStatus::End {
            let RowsSoFar { tables, open } = self.rows_so_far(|_| Ok(()))?;
            let tables = tables.into_iter().map(WrittenRows::in_place).collect();
            self.before_end = RowsSoFar { tables, open };
        }
        let written = match &mut self.rows {
            TableWriters::Trajectory(rows) => rows.write(record),
            TableWriters::Tables(rows) => rows.write(record),
        };
        written.map_err(|error| self.files[0].failed(&error))
    }

    /// Syncs the rows so far to the disk and returns them.
    pub fn synced_rows(&mut self) -> Result<RowsSoFar, Failure> {
        self.rows_so_far(TableSink::sync)
    }

    /// Rows so far, after `flushed` is applied to each table.
    fn rows_so_far(
        &mut self,
        flushed: impl Fn(&mut TableSink) -> io::Result<()>,
    ) -> Result<RowsSoFar, Failure> {
        let open = match &self.rows {
            TableWriters::Trajectory(_) => None,
            TableWriters::Tables(rows) => rows.open().cloned(),
        };
        let streams = match &mut self.rows {
            TableWriters::Trajectory(rows) => rows.flushed().map(|stream| vec![stream]),
            TableWriters::Tables(rows) => rows.flushed(),
        };
        let tables = streams.and_then(|streams| {
            let of = |(stream, file): (&mut TableSink, &PendingFile)| {
                flushed(stream)?;
                stream.rows(file.name(), file.temporary_name())
            };
            streams.into_iter().zip(&self.files).map(of).collect()
        });
        let tables = tables.map_err(|error| self.files[0].failed(&error))?;
        Ok(RowsSoFar { tables, open })
    }

    /// Keeps the temporary files if there is a checkpoint to continue from. Returns whether there
    /// is one.
    pub fn leave(self) -> bool {
        if self.has_checkpoint {
            self.files.into_iter().for_each(PendingFile::leave);
        }
        self.has_checkpoint
    }

    /// Syncs the files to the disk and returns their checksums, so that a full disk is noticed
    /// before the rename.
    pub fn finish(self) -> Result<WrittenFiles, Failure> {
        let streams = match self.rows {
            TableWriters::Trajectory(rows) => rows.finish().map(|stream| vec![stream]),
            TableWriters::Tables(rows) => {
                rows.finish().map(|Streams { states, contacts, steps, joints, gears, ends }| {
                    // Same order as in `create`.
                    let all = [Some(states), contacts, Some(steps), joints, gears, ends];
                    all.into_iter().flatten().collect()
                })
            }
        };
        let sums = streams.and_then(|streams| {
            streams.into_iter().map(TableSink::finish).collect::<io::Result<Vec<_>>>()
        });
        let sums = sums.map_err(|error| self.files[0].failed(&error))?;
        let checksums = self.files.iter().map(PendingFile::name).zip(sums).collect();
        Ok(WrittenFiles { files: self.files, checksums, before_end: self.before_end })
    }
}

/// True if a run of `scene` with the selection `kept` has the table.
fn has(scene: &Scene, kept: &KeptSteps, table: Table) -> bool {
    kept.has(table)
        && match table {
            Table::Joints => !scene.joints.is_empty(),
            Table::Gears => !scene.world.gears().is_empty(),
            Table::States | Table::Contacts | Table::Steps | Table::Ends => true,
        }
}

/// Copies the existing rows of the table `name`.
fn copy_rows(written: &Written<'_>, name: &str, to: &mut TableSink) -> Result<(), Failure> {
    let rows = written.rows.tables.iter().find(|rows| rows.name == name);
    let copied = rows.map_or_else(
        || Err(io::Error::other("there are none")),
        |rows| rows.copy(written.directory, to),
    );
    copied.map_err(|error| {
        let path = shown::path(&written.directory.join(name));
        Failure::Input(format!("the rows of {path} cannot be copied: {error}"))
    })
}
