//! Arguments of a simulation.

use super::shared::{AnimationArgs, PhysicsArgs};
use crate::outcome::Failure;
use crate::values::{self, LoadKnot};
use clap::Args;
use nalgebra::Vector3;
use std::net::SocketAddr;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tumble_core::world::Plane;
use tumble_scene::choices::{DetectionName, OnFailure, Preset, SceneName, SolverName, StartFrame};
use tumble_scene::output::tables::Table;
use tumble_scene::overrides::FieldOverride;
use tumble_scene::row_selection::{RowSelection, TableForm};
use tumble_scene::settings::RobotSettings;
use tumble_scene::{AttitudeEntry, InertiaValue, LARGEST_START};

#[derive(Debug, Args)]
pub struct SimulateArgs {
    #[command(flatten)]
    pub setup: SetupArgs,
    /// Continue the run in DIR from its state.bin.
    ///
    /// Scene and settings are read from its run.json. --steps counts all rows, including the
    /// existing ones [default: the number requested at first]. The files are written to --out, or
    /// to DIR without it, and equal those of an uninterrupted run.
    #[arg(long = "continue", value_name = "DIR", help_heading = "Output",
        conflicts_with_all = ["scene", "scenario", "file"])]
    pub continued: Option<PathBuf>,
    #[command(flatten, next_help_heading = "Live")]
    pub live: LiveArgs,
    #[command(flatten, next_help_heading = "Output")]
    pub output: OutputArgs,
    #[command(flatten, next_help_heading = "Pictures")]
    pub pictures: PictureArgs,
    #[command(flatten, next_help_heading = CUBE)]
    pub cube: CubeArgs,
}

/// Heading of the flags in [`CubeArgs`].
pub const CUBE: &str = "The tutorial's cube, without a file";

/// Scene and solver of a simulation.
#[derive(Debug, Args)]
pub struct SetupArgs {
    #[command(flatten, next_help_heading = "Scene")]
    pub scene: SceneArgs,
    #[command(flatten, next_help_heading = "Solver")]
    pub solver: SolverArgs,
    #[command(flatten, next_help_heading = "Constants, instead of the scene's")]
    pub physics: PhysicsArgs,
    #[command(flatten, next_help_heading = "Robot files")]
    pub robot: RobotSettings,
}

/// Scene, seed and number of steps.
#[derive(Debug, Args)]
pub struct SceneArgs {
    /// Scene to simulate: a scenario file (TOML, see scenarios/README.md) or a robot (URDF, SDF, MJCF).
    ///
    /// Flags override its values.
    #[arg(value_name = "SCENE", conflicts_with = "scene")]
    file: Option<PathBuf>,
    /// Same as SCENE.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["scene", "file"], hide = true)]
    scenario: Option<PathBuf>,
    /// Number of rows, one more than steps, 1 to 10000000 [default: drop 1000, floating 1200].
    #[arg(short, long, value_name = "N", value_parser = values::whole::<u64>(1, 10_000_000), allow_hyphen_values = true)]
    pub steps: Option<u64>,
    /// Seed of the random initial attitude, drawn as numpy.random.seed(SEED) and rand(4) do.
    ///
    /// The floating scene draws nothing and only records it [default: 42].
    #[arg(long, value_parser = values::whole::<u32>(0, u32::MAX), allow_hyphen_values = true)]
    pub seed: Option<u32>,
    /// Index k of the first row; its time is k h, which also shifts the times of loads [default:
    /// 0].
    #[arg(long, value_name = "K", value_parser = values::whole::<u64>(0, LARGEST_START), allow_hyphen_values = true)]
    pub start_index: Option<u64>,
    /// Field of the scenario file and its value, for example ground.friction=0.4 or
    /// bodies.brick.mass=2. Entries of a list have their name or their number from 0.
    ///
    /// Can be repeated.
    #[arg(long = "set", value_name = "FIELD=VALUE", value_parser = FieldOverride::parse)]
    pub overrides: Vec<FieldOverride>,
}

impl SceneArgs {
    /// Scenario file or robot to simulate.
    pub fn path(&self) -> Option<&Path> {
        self.file.as_deref().or(self.scenario.as_deref())
    }
}

/// Scene of the tutorial: its body, ground, load and initial state.
#[derive(Debug, Args)]
pub struct CubeArgs {
    /// Scene of the tutorial instead of a file [default: drop].
    #[arg(id = "scene", long = "scene", value_enum, value_name = "NAME")]
    pub tutorial: Option<SceneName>,
    /// Mass, kg, 1e-9 to 1e9 [default: 10].
    #[arg(long, value_name = "KG", value_parser = values::number, allow_hyphen_values = true)]
    pub mass: Option<f64>,
    /// Inertia, kg m², body frame: one number (times the unit matrix), three (diagonal), nine (the
    /// matrix by rows), or `solid` for a box of uniform density.
    ///
    /// A principal moment is 1e-6 to 1e6 times mass × length², where length is the largest distance
    /// of a corner from its axis [default: 0.01].
    #[arg(long, value_name = "I", value_parser = values::inertia, allow_hyphen_values = true)]
    pub inertia: Option<InertiaValue>,
    /// Sides of the box, m, 2e-6 to 2e4: one number (a cube) or three, along the body's axes
    /// [default: 2].
    #[arg(long = "box", value_name = "L", value_parser = values::sides, allow_hyphen_values = true)]
    pub sides: Option<Vector3<f64>>,
    /// Ground: a slope in degrees, falling towards +x, or a normal and optionally the plane's
    /// distance from the origin along it, m [default: 0].
    #[arg(long, value_name = "DEGREES|NX,NY,NZ[,D]", value_parser = values::plane, allow_hyphen_values = true)]
    pub plane: Option<Plane>,
    /// External force, N, −1e9 to 1e9, world.
    ///
    /// Constant, or repeated as T:X,Y,Z for each knot and linear between the times T in s [default:
    /// none].
    #[arg(long, value_name = "[T:]X,Y,Z", value_parser = values::load_knot, allow_hyphen_values = true)]
    pub force: Vec<LoadKnot>,
    /// External torque, N m, −1e9 to 1e9, body frame; same form as --force [default: none].
    #[arg(long, value_name = "[T:]X,Y,Z", value_parser = values::load_knot, allow_hyphen_values = true)]
    pub torque: Vec<LoadKnot>,
    /// Point of action of the external force, m, −1e4 to 1e4, body frame, from the centre of mass
    /// [default: 0,0,0].
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub force_at: Option<Vector3<f64>>,
    /// Initial position of the centre of mass, m, −1e6 to 1e6 [default: drop 0,0,2.5, floating
    /// 0,0,3].
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub position: Option<Vector3<f64>>,
    /// Initial height Z alone, m.
    #[arg(long, value_name = "M", value_parser = values::number, allow_hyphen_values = true)]
    pub height: Option<f64>,
    /// Initial attitude, body → frame: a quaternion, which is normalised, or `random`, drawn from
    /// the seed [default: drop random, floating 1,0,0,0].
    #[arg(long, value_name = "W,X,Y,Z", value_parser = values::attitude, allow_hyphen_values = true)]
    pub attitude: Option<AttitudeEntry>,
    /// Initial velocity, m/s, −1e5 to 1e5 [default: drop 0,4,0, floating 2,0,0].
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub velocity: Option<Vector3<f64>>,
    /// Initial angular velocity, rad/s, −1e5 to 1e5, body frame [default: drop 0,-2,1, floating
    /// 2,4,6].
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub spin: Option<Vector3<f64>>,
    /// Frame of the initial position, attitude and velocity: the world, or the ground, whose z is
    /// the plane's normal and the height above it [default: world].
    #[arg(long, value_enum)]
    pub frame: Option<StartFrame>,
}

/// Solver of the contact steps.
#[derive(Debug, Args)]
pub struct SolverArgs {
    /// Solver of the contact steps: tumble's own solver, which is exact, or Ipopt as in the
    /// tutorial, a thousand times slower [default: native; without a file ipopt].
    #[arg(long, value_enum)]
    pub solver: Option<SolverName>,
    /// Residual at which the native solver accepts a contact step, m/s, 1e-9 to 1e-2, for bodies of
    /// about one metre.
    ///
    /// A larger value saves time in large scenes. The certificate of each step records the residual
    /// reached [default: 1e-9].
    #[arg(long, value_name = "M/S", value_parser = values::number, allow_hyphen_values = true)]
    pub residual: Option<f64>,
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
    /// Action if Ipopt does not solve a step from its first initial point: try other initial points
    /// and finally the native solution, record the failure and continue, or stop [default: record;
    /// with Ipopt ladder].
    #[arg(long, value_enum)]
    pub on_failure: Option<OnFailure>,
    /// Ipopt's tolerance, 1e-12 to below 1; only with --solver ipopt [default: 1e-6].
    #[arg(long, value_parser = values::number, allow_hyphen_values = true)]
    pub tol: Option<f64>,
    /// Ipopt's iteration limit per step, 1 to 1000000; only with --solver ipopt [default: 300].
    #[arg(long, value_name = "N", value_parser = values::whole::<u32>(1, 1_000_000), allow_hyphen_values = true)]
    pub max_iter: Option<u32>,
    /// Criterion for corners that may carry a force: those at most 5 mm high at step k (the
    /// tutorial's), or also those that free flight would bring to the ground in this step [default:
    /// predictive].
    #[arg(long, value_enum)]
    pub detection: Option<DetectionName>,
    /// Preset of solver settings, instead of --solver, --detection, --tol, --max-iter, --residual
    /// and --on-failure.
    ///
    /// `tutorial` solves the tutorial's program unchanged: Ipopt alone, SI units, all rows,
    /// --detection height, --tol 1e-6, --max-iter 300, Ipopt's other defaults. Each step starts
    /// from the last solution without multipliers. A step that is not solved is kept with status
    /// failed.
    #[arg(long, value_enum)]
    pub preset: Option<Preset>,
}

/// A run that one can touch.
#[derive(Debug, Args)]
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
        conflicts_with_all = ["scene", "scenario", "file"])]
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
#[derive(Debug, Args)]
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
#[derive(Debug, Args)]
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
        RowSelection::new(every, output.tables.as_deref(), !output.all_contacts, form)
    }

    /// Names of the settings flags that are set.
    pub fn given(&self) -> Vec<&'static str> {
        let OutputArgs { every, tables, all_contacts, compact, .. } = &self.output;
        let rows = [("every", every.is_some()), ("tables", tables.is_some())];
        let flags = [&rows[..], &[("all-contacts", *all_contacts), ("compact", *compact)]].concat();
        [self.setup.given(), self.cube.given(), names_of_set(&flags)].concat()
    }
}

impl SetupArgs {
    /// Names of the settings flags that are set.
    pub fn given(&self) -> Vec<&'static str> {
        let Self { scene, solver, .. } = self;
        let flags = [
            ("steps", scene.steps.is_some()),
            ("start-index", scene.start_index.is_some()),
            ("seed", scene.seed.is_some()),
            ("set", !scene.overrides.is_empty()),
            ("solver", solver.solver.is_some()),
            ("preset", solver.preset.is_some()),
            ("detection", solver.detection.is_some()),
            ("tol", solver.tol.is_some()),
            ("max-iter", solver.max_iter.is_some()),
            ("residual", solver.residual.is_some()),
            ("on-failure", solver.on_failure.is_some()),
            ("substeps", solver.substeps.is_some()),
        ];
        let robot = names_of_set(&self.robot.given());
        names_of_set(&flags).into_iter().chain(robot).chain(self.physics.given()).collect()
    }
}

impl CubeArgs {
    /// Names of the changes of the cube that are set.
    pub fn given(&self) -> Vec<&'static str> {
        names_of_set(&[
            ("mass", self.mass.is_some()),
            ("inertia", self.inertia.is_some()),
            ("box", self.sides.is_some()),
            ("plane", self.plane.is_some()),
            ("force", !self.force.is_empty()),
            ("torque", !self.torque.is_empty()),
            ("force-at", self.force_at.is_some()),
            ("position", self.position.is_some()),
            ("height", self.height.is_some()),
            ("attitude", self.attitude.is_some()),
            ("velocity", self.velocity.is_some()),
            ("spin", self.spin.is_some()),
            ("frame", self.frame.is_some()),
        ])
    }

    /// Refuses these flags with a scene file, and names the field to set.
    pub fn refuse_with_file(&self) -> Result<(), Failure> {
        let Some(flag) = self.given().first().copied() else { return Ok(()) };
        let field = match flag {
            "plane" => "ground.slope",
            "force" | "torque" => &*format!("bodies.NAME.load.{flag}"),
            "force-at" => "bodies.NAME.load.at",
            "height" => "bodies.NAME.position",
            _ => &*format!("bodies.NAME.{flag}"),
        };
        let why =
            format!("it changes the tutorial's cube; write --set {field}=VALUE for a scene file");
        Err(Failure::setting(flag, why))
    }
}

/// Names of the flags that are set.
fn names_of_set(flags: &[(&'static str, bool)]) -> Vec<&'static str> {
    flags.iter().filter(|(_, is_set)| *is_set).map(|(name, _)| *name).collect()
}
