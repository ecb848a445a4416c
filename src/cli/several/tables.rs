//! The tables of a run of several bodies, with the run.json beside them.

use super::run_file::SeveralRun;
use crate::cli::args::PhysicsArgs;
use crate::cli::names::FileKind;
use crate::cli::outcome::{Failure, refuse_flags};
use crate::cli::output::directory_of;
use crate::cli::{input, shown};
use std::fs::File;
use std::io::{BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};
use tumble::mechanics::Load;
use tumble::simulation::tables::{Streams, Table, TableStep, TablesReader};
use tumble::world::World;

/// More bytes than the header of a table has.
const LONGEST_HEADER: u64 = 1 << 12;

/// The tables of a run that are being read.
pub struct RunTables {
    file: PathBuf,
    pub run: SeveralRun,
    pub world: World,
    pub loads: Vec<Load>,
    reader: TablesReader<File>,
}

impl RunTables {
    /// Opens the tables, of which `file` is one; `None` where the run.json beside it is not of
    /// several bodies, and `file` no such table. Of `flags`, none may be given: run.json says all.
    pub fn open(file: &Path, flags: &PhysicsArgs) -> Result<Option<Self>, Failure> {
        let run_path = file.with_file_name("run.json");
        let Some(run) = SeveralRun::read(&run_path)? else {
            return refuse_lonely_table(file, &run_path).map(|()| None);
        };
        refuse_idle_flags(flags)?;
        refuse_another_file(file)?;
        Self::of_run(file, run).map(Some)
    }

    /// Opens the tables of `run`, of which `file` is one.
    pub fn of_run(file: &Path, run: SeveralRun) -> Result<Self, Failure> {
        let run_path = file.with_file_name("run.json");
        let wrong = |failure: Failure| match failure {
            Failure::Setting { name, why } => {
                Failure::Input(format!("{}: model.{name}: {why}", shown::path(&run_path)))
            }
            other => other.in_file(&run_path, FileKind::Run, &[]),
        };
        let world = run.model.world().map_err(wrong)?;
        let loads = run.model.loads().map_err(wrong)?;
        let streams = Streams {
            states: open(file, Table::States)?,
            contacts: open(file, Table::Contacts)?,
            steps: open(file, Table::Steps)?,
        };
        let reader = TablesReader::new(streams, world.bodies().len());
        let reader = reader.map_err(|error| odd(file, &error))?;
        Ok(Self { file: file.to_owned(), run, world, loads, reader })
    }

    /// The next step, its time and states checked; `None` after the last.
    pub fn next_step(&mut self) -> Result<Option<TableStep>, Failure> {
        let step = self.reader.next_step().map_err(|error| self.odd(&error))?;
        if let Some(step) = &step {
            self.check(step).map_err(|why| self.odd(&why))?;
        }
        Ok(step)
    }

    /// What no step can be judged or drawn with.
    fn check(&self, step: &TableStep) -> Result<(), String> {
        let (index, h) = (step.row.index, self.world.time_step());
        let expected = index as f64 * h;
        if (step.row.time - expected).abs() > 1e-9 * expected.max(h) {
            return Err(format!(
                "step {index} has t_s = {}, which does not fit a time step of {h} s",
                step.row.time
            ));
        }
        for (body, state) in step.states.iter().enumerate() {
            let name = &self.run.model.bodies[body].name;
            state.checked().map_err(|error| format!("step {index}, {name}: {error}"))?;
        }
        Ok(())
    }

    /// The index of a body by its name, or else by its number.
    pub fn body(&self, wanted: &str) -> Result<usize, Failure> {
        let bodies = &self.run.model.bodies;
        let named = bodies.iter().position(|body| body.name == wanted);
        let numbered = || wanted.parse().ok().filter(|index| *index < bodies.len());
        named.or_else(numbered).ok_or_else(|| {
            Failure::Input(format!(
                "--body: {} is none; a body's name, as {}, or its number, 0 to {}, is needed",
                shown::line(wanted),
                bodies[0].name,
                bodies.len() - 1
            ))
        })
    }

    /// What is wrong with the tables, in a sentence.
    pub fn odd(&self, why: &dyn std::fmt::Display) -> Failure {
        odd(&self.file, why)
    }

    /// The folder of the tables, as it can be shown.
    pub fn folder(&self) -> String {
        shown::path(directory_of(None, &self.file))
    }

    /// The table that has a row for each step.
    pub fn steps_file(&self) -> PathBuf {
        self.file.with_file_name(format!("{}.csv", Table::Steps))
    }
}

fn odd(file: &Path, why: &dyn std::fmt::Display) -> Failure {
    let folder = shown::path(directory_of(None, file));
    Failure::Input(format!("the tables in {folder} cannot be read: {why}"))
}

/// A table of several bodies says nothing without the model in its run.json.
fn refuse_lonely_table(file: &Path, run_path: &Path) -> Result<(), Failure> {
    let headers = Table::ALL.map(|table| table.columns().join(","));
    let mut first = String::new();
    // What cannot be read is no table, and is refused where it is read.
    let start = input::open(file).map(|file| file.take(LONGEST_HEADER));
    let _ = start.and_then(|start| BufReader::new(start).read_line(&mut first));
    if !headers.iter().any(|header| header == first.trim_end()) {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "{}: a table of several bodies needs the run.json of its run beside it; {} is not there, or \
         is no such file",
        shown::path(file),
        shown::path(run_path)
    )))
}

/// The run.json beside a file says nothing of one that is no table of its run.
fn refuse_another_file(file: &Path) -> Result<(), Failure> {
    let names = Table::ALL.map(|table| format!("{table}.csv"));
    let name = file.file_name().unwrap_or_default();
    if names.iter().any(|table| name == table.as_str()) {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "{}: the run.json beside it is of a run of several bodies; its tables are {}",
        shown::path(file),
        names.join(", ")
    )))
}

fn open(beside: &Path, table: Table) -> Result<File, Failure> {
    let path = beside.with_file_name(format!("{table}.csv"));
    input::open(&path)
        .map_err(|error| Failure::Input(format!("{} cannot be read: {error}", shown::path(&path))))
}

/// All that residuals and pictures depend on stands in run.json.
fn refuse_idle_flags(physics: &PhysicsArgs) -> Result<(), Failure> {
    let given: Vec<_> = physics.given().into_iter().map(|flag| (flag, true)).collect();
    refuse_flags("a run of several bodies, whose run.json says all", &given)
}
