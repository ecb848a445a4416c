//! The files of a run, in either format.

use super::directory::OutputDirectory;
use super::outcome::Failure;
use super::output::PendingFile;
use super::scene::{OutputFormat, Scene};
use super::{input, shown};
use std::fs::File;
use std::io::{self, BufRead, BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use tumble::simulation::StepRecord;
use tumble::simulation::tables::{Streams, Table, TablesWriter};
use tumble::simulation::trajectory::TrajectoryWriter;

type Stream = BufWriter<File>;

const TRAJECTORY: &str = "trajectory";

/// The name of the file of a table.
fn file_of(table: &str) -> String {
    format!("{table}.csv")
}

/// The names of the files of rows, of both formats.
pub fn row_files() -> impl Iterator<Item = String> {
    [TRAJECTORY].into_iter().chain(Table::ALL.map(Table::name)).map(file_of)
}

/// What writes the rows of one format.
enum Rows {
    Trajectory(Box<TrajectoryWriter<Stream>>),
    Tables(Box<TablesWriter<Stream>>),
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
    /// How many steps they are.
    pub steps: u64,
}

impl RunWriter {
    /// Opens the files of a run of `scene`, and writes their headers or what of the run is `written`.
    pub fn create(
        scene: &Scene,
        out: &OutputDirectory,
        written: Option<Written<'_>>,
    ) -> Result<Self, Failure> {
        let file = |name: &str| PendingFile::create(out, &file_of(name));
        // Of a file with so many rows a step.
        let stream = |file: &PendingFile, name: &str, rows: Option<u64>| {
            let mut stream = file.stream()?;
            if let Some(Written { directory, steps }) = written {
                let lines = rows.map(|rows| 1 + rows * steps);
                copy_lines(&directory.join(file_of(name)), lines, &mut stream)?;
            }
            Ok::<_, Failure>(stream)
        };
        let goes_on = written.is_some();
        let (files, rows) = match scene.format {
            OutputFormat::Trajectory => {
                let trajectory = file(TRAJECTORY)?;
                let stream = stream(&trajectory, TRAJECTORY, Some(1))?;
                let rows = match goes_on {
                    true => TrajectoryWriter::after(stream, &scene.world),
                    false => TrajectoryWriter::new(stream, &scene.world),
                };
                (vec![trajectory], rows.map(|rows| Rows::Trajectory(Box::new(rows))))
            }
            OutputFormat::Tables(_) => {
                let of = |table: Table| file(table.name());
                let has_joints = !scene.joints.is_empty();
                let joints = has_joints.then(|| of(Table::Joints)).transpose()?;
                let [states, contacts, steps] = Table::ALWAYS.map(of);
                let files = [states?, contacts?, steps?];
                let rows = [Some(scene.bodies.len() as u64), None, Some(1)];
                let [states, contacts, steps] =
                    [0, 1, 2].map(|at| stream(&files[at], Table::ALWAYS[at].name(), rows[at]));
                let joint_rows = Some(scene.joints.len() as u64);
                let of_joints =
                    joints.as_ref().map(|file| stream(file, Table::Joints.name(), joint_rows));
                let count = scene.world.gears().len() as u64;
                let gears = (count > 0).then(|| of(Table::Gears)).transpose()?;
                let of_gears =
                    gears.as_ref().map(|file| stream(file, Table::Gears.name(), Some(count)));
                let streams = Streams {
                    states: states?,
                    contacts: contacts?,
                    steps: steps?,
                    joints: of_joints.transpose()?,
                    gears: of_gears.transpose()?,
                };
                let rows = match goes_on {
                    true => Ok(TablesWriter::after(streams, &scene.world)),
                    false => TablesWriter::new(streams, &scene.world),
                };
                let files = files.into_iter().chain(joints).chain(gears).collect();
                let rows = rows.map(|rows| rows.driven(scene.courses.clone()));
                (files, rows.map(|rows| Rows::Tables(Box::new(rows))))
            }
        };
        let rows = rows.map_err(|error| failed(&files, error))?;
        Ok(Self { files, rows })
    }

    /// The file of rows in `directory` by which a run of `scene` is opened.
    pub fn first_file(scene: &Scene, directory: &Path) -> PathBuf {
        directory.join(file_of(match scene.format {
            OutputFormat::Trajectory => TRAJECTORY,
            OutputFormat::Tables(_) => Table::States.name(),
        }))
    }

    /// Writes the rows of one step.
    pub fn write(&mut self, record: &StepRecord) -> Result<(), Failure> {
        let written = match &mut self.rows {
            Rows::Trajectory(rows) => rows.write(record),
            Rows::Tables(rows) => rows.write(record),
        };
        written.map_err(|error| failed(&self.files, error))
    }

    /// Everything down to the disk: a full one must be noticed before the files get their names.
    pub fn finish(self) -> Result<Vec<PendingFile>, Failure> {
        let streams = match self.rows {
            Rows::Trajectory(rows) => rows.finish().map(|stream| vec![stream]),
            Rows::Tables(rows) => {
                rows.finish().map(|Streams { states, contacts, steps, joints, gears }| {
                    [states, contacts, steps].into_iter().chain(joints).chain(gears).collect()
                })
            }
        };
        let written = streams.and_then(|streams| streams.into_iter().try_for_each(to_disk));
        written.map_err(|error| self.files[0].failed(&error))?;
        Ok(self.files)
    }
}

/// Copies the first `lines` of the file `from`, or all of it.
fn copy_lines(from: &Path, lines: Option<u64>, to: &mut Stream) -> Result<(), Failure> {
    let mut copy = || -> io::Result<()> {
        let mut from = BufReader::new(input::open(from)?);
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

fn to_disk(mut stream: Stream) -> io::Result<()> {
    stream.flush()?;
    stream.get_ref().sync_all()
}

fn failed(files: &[PendingFile], error: csv::Error) -> Failure {
    match error.into_kind() {
        csv::ErrorKind::Io(error) => files[0].failed(&error),
        other => Failure::Other(format!("the rows cannot be written: {other:?}")),
    }
}
