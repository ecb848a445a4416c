//! Arguments of a simulation.

use super::shared::{AnimationArgs, PhysicsArgs, RobotArgs};
use crate::values;
use clap::Args;
use nalgebra::Vector3;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::time::Duration;
use tumble_scene::choices::{
    Attitude, DetectionName, FormulationName, OnFailure, Preset, SceneName, SolverName, StartFrame,
};
use tumble_scene::kept::{KeptSteps, TableForm};
use tumble_scene::output::tables::Table;

#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// Scene of the tutorial to simulate [default: drop].
    #[arg(long, value_enum)]
    pub scene: Option<SceneName>,
    /// Scenario file to simulate (TOML, see scenarios/README.md). Flags override its values.
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    pub scenario: Option<PathBuf>,
    /// Continue the run in DIR from its state.bin. Scene and settings are read from its run.json.
    /// --steps counts all rows, including the existing ones [default: the number requested at
    /// first]. The files are written to --out, or to DIR without it, and equal those of an
    /// uninterrupted run.
    #[arg(long = "continue", value_name = "DIR", conflicts_with_all = ["scene", "scenario"])]
    pub continued: Option<PathBuf>,
    /// Number of rows of the trajectory, one more than steps, 1 to 10000000 [default: drop 1000,
    /// floating 1200].
    #[arg(long, value_name = "N", value_parser = values::rows, allow_hyphen_values = true)]
    pub steps: Option<u64>,
    /// Index k of the first row; its time is k h, which also shifts the times of loads [default:
    /// 0].
    #[arg(long, value_name = "K", value_parser = values::start_index, allow_hyphen_values = true)]
    pub start_index: Option<u64>,
    /// Seed of the random initial attitude, drawn as numpy.random.seed(SEED) and rand(4) do. The
    /// floating scene draws nothing and only records it [default: 42].
    #[arg(long, value_parser = values::seed, allow_hyphen_values = true)]
    pub seed: Option<u32>,
    #[command(flatten)]
    pub robot: RobotArgs,
    #[command(flatten)]
    pub physics: PhysicsArgs,
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
    pub attitude: Option<Attitude>,
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
    /// Solver of the contact steps: Ipopt as in the tutorial, or tumble's own solver, which is
    /// exact and a thousand times faster [default: ipopt; with several bodies native].
    #[arg(long, value_enum)]
    pub solver: Option<SolverName>,
    /// Preset of solver settings, instead of --solver, --formulation, --detection, --tol,
    /// --max-iter, --residual and --on-failure. `tutorial` solves the tutorial's program unchanged:
    /// Ipopt alone, --formulation clamped, --detection height, --tol 1e-6, --max-iter 300, Ipopt's
    /// other defaults. Each step starts from the last solution without multipliers. A step that is
    /// not solved is kept with status failed.
    #[arg(long, value_enum)]
    pub preset: Option<Preset>,
    /// Formulation of Ipopt's program. `clamped` is the tutorial's: SI units, variables of inactive
    /// corners fixed at zero. `reduced` omits these variables, scales the units and costs less
    /// (docs/ipopt-path.md) [default: reduced].
    #[arg(long, value_enum)]
    pub formulation: Option<FormulationName>,
    /// Criterion for corners that may carry a force: those at most 5 mm high at step k (the
    /// tutorial's), or also those that free flight would bring to the ground in this step [default:
    /// predictive].
    #[arg(long, value_enum)]
    pub detection: Option<DetectionName>,
    /// Ipopt's tolerance, 1e-12 to below 1; only with --solver ipopt [default: 1e-6].
    #[arg(long, value_parser = values::number, allow_hyphen_values = true)]
    pub tol: Option<f64>,
    /// Ipopt's iteration limit per step, 1 to 1000000; only with --solver ipopt [default: 300].
    #[arg(long, value_name = "N", value_parser = values::iterations, allow_hyphen_values = true)]
    pub max_iter: Option<u32>,
    /// Residual at which the native solver accepts a contact step, m/s, 1e-9 to 1e-2, for bodies of
    /// about one metre. A larger value saves time in large scenes. The certificate of each step
    /// records the residual reached [default: 1e-9].
    #[arg(long, value_name = "M/S", value_parser = values::number, allow_hyphen_values = true)]
    pub residual: Option<f64>,
    /// Action if Ipopt does not solve a step from its first initial point: try other initial points
    /// and finally the native solution, record the failure and continue, or stop [default: ladder;
    /// with --solver native record].
    #[arg(long, value_enum)]
    pub on_failure: Option<OnFailure>,
    /// Number of threads of the native solver, 1 to 1024, for bodies that do not touch each other.
    /// The result does not depend on it. Many runs are faster with one core each [default: 1].
    #[arg(long, value_name = "N", value_parser = values::threads, allow_hyphen_values = true)]
    pub threads: Option<NonZeroUsize>,
    /// Write only every N-th step and the last state, 1 to 1000000. All steps are simulated and
    /// counted [default: 1].
    #[arg(long, value_name = "N", value_parser = values::every, allow_hyphen_values = true)]
    pub every: Option<u64>,
    /// Replace each step by N steps of 1/N of its length, 1 to 1000, and write every N-th: --dt
    /// over N, N times as many steps and N times --every. For joints whose forces are too stiff for
    /// the time step; the summary suggests N. run.json and --continue count the short steps
    /// [default: 1].
    #[arg(long, value_name = "N", value_parser = values::substeps, allow_hyphen_values = true)]
    pub substeps: Option<u64>,
    /// Tables to write for a scene of [[bodies]]; `states` and `steps` are always written [default:
    /// all]. With --every, `ends` has the state after each written step, which `tumble verify`
    /// needs.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "TABLE,…")]
    pub tables: Option<Vec<Table>>,
    /// Format of the tables: CSV, or CSV compressed by Zstandard (states.csv.zst), about a tenth of
    /// the size. Every command reads both [default: csv].
    #[arg(long, value_enum)]
    pub format: Option<TableForm>,
    /// Directory for the files; created if missing [default: out; with --continue its DIR].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace files in that directory that no earlier run wrote, and discard the checkpoint of a
    /// killed run there.
    #[arg(long)]
    pub overwrite: bool,
    /// Time between checkpoints, s, 0 to 1e6; 0 for none. --continue resumes a killed run from the
    /// last one [default: 10].
    #[arg(long, value_name = "SECONDS", value_parser = values::checkpoint, allow_hyphen_values = true)]
    checkpoint: Option<f64>,
    /// Also write the contact problem of every step with contacts, as step-K.dat in Siconos' text
    /// format, linearised at the step's solution (docs/contact-problem.md). `tumble solve` reads
    /// these files. Only with the native solver, without joints. Existing files of this kind in DIR
    /// are replaced only with --overwrite.
    #[arg(long, value_name = "DIR")]
    pub export_problems: Option<PathBuf>,
    /// Also plot the trajectory over time, as `tumble plot` does.
    #[arg(long)]
    pub plot: bool,
    /// Also draw the motion: OUT/animation.gif.
    #[arg(long)]
    pub gif: bool,
    /// Also write a page that plays the motion in a browser: OUT/view.html.
    #[arg(long)]
    pub html: bool,
    #[command(flatten)]
    pub animation: AnimationArgs,
    /// Print no progress bar and no summary.
    #[arg(long)]
    pub quiet: bool,
}

impl SimulateArgs {
    /// Directory for the files.
    pub fn out(&self) -> &Path {
        self.out.as_deref().or(self.continued.as_deref()).unwrap_or(Path::new("out"))
    }

    /// Time between checkpoints; `None` for no checkpoints.
    pub fn checkpoint(&self) -> Option<Duration> {
        let every = self.checkpoint.unwrap_or(10.0);
        (every > 0.0).then(|| Duration::from_secs_f64(every))
    }

    /// Selection of rows to write.
    pub fn kept(&self) -> KeptSteps {
        let every = self.every.unwrap_or(1).saturating_mul(self.substeps.unwrap_or(1));
        KeptSteps::new(every, self.tables.as_deref(), self.format.unwrap_or_default())
    }

    /// Names of the settings flags that are set.
    pub fn given(&self) -> Vec<&'static str> {
        let flags = [
            ("steps", self.steps.is_some()),
            ("start-index", self.start_index.is_some()),
            ("seed", self.seed.is_some()),
            ("position", self.position.is_some()),
            ("height", self.height.is_some()),
            ("attitude", self.attitude.is_some()),
            ("velocity", self.velocity.is_some()),
            ("spin", self.spin.is_some()),
            ("frame", self.frame.is_some()),
            ("solver", self.solver.is_some()),
            ("preset", self.preset.is_some()),
            ("formulation", self.formulation.is_some()),
            ("detection", self.detection.is_some()),
            ("tol", self.tol.is_some()),
            ("max-iter", self.max_iter.is_some()),
            ("residual", self.residual.is_some()),
            ("on-failure", self.on_failure.is_some()),
            ("every", self.every.is_some()),
            ("substeps", self.substeps.is_some()),
            ("tables", self.tables.is_some()),
            ("format", self.format.is_some()),
        ];
        let own = flags.into_iter().filter(|(_, given)| *given).map(|(name, _)| name);
        let robot = self.robot.settings().given().into_iter();
        let robot = robot.filter(|(_, given)| *given).map(|(name, _)| name);
        own.chain(robot).chain(self.physics.given()).collect()
    }
}
