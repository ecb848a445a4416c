//! Reader for the files of a run: tables and model.

use super::file_names::{directory_of, file_of};
use super::input;
use super::outcome::Failure;
use super::table_file::TableSource;
use std::io;
use std::path::{Path, PathBuf};
use tumble::solver::{ACCEPTED_RESIDUAL, LADDER_RESIDUAL};
use tumble::step_nlp::StepNlp;
use tumble_core::joint::Knots;
use tumble_core::mechanics::Load;
use tumble_core::solver::native;
use tumble_core::world::World;
use tumble_model::shown;
use tumble_scene::output::tables::{
    IntervalRows, StepRow, Streams, Table, TableShape, TablesReader, whole_steps,
};
use tumble_scene::row_selection::{RowSelection, TableForm};
use tumble_scene::run_file::{self, RunFile, Seal, SolverSettings, checksum_of};

/// Files of a run being read.
pub struct Recording<'a> {
    path: &'a Path,
    rows: TablesReader<TableSource>,
    /// First interval of the next step, if it was read already.
    ahead: Option<IntervalRows>,
    /// Start of the next interval since that of its step (s).
    since: f64,
    pub run: RunFile,
    pub world: World,
    /// One load per body.
    pub loads: Vec<Load>,
    /// Prescribed motions of joint frames fixed in the world, by joint index.
    pub courses: Vec<(usize, Knots)>,
}

impl<'a> Recording<'a> {
    /// Opens the files of a run through one of them, `path`, with the run.json in its directory.
    pub fn open(path: &'a Path) -> Result<Self, Failure> {
        refuse_no_table(path)?;
        if path.extension().is_some_and(|end| end == "zst") {
            return Err(Failure::Input(format!(
                "{} is compressed by Zstandard, as older versions did; unpack the tables with \
                 zstd -d, and set \"form\" in run.json to \"csv\"",
                shown::path(path)
            )));
        }
        // Names a table that cannot be read before a run.json that does not exist.
        input::open(path).map_err(|error| unreadable(path, &error))?;
        let run_path = path.with_file_name("run.json");
        let run = run_file(&run_path, || {
            Failure::Input(format!(
                "{}: a table needs the run.json of its run beside it; {} does not exist",
                shown::path(path),
                shown::path(&run_path)
            ))
        })?;
        refuse_another_file(path, run.kept.form)?;
        Self::from_run(path, run)
    }

    /// Opens the files of `run` through one of them, `path`.
    pub fn from_run(path: &'a Path, run: RunFile) -> Result<Self, Failure> {
        let run_path = path.with_file_name("run.json");
        let wrong = |failure: Failure| failure.within("model").in_file(&run_path);
        let (model, selection) = (&run.model, &run.kept);
        let world = model.world().map_err(wrong)?;
        let loads = model.loads().map_err(wrong)?;
        let courses = model.courses().map_err(wrong)?;
        let some = |of: Table, count: usize| {
            (count > 0 && selection.has(of)).then(|| table(path, of, selection.form)).transpose()
        };
        let has_ends = run.files.contains(&file_of(Table::Ends.name(), selection.form));
        let tied = (world.joints().len(), world.gears().len());
        let streams = Streams {
            states: table(path, Table::States, selection.form)?,
            contacts: some(Table::Contacts, 1)?,
            steps: table(path, Table::Steps, selection.form)?,
            joints: some(Table::Joints, tied.0)?,
            gears: some(Table::Gears, tied.1)?,
            ends: some(Table::Ends, usize::from(has_ends))?,
        };
        let rows = TablesReader::with_optional_tables(streams, TableShape::new(&world))
            .map_err(|error| invalid_tables(path, &error))?
            .from_index(run.start_index)
            .every(selection.every)
            .without_idle_contacts(selection.loaded_contacts)
            .short(selection.short);
        Ok(Self { path, rows, ahead: None, since: 0.0, run, world, loads, courses })
    }

    /// Reads the next step as a whole ([`whole_steps`]); `None` after the last.
    pub fn next_step(&mut self) -> Result<Option<IntervalRows>, Failure> {
        let Some(first) =
            self.ahead.take().map_or_else(|| self.next_interval(), |rows| Ok(Some(rows)))?
        else {
            return Ok(None);
        };
        let mut intervals = vec![first];
        while let Some(next) = self.next_interval()? {
            if next.row.interval == 0 {
                self.ahead = Some(next);
                break;
            }
            intervals.push(next);
        }
        Ok(whole_steps(&self.world, &intervals).into_owned().pop())
    }

    /// Reads the next interval and checks its time, length and states; `None` after the last.
    pub fn next_interval(&mut self) -> Result<Option<IntervalRows>, Failure> {
        let rows = self.rows.next_interval().map_err(|error| invalid_tables(self.path, &error))?;
        if let Some(rows) = &rows {
            self.check_time(rows)?;
            self.check_states(rows)?;
        }
        Ok(rows)
    }

    /// Checks the time and the length: the intervals of a step follow each other and fill it. A mismatch
    /// with the time step shows that the parameters are another run's.
    fn check_time(&mut self, rows: &IntervalRows) -> Result<(), Failure> {
        let StepRow { index, interval, time, length, .. } = rows.row;
        let h = self.world.whole_step();
        let near = |a: f64, b: f64| (a - b).abs() <= 1e-9 * b.max(h);
        let fills = interval > 0 || near(self.since, h) || self.since == 0.0;
        if interval == 0 {
            self.since = 0.0;
        }
        let start = index as f64 * h;
        let fits = near(time, start + self.since);
        self.since += length;
        let is_within = length >= 0.0 && self.since <= h * (1.0 + 1e-9);
        if fits && fills && is_within {
            return Ok(());
        }
        let [time, length, h] = [time, length, h].map(shown::number);
        Err(self.invalid(&format!(
            "step {index}, interval {interval} has time_s = {time} and interval_s = {length}, which \
             does not fit a time step of {h} s"
        )))
    }

    /// Checks the attitudes, which must be unit quaternions. The tutorial's preset meets this only
    /// to Ipopt's tolerance in each step.
    fn check_states(&self, step: &IntervalRows) -> Result<(), Failure> {
        /// Largest deviation of a norm from 1.
        const UNIT_TO: f64 = 1e-5;
        const TUTORIALS_UNIT_TO: f64 = 1e-2;
        let is_tutorials = self.run.solver.preset.is_some();
        let limit = if is_tutorials { TUTORIALS_UNIT_TO } else { UNIT_TO };
        let names = self.run.bodies();
        let named = |states| names.iter().zip(states);
        for (name, state) in named(&step.states).chain(named(&step.ends)) {
            let norm = state.attitude.norm();
            if (norm - 1.0).abs() > limit {
                let (index, norm) = (step.row.index, shown::number(norm));
                return Err(self.invalid(&format!(
                    "step {index}, {name}: norm of the attitude quaternion is {norm}; allowed: 1 \
                     to within {limit:e}"
                )));
            }
        }
        Ok(())
    }

    /// Index of the body with the name `requested`, or else with this number.
    pub fn body(&self, requested: &str) -> Result<usize, Failure> {
        let bodies = self.run.bodies();
        let named = bodies.iter().position(|name| *name == requested);
        let numbered = || requested.parse().ok().filter(|index| *index < bodies.len());
        named.or_else(numbered).ok_or_else(|| {
            Failure::Input(format!(
                "--body: unknown body {}; give a name, for example {}, or a number from 0 to {}",
                shown::line(requested),
                bodies[0],
                bodies.len() - 1
            ))
        })
    }

    /// Selection of rows in the files.
    pub fn row_selection(&self) -> RowSelection {
        self.run.kept.clone()
    }

    /// True for a single floating body, integrated by the Runge–Kutta method without contacts.
    pub fn floating(&self) -> bool {
        self.run.solver.name == "rk4"
    }

    /// Largest residual of a solved contact step, m/s: the limit of its solver.
    pub fn accepted(&self) -> Result<f64, Failure> {
        promised(&self.run.solver, &self.world).map_err(|why| {
            let run_path = self.path.with_file_name("run.json");
            Failure::Input(format!("{}: {why}", shown::path(&run_path)))
        })
    }

    /// Failure to read the tables.
    pub fn invalid(&self, why: &dyn std::fmt::Display) -> Failure {
        invalid_tables(self.path, why)
    }

    /// Directory of the tables, for messages.
    pub fn place(&self) -> String {
        shown::path(directory_of(None, self.path))
    }

    /// Messages about files changed since the run, by their checksums in run.json. Empty without
    /// checksums.
    pub fn changed_files(&self) -> Result<Vec<String>, Failure> {
        let run = &self.run;
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
        for (name, expected) in &run.checksums {
            let path = self.path.with_file_name(name);
            // The tables are open, so that only the export can be absent.
            if !path.exists() {
                continue;
            }
            let shown = shown::path(&path);
            let checksum = input::open(&path).and_then(checksum_of);
            let checksum = checksum.map_err(|error| unreadable(&path, &error))?;
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
        self.path.with_file_name(file_of(Table::Steps.name(), self.row_selection().form))
    }
}

/// Reads the run.json at `path`; `missing` is the failure if there is none.
pub fn run_file(path: &Path, missing: impl FnOnce() -> Failure) -> Result<RunFile, Failure> {
    match input::text(path, run_file::LARGEST_FILE) {
        Ok(text) => RunFile::from_text(&text, path),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Err(missing()),
        Err(error) => Err(unreadable(path, &error)),
    }
}

fn invalid_tables(file: &Path, why: &dyn std::fmt::Display) -> Failure {
    let folder = shown::path(directory_of(None, file));
    Failure::Input(format!("the tables in {folder} cannot be read: {why}"))
}

fn table(beside: &Path, table: Table, form: TableForm) -> Result<TableSource, Failure> {
    let path = beside.with_file_name(file_of(table.name(), form));
    TableSource::open(&path).map_err(|error| unreadable(&path, &error))
}

fn unreadable(path: &Path, error: &io::Error) -> Failure {
    Failure::Input(format!("{} cannot be read: {error}", shown::path(path)))
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
    let names = ["states.csv", "states.csv.gz"];
    let table = names.into_iter().map(|name| directory.join(name)).find(|table| table.is_file());
    let remedy = table.map_or_else(
        || "give a table of a run, DIR/states.csv".to_owned(),
        |table| format!("give {}", shown::path(&table)),
    );
    Err(Failure::Input(format!("{} {fault}; {remedy}", shown::path(path))))
}

/// Refuses a file that is not a table of the run in the same directory.
fn refuse_another_file(file: &Path, form: TableForm) -> Result<(), Failure> {
    let name = file.file_name().unwrap_or_default();
    if Table::ALL.into_iter().any(|table| name == file_of(table.name(), form).as_str()) {
        return Ok(());
    }
    let states = file.with_file_name(file_of(Table::States.name(), form));
    Err(Failure::Input(format!(
        "{} is not a table of the run in this directory; give {}",
        shown::path(file),
        shown::path(&states)
    )))
}

/// Largest residual of a solved contact step of `world`, m/s: the limit of its solver. If the file
/// does not have it, the solver's name must be known.
fn promised(settings: &SolverSettings, world: &World) -> Result<f64, String> {
    if let Some(accepted) = settings.accepted_residual_m_s {
        return if accepted >= 0.0 {
            Ok(accepted)
        } else {
            Err(format!(
                "solver.accepted_residual_m_s is {}; allowed: 0 or more",
                shown::number(accepted)
            ))
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
