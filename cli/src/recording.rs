//! Reader for the files of a run in either format: rows and model.

use super::args::PhysicsArgs;
use super::file_names::{TRAJECTORY, file_of};
use super::input;
use super::outcome::{Failure, refuse_flags};
use super::output::directory_of;
use super::scene::of_physics;
use super::table_file::TableSource;
use std::io::{self, BufRead as _, BufReader, Read as _};
use std::path::{Path, PathBuf};
use tumble::solver::{ACCEPTED_RESIDUAL, LADDER_RESIDUAL};
use tumble::step_nlp::StepNlp;
use tumble_core::contact::Detection;
use tumble_core::joint::Knots;
use tumble_core::mechanics::{Load, State};
use tumble_core::solver::native;
use tumble_core::step::StepStatus;
use tumble_core::world::World;
use tumble_model::names::FileKind;
use tumble_model::shown;
use tumble_scene::choices::SceneName;
use tumble_scene::kept::{KeptSteps, TableForm};
use tumble_scene::output::tables::{Streams, Table, TableStep, TablesReader};
use tumble_scene::output::trajectory::{TrajectoryReader, TrajectoryRow};
use tumble_scene::physics;
use tumble_scene::run_file::{self, RunFile, Seal, SolverSettings, checksum_of};
use tumble_scene::settings::Settings;

/// Upper bound for the length of a table's header, bytes.
const LONGEST_HEADER: u64 = 1 << 12;

/// Files of a run being read.
pub struct Recording<'a> {
    path: &'a Path,
    rows: RecordingRows,
    /// run.json, which always exists for tables of several bodies.
    pub run: Option<RunFile>,
    pub world: World,
    /// One load per body.
    pub loads: Vec<Load>,
    /// Prescribed motions of joint frames fixed in the world, by joint index.
    pub courses: Vec<(usize, Knots)>,
}

/// Reader of the rows in one format.
enum RecordingRows {
    Trajectory(Box<TrajectoryReader<TableSource>>),
    Tables(Box<TablesReader<TableSource>>),
}

/// A step in one format.
pub enum RecordedStep {
    Trajectory(TrajectoryRow),
    Tables(TableStep),
}

impl RecordedStep {
    /// Step index k.
    pub fn index(&self) -> u64 {
        match self {
            Self::Trajectory(row) => row.index,
            Self::Tables(step) => step.row.index,
        }
    }

    fn time(&self) -> f64 {
        match self {
            Self::Trajectory(row) => row.time,
            Self::Tables(step) => step.row.time,
        }
    }

    pub fn status(&self) -> StepStatus {
        match self {
            Self::Trajectory(row) => row.status,
            Self::Tables(step) => step.row.status,
        }
    }

    /// Residual in the file, m/s.
    pub fn residual(&self) -> f64 {
        match self {
            Self::Trajectory(row) => row.residual,
            Self::Tables(step) => step.row.residual,
        }
    }

    /// States X at step k+1, if the files store them with the step; otherwise empty.
    pub fn ends(&self) -> &[State] {
        match self {
            Self::Trajectory(_) => &[],
            Self::Tables(step) => &step.ends,
        }
    }

    /// States X at step k, one per body.
    pub fn states(&self) -> &[State] {
        match self {
            Self::Trajectory(row) => std::slice::from_ref(&row.state),
            Self::Tables(step) => &step.states,
        }
    }
}

impl<'a> Recording<'a> {
    /// Opens the files of a run through one of them, `path`, with the run.json in its directory.
    /// Only a trajectory can lack run.json. It then has the drop scene's parameters, changed by
    /// `flags`.
    pub fn open(path: &'a Path, flags: &PhysicsArgs) -> Result<Self, Failure> {
        refuse_no_table(path)?;
        let run_path = path.with_file_name("run.json");
        let run = RunFile::read(input::text(&run_path, run_file::LARGEST_FILE), &run_path, || {
            refuse_lonely_table(path, &run_path)
        })?;
        let Some(run) = run else { return Self::without_run(path, of_physics(flags)?) };
        let given: Vec<_> = flags.given().iter().map(|flag| (*flag, true)).collect();
        refuse_flags("a run.json, which has all parameters", &given)?;
        if !run.trajectory {
            refuse_another_file(path, run.kept.form)?;
        }
        Self::of_run(path, run)
    }

    /// Opens the files of `run` through one of them, `path`.
    pub fn of_run(path: &'a Path, run: RunFile) -> Result<Self, Failure> {
        let run_path = path.with_file_name("run.json");
        let wrong = |failure: Failure| match failure {
            Failure::Setting { name, why } => {
                Failure::Input(format!("{}: model.{name}: {why}", shown::path(&run_path)))
            }
            other => other.in_file(&run_path, FileKind::Run, &[]),
        };
        let (model, kept) = (&run.model, &run.kept);
        let world = model.world().map_err(wrong)?;
        let loads = model.loads().map_err(wrong)?;
        let courses = model.courses().map_err(wrong)?;
        let rows = if run.trajectory {
            let reader = trajectory(path, &world, "run.json has")?;
            RecordingRows::Trajectory(Box::new(
                reader.from_index(run.start_index).every(kept.every),
            ))
        } else {
            let some = |of: Table, count: usize| {
                (count > 0 && kept.has(of)).then(|| table(path, of, kept.form)).transpose()
            };
            let streams = Streams {
                states: table(path, Table::States, kept.form)?,
                contacts: some(Table::Contacts, 1)?,
                steps: table(path, Table::Steps, kept.form)?,
                joints: some(Table::Joints, world.joints().len())?,
                gears: some(Table::Gears, world.gears().len())?,
                ends: some(Table::Ends, 1)?,
            };
            let tied = (world.joints().len(), world.gears().len());
            let reader = TablesReader::of_some(streams, world.bodies().len(), tied.0, tied.1);
            let reader = reader.map_err(|error| odd_tables(path, &error))?;
            RecordingRows::Tables(Box::new(reader.from_index(run.start_index).every(kept.every)))
        };
        Ok(Self { path, rows, run: Some(run), world, loads, courses })
    }

    /// Opens a trajectory without run.json. It has the drop scene's parameters, changed by `flags`.
    fn without_run(path: &'a Path, flags: Settings) -> Result<Self, Failure> {
        let settings = flags.over(Settings::of_scene(SceneName::Drop));
        let (world, load) = physics::of_settings(&settings)?;
        let reader = trajectory(path, &world, "without a run.json there are")?;
        let rows = RecordingRows::Trajectory(Box::new(reader));
        Ok(Self { path, rows, run: None, world, loads: vec![load], courses: Vec::new() })
    }

    /// Reads the next step and checks its time and states; `None` after the last.
    pub fn next_step(&mut self) -> Result<Option<RecordedStep>, Failure> {
        let step = match &mut self.rows {
            RecordingRows::Trajectory(reader) => reader
                .next_row()
                .map(|row| row.map(RecordedStep::Trajectory))
                .map_err(|error| odd_trajectory(self.path, &error)),
            RecordingRows::Tables(reader) => reader
                .next_step()
                .map(|step| step.map(RecordedStep::Tables))
                .map_err(|error| odd_tables(self.path, &error)),
        }?;
        if let Some(step) = &step {
            self.check_time(step)?;
            self.check_states(step)?;
        }
        Ok(step)
    }

    /// Sets the prescribed motions of the world to the time of the step.
    pub fn follow(&mut self, step: &RecordedStep) {
        self.world.follow(&self.courses, step.index() as f64 * self.world.time_step());
    }

    /// Checks the time. A mismatch with the time step shows that the parameters are another run's.
    fn check_time(&self, step: &RecordedStep) -> Result<(), Failure> {
        let (index, time, h) = (step.index(), step.time(), self.world.time_step());
        let expected = index as f64 * h;
        if (time - expected).abs() <= 1e-9 * expected.max(h) {
            return Ok(());
        }
        let [time, h] = [time, h].map(shown::number);
        let why = format!("has t_s = {time}, which does not fit a time step of {h} s");
        Err(match step {
            RecordedStep::Trajectory(_) => Failure::Input(format!(
                "{}: row {index} {why}; give the time step of the run with --dt",
                shown::path(self.path)
            )),
            RecordedStep::Tables(_) => self.odd(&format!("step {index} {why}")),
        })
    }

    /// Checks the states of tables. Invalid states cannot be judged or drawn.
    fn check_states(&self, step: &RecordedStep) -> Result<(), Failure> {
        let RecordedStep::Tables(step) = step else { return Ok(()) };
        let names = self.run.iter().flat_map(RunFile::bodies);
        let names: Vec<_> = names.collect();
        let named = |states| names.iter().zip(states);
        for (name, state) in named(&step.states).chain(named(&step.ends)) {
            let why = |error| self.odd(&format!("step {}, {name}: {error}", step.row.index));
            state.with_unit_attitude().map_err(why)?;
        }
        Ok(())
    }

    /// Index of the body with the name `wanted`, or else with this number. Default is the first.
    pub fn body(&self, wanted: Option<&str>) -> Result<usize, Failure> {
        if matches!(self.rows, RecordingRows::Trajectory(_)) {
            refuse_flags("a trajectory of one body", &[("--body", wanted.is_some())])?;
        }
        let Some(wanted) = wanted else { return Ok(0) };
        let bodies: Vec<_> = self.run.iter().flat_map(RunFile::bodies).collect();
        let named = bodies.iter().position(|name| *name == wanted);
        let numbered = || wanted.parse().ok().filter(|index| *index < bodies.len());
        named.or_else(numbered).ok_or_else(|| {
            Failure::Input(format!(
                "--body: unknown body {}; give a name, for example {}, or a number from 0 to {}",
                shown::line(wanted),
                bodies[0],
                bodies.len() - 1
            ))
        })
    }

    /// True for the tutorial's single table.
    pub fn is_one_table(&self) -> bool {
        matches!(self.rows, RecordingRows::Trajectory(_))
    }

    /// Selection of rows in the files.
    pub fn kept(&self) -> KeptSteps {
        self.run.as_ref().map(|run| run.kept.clone()).unwrap_or_default()
    }

    /// True for a single floating body, integrated by the Runge–Kutta method without contacts.
    pub fn floating(&self) -> bool {
        self.run.as_ref().is_some_and(|run| run.solver.name == "rk4")
    }

    /// Largest residual of a solved contact step, m/s: the limit of its solver. Without run.json it
    /// is the largest limit of all solvers.
    pub fn accepted(&self) -> Result<f64, Failure> {
        let Some(run) = &self.run else {
            return Ok(ACCEPTED_RESIDUAL * self.world.speed_scale());
        };
        promised(&run.solver, &self.world).map_err(|why| {
            let run_path = self.path.with_file_name("run.json");
            Failure::Input(format!("{}: {why}", shown::path(&run_path)))
        })
    }

    /// Detection rule of the contact candidates; `None` if run.json does not have it.
    pub fn detection(&self) -> Option<Detection> {
        let name = self.run.as_ref()?.solver.detection.as_deref()?;
        [Detection::Height, Detection::Predictive].into_iter().find(|rule| rule.name() == name)
    }

    /// Note about parameters that come from no run.json; otherwise empty.
    pub fn note(&self) -> &'static str {
        match self.run {
            Some(_) => "",
            None => {
                "no run.json in the directory of the file: the drop scene's parameters and the \
                 given flags are used"
            }
        }
    }

    /// Note as a line to print; empty without a note.
    pub fn note_line(&self) -> String {
        let note = self.note();
        if note.is_empty() { String::new() } else { format!("note: {note}\n") }
    }

    /// Failure to read the tables.
    pub fn odd(&self, why: &dyn std::fmt::Display) -> Failure {
        odd_tables(self.path, why)
    }

    /// File or directory of the rows, for messages.
    pub fn place(&self) -> String {
        match self.rows {
            RecordingRows::Trajectory(_) => shown::path(self.path),
            RecordingRows::Tables(_) => shown::path(directory_of(None, self.path)),
        }
    }

    /// Messages about files changed since the run, by their checksums in run.json. Empty without
    /// checksums.
    pub fn changed_files(&self) -> Result<Vec<String>, Failure> {
        let Some(run) = &self.run else { return Ok(Vec::new()) };
        let mut found = Vec::new();
        match run.seal {
            Seal::Broken => found.push(
                "run.json was changed after it was written: its checksum does not match".to_owned(),
            ),
            Seal::None if !run.checksums.is_empty() => found.push(
                "run.json was changed after it was written: its checksum is missing".to_owned(),
            ),
            _ => {}
        }
        let of_one = file_of(TRAJECTORY, run.kept.form);
        for (name, expected) in &run.checksums {
            let path = match self.rows {
                // The trajectory may have been renamed.
                RecordingRows::Trajectory(_) if *name == of_one => self.path.to_owned(),
                RecordingRows::Tables(_) if *name != of_one => self.path.with_file_name(name),
                _ => continue,
            };
            let shown = shown::path(&path);
            let checksum = input::open(&path)
                .and_then(checksum_of)
                .map_err(|error| Failure::Input(format!("{shown} cannot be read: {error}")))?;
            if checksum != *expected {
                let expected = shown::line(expected);
                found.push(format!(
                    "{shown} was changed after the run wrote it: its checksum is {checksum}, \
                     run.json has {expected}"
                ));
            }
        }
        Ok(found)
    }

    /// File with a row for each step.
    pub fn steps_file(&self) -> PathBuf {
        match self.rows {
            RecordingRows::Trajectory(_) => self.path.to_owned(),
            RecordingRows::Tables(_) => {
                self.path.with_file_name(file_of(Table::Steps.name(), self.kept().form))
            }
        }
    }
}

/// Opens a trajectory of the body of `world`. `source` describes the origin of its contact points.
fn trajectory(
    path: &Path,
    world: &World,
    source: &str,
) -> Result<TrajectoryReader<TableSource>, Failure> {
    let file = TableSource::open(path).map_err(|error| odd_trajectory(path, &error))?;
    let reader = TrajectoryReader::new(file).map_err(|error| odd_trajectory(path, &error))?;
    let points = world.bodies().first().map_or(0, |body| body.contact_points().len());
    if points != reader.contacts() {
        return Err(Failure::Input(format!(
            "{} has columns for {} contact points; {source} {points}",
            shown::path(path),
            reader.contacts(),
        )));
    }
    Ok(reader)
}

fn odd_trajectory(path: &Path, error: &dyn std::fmt::Display) -> Failure {
    Failure::Input(format!("{} cannot be read as a trajectory: {error}", shown::path(path)))
}

fn odd_tables(file: &Path, why: &dyn std::fmt::Display) -> Failure {
    let folder = shown::path(directory_of(None, file));
    Failure::Input(format!("the tables in {folder} cannot be read: {why}"))
}

fn table(beside: &Path, table: Table, form: TableForm) -> Result<TableSource, Failure> {
    let path = beside.with_file_name(file_of(table.name(), form));
    TableSource::open(&path)
        .map_err(|error| Failure::Input(format!("{} cannot be read: {error}", shown::path(&path))))
}

/// Refuses a directory and a missing file, and names the table of the run there.
fn refuse_no_table(path: &Path) -> Result<(), Failure> {
    let (directory, fault) = match path.metadata() {
        Ok(found) if found.is_dir() => (path, "is a directory, not a file"),
        Err(error) if error.kind() == io::ErrorKind::NotFound => {
            (directory_of(None, path), "does not exist")
        }
        _ => return Ok(()),
    };
    let names = ["states.csv", "trajectory.csv", "states.csv.zst", "trajectory.csv.zst"];
    let table = names.into_iter().map(|name| directory.join(name)).find(|table| table.is_file());
    let remedy = table.map_or_else(
        || "give a table of a run, DIR/states.csv".to_owned(),
        |table| format!("give {}", shown::path(&table)),
    );
    Err(Failure::Input(format!("{} {fault}; {remedy}", shown::path(path))))
}

/// Refuses a table of several bodies without run.json, which has the model.
fn refuse_lonely_table(file: &Path, run_path: &Path) -> Result<(), Failure> {
    let headers =
        [false, true].map(|joints| Table::ALL.map(|table| table.columns(joints).join(",")));
    let mut first = String::new();
    // An unreadable file is refused later.
    let start = TableSource::open(file).map(|file| file.take(LONGEST_HEADER));
    let _ = start.and_then(|start| BufReader::new(start).read_line(&mut first));
    if !headers.iter().flatten().any(|header| header == first.trim_end()) {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "{}: a table of several bodies needs the run.json of its run; {} is missing, or not of \
         several bodies",
        shown::path(file),
        shown::path(run_path)
    )))
}

/// Refuses a file that is not a table of the run in the same directory.
fn refuse_another_file(file: &Path, form: TableForm) -> Result<(), Failure> {
    let names = Table::ALL.map(|table| file_of(table.name(), form));
    let name = file.file_name().unwrap_or_default();
    if names.iter().any(|table| name == table.as_str()) {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "{}: the run.json in this directory is from a run of several bodies; its tables are {}",
        shown::path(file),
        names.join(", ")
    )))
}

/// Largest residual of a solved contact step of `world`, m/s: the limit of its solver. If the file
/// does not have it, the solver's name must be known.
fn promised(settings: &SolverSettings, world: &World) -> Result<f64, String> {
    if let Some(accepted) = settings.accepted_residual_m_s {
        return match accepted >= 0.0 {
            true => Ok(accepted),
            false => Err(format!(
                "solver.accepted_residual_m_s is {}; allowed: 0 or more",
                shown::number(accepted)
            )),
        };
    }
    // Steps of several bodies that an earlier version solved by Ipopt have the ladder's limit, even
    // without retries.
    let ladder = || settings.on_failure.as_deref() == Some("ladder");
    let accepted = match settings.name.as_str() {
        "native" => native::ACCEPTED_RESIDUAL,
        "rk4" => 0.0,
        "ipopt" if ladder() || StepNlp::unsuitable(world).is_some() => LADDER_RESIDUAL,
        "ipopt" => ACCEPTED_RESIDUAL,
        other => {
            return Err(format!(
                "solver.name: {} is not a solver of tumble; for it, solver.accepted_residual_m_s \
                 is needed",
                shown::line(other)
            ));
        }
    };
    Ok(accepted * world.speed_scale())
}
