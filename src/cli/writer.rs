//! The files of a run, in either format.

use super::directory::OutputDirectory;
use super::file_names::{TRAJECTORY, file_of};
use super::kept::Kept;
use super::outcome::Failure;
use super::output::PendingFile;
use super::scene::Scene;
use super::shown;
use super::table_file::{TableSink, TableSource};
use std::io::{self, BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use tumble::scenario::run_file::Checksums;
use tumble::simulation::StepRecord;
use tumble::simulation::tables::{Streams, Table, TablesWriter};
use tumble::simulation::trajectory::TrajectoryWriter;

/// What writes the rows of one format.
enum Rows {
    Trajectory(Box<TrajectoryWriter<TableSink>>),
    Tables(Box<TablesWriter<TableSink>>),
}

/// Writes the rows of a run, and gives the files their names when all are written.
pub struct RunWriter {
    files: Vec<PendingFile>,
    rows: Rows,
}

/// Rows that are there already.
#[derive(Clone, Copy)]
pub struct Written<'a> {
    /// The directory of their files.
    pub directory: &'a Path,
    /// Of how many steps they are, those that are left out counted.
    pub steps: u64,
}

impl RunWriter {
    /// Opens the files of a run of `scene` of which these rows are kept, and writes their headers or what of the
    /// run is `written`.
    pub fn create(
        scene: &Scene,
        kept: &Kept,
        out: &OutputDirectory,
        written: Option<Written<'_>>,
    ) -> Result<Self, Failure> {
        let mut files = Vec::new();
        // Of a file with so many rows a step, or any number.
        let mut open = |name: &str, rows: Option<usize>| {
            let file = PendingFile::create(out, &file_of(name, kept.form))?;
            let mut stream =
                TableSink::new(file.open()?, kept.form).map_err(|error| file.failed(&error))?;
            if let Some(Written { directory, steps }) = written {
                let steps = kept.rows(steps + 1) - 1;
                let lines = rows.map(|rows| 1 + rows as u64 * steps);
                copy_lines(&directory.join(file_of(name, kept.form)), lines, &mut stream)?;
            }
            files.push(file);
            Ok::<_, Failure>(stream)
        };
        let (goes_on, world) = (written.is_some(), &scene.world);
        let (every, first) = (kept.every, scene.start_index);
        let rows = if scene.trajectory {
            let stream = open(TRAJECTORY, Some(1))?;
            let rows = if goes_on {
                TrajectoryWriter::after(stream, world)
            } else {
                TrajectoryWriter::new(stream, world)
            };
            rows.map(|rows| Rows::Trajectory(Box::new(rows.every(every, first))))
        } else {
            let states = open(Table::States.name(), Some(scene.bodies.len()))?;
            let is_there =
                |table: Table, count: usize| (kept.has(table) && count > 0).then_some(count);
            let contacts = is_there(Table::Contacts, 1).map(|_| open(Table::Contacts.name(), None));
            let contacts = contacts.transpose()?;
            let steps = open(Table::Steps.name(), Some(1))?;
            let joints = is_there(Table::Joints, scene.joints.len());
            let joints = joints.map(|count| open(Table::Joints.name(), Some(count)));
            let gears = is_there(Table::Gears, world.gears().len());
            let gears = gears.map(|count| open(Table::Gears.name(), Some(count)));
            let (joints, gears) = (joints.transpose()?, gears.transpose()?);
            let ends = is_there(Table::Ends, scene.bodies.len());
            let ends = ends.map(|count| open(Table::Ends.name(), Some(count))).transpose()?;
            let streams = Streams { states, contacts, steps, joints, gears, ends };
            let rows = if goes_on {
                Ok(TablesWriter::after(streams, world))
            } else {
                TablesWriter::new(streams, world)
            };
            rows.map(|rows| {
                let rows = rows.driven(scene.courses.clone()).every(every, first);
                Rows::Tables(Box::new(rows))
            })
        };
        let rows = rows.map_err(|error| files[0].failed(&error))?;
        Ok(Self { files, rows })
    }

    /// The file of rows in `directory` by which a run of `scene` is opened.
    pub fn first_file(scene: &Scene, kept: &Kept, directory: &Path) -> PathBuf {
        let name = if scene.trajectory { TRAJECTORY } else { Table::States.name() };
        directory.join(file_of(name, kept.form))
    }

    /// Writes the rows of one step, if it is one that is kept.
    pub fn write(&mut self, record: &StepRecord) -> Result<(), Failure> {
        let written = match &mut self.rows {
            Rows::Trajectory(rows) => rows.write(record),
            Rows::Tables(rows) => rows.write(record),
        };
        written.map_err(|error| self.files[0].failed(&error))
    }

    /// The files and their checksums, everything down to the disk: a full one must be noticed before the files
    /// get their names.
    pub fn finish(self) -> Result<(Vec<PendingFile>, Checksums), Failure> {
        let streams = match self.rows {
            Rows::Trajectory(rows) => rows.finish().map(|stream| vec![stream]),
            Rows::Tables(rows) => {
                rows.finish().map(|Streams { states, contacts, steps, joints, gears, ends }| {
                    // As they were opened.
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
        Ok((self.files, checksums))
    }
}

/// Copies the first `lines` of the file `from`, or all of it.
fn copy_lines(from: &Path, lines: Option<u64>, to: &mut TableSink) -> Result<(), Failure> {
    let mut copy = || -> io::Result<()> {
        let mut from = BufReader::new(TableSource::open(from)?);
        let Some(lines) = lines else { return io::copy(&mut from, to).map(drop) };
        let mut line = Vec::new();
        for _ in 0..lines {
            line.clear();
            from.read_until(b'\n', &mut line)?;
            to.write_all(&line)?;
        }
        Ok(())
    };
    copy().map_err(|error| {
        Failure::Other(format!("the rows of {} cannot be copied: {error}", shown::path(from)))
    })
}
