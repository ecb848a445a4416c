//! Arguments of a simulation.

use super::field_flags::FieldFlags;
use super::field_values::FieldValues;
use super::shared::AnimationArgs;
use crate::outcome::Failure;
use crate::values;
use clap::Args;
use std::net::SocketAddr;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tumble_scene::LARGEST_START;
use tumble_scene::choices::SceneName;
use tumble_scene::output::tables::Table;
use tumble_scene::overrides::FieldOverride;
use tumble_scene::row_selection::{RowSelection, TableForm};
use tumble_scene::settings::RobotSettings;

#[derive(Debug, Clone, Args)]
pub struct SimulateArgs {
    #[command(flatten)]
    pub setup: SetupArgs,
    /// Continue the run in DIR from its state.bin.
    ///
    /// Scene and settings are read from its run.json. --steps counts all rows, including the
    /// existing ones [default: the number requested at first]. The files are written to --out, or
    /// to DIR without it, and equal those of an uninterrupted run.
    #[arg(long = "continue", value_name = "DIR", help_heading = "Output",
        conflicts_with_all = ["scene", "file"])]
    pub continued: Option<PathBuf>,
    #[command(flatten, next_help_heading = "Live")]
    pub live: LiveArgs,
    #[command(flatten, next_help_heading = "Output")]
    pub output: OutputArgs,
    #[command(flatten, next_help_heading = "Pictures")]
    pub pictures: PictureArgs,
}

/// Scene and solver of a simulation.
#[derive(Debug, Clone, Args)]
pub struct SetupArgs {
    #[command(flatten, next_help_heading = "Scene")]
    pub scene: SceneArgs,
    #[command(flatten)]
    pub fields: FieldFlags,
    #[command(flatten, next_help_heading = "Solver")]
    pub solver: SolverArgs,
    #[command(flatten, next_help_heading = "Robot files")]
    pub robot: RobotSettings,
}

/// Scene and its fields.
#[derive(Debug, Clone, Args)]
pub struct SceneArgs {
    /// Scene to simulate: a scenario file (TOML, see scenarios/README.md) or a robot (URDF, SDF, MJCF).
    ///
    /// Flags override its values.
    #[arg(value_name = "SCENE", conflicts_with = "scene")]
    pub file: Option<PathBuf>,
    /// Scene of the tutorial instead of a file [default: drop].
    #[arg(id = "scene", long = "scene", value_enum, value_name = "NAME")]
    pub tutorial: Option<SceneName>,
    /// Field of the scene and its value, for example ground.friction=0.4, bodies.brick.mass=2 or, for the
    /// tutorial's cube, body.mass=2. Entries of a list have their name or their number from 0.
    ///
    /// Can be repeated. A range ground.friction=0.2:0.6:0.1 makes a run for each value, in a directory of
    /// its own in --out, and the table sweep.csv of their ends.
    #[arg(long = "set", value_name = "FIELD=VALUE", value_parser = FieldValues::parse)]
    pub overrides: Vec<FieldValues>,
}

/// Settings of the solver.
#[derive(Debug, Clone, Args)]
pub struct SolverArgs {
    /// Number of threads of the native solver, 1 to 1024, for bodies that do not touch each other.
    ///
    /// The result does not depend on it. Many runs are faster with one core each [default: 1].
    #[arg(long, value_name = "N", value_parser = values::threads, allow_hyphen_values = true)]
    pub threads: Option<NonZeroUsize>,
    /// Replace each step by N steps of 1/N of its length, 1 to 1000, and write every N-th: --dt
    /// over N, N times as many steps and N times --every.
    ///
    /// For joints whose forces are too stiff for the time step; the summary suggests N. run.json
    /// and --continue count the short steps [default: 1].
    #[arg(long, value_name = "N", value_parser = values::whole::<u64>(1, 1000), allow_hyphen_values = true)]
    pub substeps: Option<u64>,
}

/// A run that one can touch.
#[derive(Debug, Clone, Args)]
pub struct LiveArgs {
    /// Serve a page on this machine in which bodies can be pulled and constants changed while the
    /// scene runs.
    ///
    /// Its address is printed. Ctrl-C ends the run. The steps since the last change are then
    /// written to --out with the pulls as loads, as a run that `tumble verify` checks. The solver
    /// is the native one.
    #[arg(id = "live", long = "live", conflicts_with = "continued")]
    pub is_live: bool,
    /// Start the live run from a moment of an earlier run, with its scene: one of its tables.
    #[arg(id = "from", long = "from", value_name = "TABLE", requires = "live",
        conflicts_with_all = ["scene", "file"])]
    pub from: Option<PathBuf>,
    /// Index k of that moment [default: the last one of the table].
    #[arg(id = "at", long = "at", value_name = "K", value_parser = values::whole::<u64>(0, LARGEST_START),
        requires = "from", allow_hyphen_values = true)]
    pub at: Option<u64>,
    /// Address and port of the page, of one interface of this machine [default: 127.0.0.1 and a
    /// free port].
    ///
    /// Other machines reach only an address that is not 127.0.0.1. The connection is not encrypted.
    #[arg(id = "live-address", long = "live-address", value_name = "IP:PORT", requires = "live")]
    pub address: Option<SocketAddr>,
}

/// Files of a run.
#[derive(Debug, Clone, Args)]
pub struct OutputArgs {
    /// Directory for the files; created if missing [default: out; with --continue its DIR].
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace files in that directory that no earlier run wrote, and discard the checkpoint of a
    /// killed run there.
    #[arg(long)]
    pub overwrite: bool,
    /// Write only every N-th step and the last state, 1 to 1000000.
    ///
    /// All steps are simulated and counted [default: 1].
    #[arg(long, value_name = "N", value_parser = values::whole::<u64>(1, 1_000_000), allow_hyphen_values = true)]
    pub every: Option<u64>,
    /// Tables to write; `states` and `steps` are always written [default: all].
    ///
    /// `tumble verify` needs `contacts`, also `joints` and `gears` if the scene has any, and `ends`
    /// with --every: the state after each written step.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "TABLE,…")]
    pub tables: Option<Vec<Table>>,
    /// Also write contacts without force. `tumble verify` searches them from the states.
    #[arg(long)]
    pub all_contacts: bool,
    /// Write numbers with all digits, and also rows of bodies whose state has not changed.
    #[arg(long)]
    pub exact: bool,
    /// Compress the tables by gzip (states.csv.gz). Every command reads them, and pandas too.
    #[arg(long)]
    pub compact: bool,
    /// Time between checkpoints, s, 0 to 1e6; 0 for none. --continue resumes a killed run from the
    /// last one [default: 10].
    #[arg(long, value_name = "SECONDS", value_parser = values::checkpoint, allow_hyphen_values = true)]
    checkpoint: Option<f64>,
    /// Also write the contact problem of every step with contacts, as step-K.dat in Siconos' text
    /// format, linearised at the step's solution (docs/contact-problem.md).
    ///
    /// `ContactProblem.read` of the Python package reads these files. Only with the native solver, without joints. Existing
    /// files of this kind in DIR are replaced only with --overwrite.
    #[arg(long, value_name = "DIR")]
    pub export_problems: Option<PathBuf>,
    /// Print no progress bar and no summary.
    #[arg(short, long)]
    pub quiet: bool,
    /// Print the summary as one JSON object: run.json without `model` and `checksums`, and `notes`.
    #[arg(long, conflicts_with = "live")]
    pub json: bool,
}

/// Pictures of a run.
#[derive(Debug, Clone, Args)]
pub struct PictureArgs {
    /// Also write a page that plays the motion in a browser: OUT/view.html.
    #[arg(long)]
    pub html: bool,
    /// Also draw the motion: OUT/animation.gif.
    #[arg(long)]
    pub gif: bool,
    /// Also plot the motion over time, as `tumble plot` does.
    #[arg(long)]
    pub plot: bool,
    #[command(flatten)]
    pub animation: AnimationArgs,
}

impl SimulateArgs {
    /// Directory for the files.
    pub fn out(&self) -> &Path {
        self.output.out.as_deref().or(self.continued.as_deref()).unwrap_or(Path::new("out"))
    }

    /// Sets that directory.
    pub fn set_out(&mut self, out: PathBuf) {
        self.output.out = Some(out);
    }

    /// Time between checkpoints; `None` for no checkpoints.
    pub fn checkpoint(&self) -> Option<Duration> {
        let every = self.output.checkpoint.unwrap_or(10.0);
        (every > 0.0).then(|| Duration::from_secs_f64(every))
    }

    /// Selection of rows to write.
    pub fn row_selection(&self) -> RowSelection {
        let output = &self.output;
        let every =
            output.every.unwrap_or(1).saturating_mul(self.setup.solver.substeps.unwrap_or(1));
        let form = if output.compact { TableForm::Gzip } else { TableForm::Csv };
        let tables = output.tables.as_deref();
        let mut selection = RowSelection::new(every, tables, !output.all_contacts, form);
        selection.short = !output.exact;
        selection
    }

    /// Names of the settings flags that are set.
    pub fn given(&self) -> Vec<&'static str> {
        let OutputArgs { every, tables, all_contacts, exact, compact, .. } = &self.output;
        let flags = [
            ("every", every.is_some()),
            ("tables", tables.is_some()),
            ("all-contacts", *all_contacts),
            ("exact", *exact),
            ("compact", *compact),
        ];
        [self.setup.given(), names_of_set(&flags)].concat()
    }
}

impl SetupArgs {
    /// Fields of the scene in the flags and in `--set`.
    ///
    /// # Errors
    /// A range of values.
    pub fn overrides(&self) -> Result<Vec<FieldOverride>, Failure> {
        let mut all = self.fields.given.clone();
        for field in &self.scene.overrides {
            if field.values.len() > 1 {
                let path = &field.path;
                let why =
                    format!("--set {path}: a range of values is only for tumble run; give one");
                return Err(Failure::Input(why));
            }
            all.push(FieldOverride::parse(&field.text()).map_err(Failure::Input)?);
        }
        Ok(all)
    }

    /// True if a field has a range of values.
    pub fn is_sweep(&self) -> bool {
        self.scene.overrides.iter().any(|field| field.values.len() > 1)
    }

    /// Number of rows of `--steps`.
    ///
    /// # Errors
    /// Another value.
    pub fn steps(&self) -> Result<Option<u64>, Failure> {
        let Some(steps) = self.fields.get("steps") else { return Ok(None) };
        let rows = steps.whole().filter(|rows| (1..=10_000_000).contains(rows));
        let why = "--steps: a whole number from 1 to 10000000 is needed";
        rows.map(Some).ok_or_else(|| Failure::Input(why.to_owned()))
    }

    /// Names of the settings flags that are set.
    pub fn given(&self) -> Vec<&'static str> {
        let substeps = ("substeps", self.solver.substeps.is_some());
        let flags = [("set", !self.scene.overrides.is_empty()), substeps];
        [self.fields.names(), names_of_set(&flags), names_of_set(&self.robot.given())].concat()
    }
}

/// Names of the flags that are set.
fn names_of_set(flags: &[(&'static str, bool)]) -> Vec<&'static str> {
    flags.iter().filter(|(_, is_set)| *is_set).map(|(name, _)| *name).collect()
}
