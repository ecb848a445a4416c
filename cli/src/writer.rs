//! Writer for the files of a run.

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
use tumble_scene::output::tables::{OpenRows, Streams, Table, TablesWriter};
use tumble_scene::output::trajectory::TrajectoryWriter;
use tumble_scene::row_selection::RowSelection;
use tumble_scene::run_file::Checksums;

/// Writes the rows of a run to temporary files, which are renamed at the end.
pub struct RunWriter {
    files: Vec<PendingFile>,
    tables: TablesWriter<TableSink>,
    /// Export of the tutorial's scene.
    trajectory: Option<TrajectoryWriter<TableSink>>,
    /// Rows before the final one, which only has the state.
    before_end: RowsSoFar,
    /// Name of the file of the table `ends`.
    ends: String,
    /// True if the run can be continued from a checkpoint.
    pub has_checkpoint: bool,
}

/// Files with all rows of a run.
pub struct WrittenFiles {
    pub files: Vec<PendingFile>,
    pub checksums: Checksums,
    /// Name of the file of the table `ends`, if that has no rows and no file.
    pub omitted: Option<String>,
    /// Rows before the final one, which only has the state.
    pub before_end: RowsSoFar,
}

/// Rows of an unfinished run.
#[derive(Default, Serialize, Deserialize)]
pub struct RowsSoFar {
    /// Size of each table.
    pub tables: Vec<WrittenRows>,
    /// Rows that are not written yet.
    pub open: OpenRows,
}

/// Rows written by an earlier run.
#[derive(Clone, Copy)]
pub struct Written<'a> {
    /// Directory of their files.
    pub directory: &'a Path,
    pub rows: &'a RowsSoFar,
}

impl RunWriter {
    /// Opens the files of a run of `scene` with the rows and tables of `selection`. Writes their
    /// headers, or copies the rows of an earlier run, `written`.
    pub fn create(
        scene: &Scene,
        selection: &RowSelection,
        out: &OutputDirectory,
        written: Option<Written<'_>>,
    ) -> Result<Self, Failure> {
        let ends = file_of(Table::Ends.name(), selection.form);
        let mut files = Vec::new();
        let mut open = |name: &str| {
            let name = file_of(name, selection.form);
            let file = PendingFile::create(out, &name)?;
            let mut stream = TableSink::new(file.open()?, selection.form);
            // A table `ends` without rows has no file.
            let is_omitted = |rows: &RowsSoFar| name == ends && !rows.open.has_ends;
            if let Some(written) = written.filter(|written| !is_omitted(written.rows)) {
                copy_rows(&written, &name, &mut stream)?;
            }
            files.push(file);
            Ok::<_, Failure>(stream)
        };
        let (continues, world) = (written.is_some(), &scene.world);
        let (every, first) = (selection.every, scene.start_index);
        let has = |table: Table| has(scene, selection, table);
        // In the order of `Streams::in_order`.
        let states = open(Table::States.name())?;
        let contacts = has(Table::Contacts).then(|| open(Table::Contacts.name())).transpose()?;
        let steps = open(Table::Steps.name())?;
        let joints = has(Table::Joints).then(|| open(Table::Joints.name())).transpose()?;
        let gears = has(Table::Gears).then(|| open(Table::Gears.name())).transpose()?;
        let end_rows = has(Table::Ends).then(|| open(Table::Ends.name())).transpose()?;
        let trajectory = scene.trajectory.then(|| open(TRAJECTORY)).transpose()?;
        let streams = Streams { states, contacts, steps, joints, gears, ends: end_rows };
        let tables = if let Some(written) = written {
            TablesWriter::after(streams, world, written.rows.open.clone())
        } else {
            TablesWriter::new(streams, world).map_err(|error| files[0].failed(&error))?
        };
        let tables = tables.driven(scene.courses.clone()).every(every, first);
        let tables = tables.without_idle_contacts(selection.loaded_contacts).short(selection.short);
        let trajectory = trajectory.map(|stream| {
            let rows = if continues {
                TrajectoryWriter::after(stream, world)
            } else {
                TrajectoryWriter::new(stream, world)
            };
            rows.every(every, first)
        });
        let before_end = RowsSoFar::default();
        Ok(Self { files, tables, trajectory, before_end, ends, has_checkpoint: false })
    }

    /// Names of the files that [`RunWriter::create`] opens.
    pub fn names(scene: &Scene, selection: &RowSelection) -> Vec<String> {
        let tables = Table::ALL.into_iter().filter(|table| has(scene, selection, *table));
        let names = tables.map(Table::name).chain(scene.trajectory.then_some(TRAJECTORY));
        names.map(|name| file_of(name, selection.form)).collect()
    }

    /// Writes the rows of one step, if it is selected.
    pub fn write(&mut self, record: &StepRecord) -> Result<(), Failure> {
        if record.status() == StepStatus::End {
            let RowsSoFar { tables, open } = self.rows_so_far(|_| Ok(()))?;
            let tables = tables.into_iter().map(WrittenRows::in_place).collect();
            self.before_end = RowsSoFar { tables, open };
        }
        let written = self.tables.write(record).and_then(|()| match &mut self.trajectory {
            Some(rows) => rows.write(record),
            None => Ok(()),
        });
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
        let open = self.tables.open().clone();
        let streams = self.tables.flushed().and_then(|mut streams| {
            if let Some(rows) = &mut self.trajectory {
                streams.push(rows.flushed()?);
            }
            Ok(streams)
        });
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
        let (tables, trajectory) = (self.tables, self.trajectory);
        let has_ends = tables.open().has_ends;
        let streams = tables.finish().and_then(|tables| {
            let trajectory = trajectory.map(TrajectoryWriter::finish).transpose()?;
            Ok(tables.in_order().chain(trajectory))
        });
        let sums = streams
            .and_then(|streams| streams.map(TableSink::finish).collect::<io::Result<Vec<_>>>());
        let sums = sums.map_err(|error| self.files[0].failed(&error))?;
        let all = self.files.into_iter().zip(sums);
        // A table without rows is no file.
        let (files, sums): (Vec<_>, Vec<_>) =
            all.filter(|(file, _)| has_ends || file.name() != self.ends).unzip();
        let checksums = files.iter().map(PendingFile::name).zip(sums).collect();
        let omitted = (!has_ends).then_some(self.ends);
        Ok(WrittenFiles { files, checksums, omitted, before_end: self.before_end })
    }
}

/// Renames the complete `files` of a run and removes files of an earlier one. Returns the new paths,
/// and lines about both.
pub fn publish(
    files: Vec<PendingFile>,
    out: &OutputDirectory,
) -> Result<(Vec<PathBuf>, String), Failure> {
    let written = files.into_iter().map(PendingFile::publish).collect::<Result<Vec<_>, _>>()?;
    let removed = out.remove_former(&written)?;
    let names: Vec<_> = written.iter().map(|path| shown::path(path)).collect();
    let mut text = format!("wrote {}\n", names.join(", "));
    if !removed.is_empty() {
        text += &format!("removed {} from an earlier run\n", removed.join(", "));
    }
    Ok((written, text))
}

/// True if a run of `scene` with the rows and tables of `selection` has the table.
fn has(scene: &Scene, selection: &RowSelection, table: Table) -> bool {
    selection.has(table)
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
