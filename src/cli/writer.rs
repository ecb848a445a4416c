//! The files of a run, in either format.

use super::directory::OutputDirectory;
use super::outcome::Failure;
use super::output::PendingFile;
use super::scene::{OutputFormat, Scene};
use std::fs::File;
use std::io::{self, BufWriter, Write};
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

impl RunWriter {
    /// Opens the files of a run of `scene` and writes their headers.
    pub fn create(scene: &Scene, out: &OutputDirectory) -> Result<Self, Failure> {
        let file = |name: &str| PendingFile::create(out, &file_of(name));
        let (files, rows) = match scene.format {
            OutputFormat::Trajectory => {
                let trajectory = file(TRAJECTORY)?;
                let rows = TrajectoryWriter::new(trajectory.stream()?, &scene.world);
                (vec![trajectory], rows.map(|rows| Rows::Trajectory(Box::new(rows))))
            }
            OutputFormat::Tables(_) => {
                let of = |table: Table| file(table.name());
                let has_joints = !scene.joints.is_empty();
                let joints = has_joints.then(|| of(Table::Joints)).transpose()?;
                let [states, contacts, steps] = Table::ALWAYS.map(of);
                let files = [states?, contacts?, steps?];
                let [states, contacts, steps] = files.each_ref().map(PendingFile::stream);
                let streams = Streams {
                    states: states?,
                    contacts: contacts?,
                    steps: steps?,
                    joints: joints.as_ref().map(PendingFile::stream).transpose()?,
                };
                let rows = TablesWriter::new(streams, &scene.world);
                (
                    files.into_iter().chain(joints).collect(),
                    rows.map(|rows| Rows::Tables(Box::new(rows))),
                )
            }
        };
        let rows = rows.map_err(|error| failed(&files, error))?;
        Ok(Self { files, rows })
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
                rows.finish().map(|Streams { states, contacts, steps, joints }| {
                    [states, contacts, steps].into_iter().chain(joints).collect()
                })
            }
        };
        let written = streams.and_then(|streams| streams.into_iter().try_for_each(to_disk));
        written.map_err(|error| self.files[0].failed(&error))?;
        Ok(self.files)
    }
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
