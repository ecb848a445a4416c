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
    /// What is simulated: a scene of the tutorial [default: drop].
    #[arg(long, value_enum)]
    pub scene: Option<SceneName>,
    /// What is simulated: a scenario file (TOML, see scenarios/README.md). Flags that are
    /// given go before its values.
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    pub scenario: Option<PathBuf>,
    /// Goes on with the run in DIR from where it ended, by its state.bin: what is simulated, and how, stands
    /// in its run.json. --steps counts all rows, also those that are there [default: as many as were asked
    /// for], and the files, in OUT or else in DIR, become those that a run of all of them in one go leaves.
    #[arg(long = "continue", value_name = "DIR", conflicts_with_all = ["scene", "scenario"])]
    pub continued: Option<PathBuf>,
    /// Rows of the trajectory: N−1 steps; 1 to 10000000 [default: drop 1000, floating 1200].
    #[arg(long, value_name = "N", value_parser = values::rows, allow_hyphen_values = true)]
    pub steps: Option<u64>,
    /// k of the first row: its time is k h, and loads are those of the times from there on
    /// [default: 0].
    #[arg(long, value_name = "K", value_parser = values::start_index, allow_hyphen_values = true)]
    pub start_index: Option<u64>,
    /// Seed of the attitude at the start, drawn as numpy.random.seed(SEED) and rand(4) do.
    /// The floating scene draws nothing and only records it [default: 42].
    #[arg(long, value_parser = values::seed, allow_hyphen_values = true)]
    pub seed: Option<u32>,
    #[command(flatten)]
    pub robot: RobotArgs,
    #[command(flatten)]
    pub physics: PhysicsArgs,
    /// Position of the centre of mass at the start, m, −1e6 to 1e6 [default: drop 0,0,2.5,
    /// floating 0,0,3].
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub position: Option<Vector3<f64>>,
    /// The position's Z alone, m.
    #[arg(long, value_name = "M", value_parser = values::number, allow_hyphen_values = true)]
    pub height: Option<f64>,
    /// Attitude at the start, body → frame: a quaternion, made a unit one, or `random`, drawn
    /// from the seed [default: drop random, floating 1,0,0,0].
    #[arg(long, value_name = "W,X,Y,Z", value_parser = values::attitude, allow_hyphen_values = true)]
    pub attitude: Option<Attitude>,
    /// Velocity at the start, m/s, −1e5 to 1e5 [default: drop 0,4,0, floating 2,0,0].
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub velocity: Option<Vector3<f64>>,
    /// Angular velocity at the start, rad/s, −1e5 to 1e5, body [default: drop 0,-2,1, floating
    /// 2,4,6].
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub spin: Option<Vector3<f64>>,
    /// In which frame position, attitude and velocity at the start are given: the world's, or
    /// the ground's, whose z is the plane's normal and the height above it [default: world].
    #[arg(long, value_enum)]
    pub frame: Option<StartFrame>,
    /// Who solves the contact steps: Ipopt as in the tutorial, or tumble's own solver,
    /// exact and a thousand times faster [default: ipopt, for several bodies native].
    #[arg(long, value_enum)]
    pub solver: Option<SolverName>,
    /// Solver settings that go together, instead of --solver and the flags below, to --on-failure. tutorial:
    /// the tutorial's program to the letter, with its failures: Ipopt alone, --formulation
    /// clamped, --detection height, the last solution as start without multipliers, tolerance
    /// 1e-6, 300 iterations, Ipopt's defaults else; a step that fails is kept and named failed.
    #[arg(long, value_enum)]
    pub preset: Option<Preset>,
    /// Which program Ipopt sees: the tutorial's, with the variables of corners that are not
    /// flagged clamped to zero, in SI units; or one without them, in the scene's own units, which
    /// costs less (docs/ipopt-path.md) [default: reduced].
    #[arg(long, value_enum)]
    pub formulation: Option<FormulationName>,
    /// Which corners may carry a force: those at most 5 mm high at step k (the tutorial's
    /// rule), or also those that free flight would take to the ground in this step
    /// [default: predictive].
    #[arg(long, value_enum)]
    pub detection: Option<DetectionName>,
    /// Ipopt's tolerance, 1e-12 to below 1; only with --solver ipopt [default: 1e-6].
    #[arg(long, value_parser = values::number, allow_hyphen_values = true)]
    pub tol: Option<f64>,
    /// Ipopt's iteration limit for a step, 1 to 1000000; only with --solver ipopt [default: 300].
    #[arg(long, value_name = "N", value_parser = values::iterations, allow_hyphen_values = true)]
    pub max_iter: Option<u32>,
    /// The residual to which the native solver solves contact steps, m/s, 1e-9 to 1e-2, of bodies of about a
    /// metre: crowds are sooner solved to less, and each step's certificate says what was reached
    /// [default: 1e-9].
    #[arg(long, value_name = "M/S", value_parser = values::number, allow_hyphen_values = true)]
    pub residual: Option<f64>,
    /// What becomes of a step that Ipopt does not solve from its first start: try other
    /// starts and at last the native solution, record it as failed and go on, or stop
    /// [default: ladder; with --solver native: record].
    #[arg(long, value_enum)]
    pub on_failure: Option<OnFailure>,
    /// Threads on which the native solver solves bodies that do not touch each other at the same
    /// time; the result does not depend on them. Many runs are faster one a core [default: 1].
    #[arg(long, value_name = "N", value_parser = values::threads, allow_hyphen_values = true)]
    pub threads: Option<NonZeroUsize>,
    /// Of each N steps the first alone has rows in the files, and the last state has always; 1 to 1000000
    /// [default: 1]. Steps that are left out are taken and counted all the same.
    #[arg(long, value_name = "N", value_parser = values::every, allow_hyphen_values = true)]
    pub every: Option<u64>,
    /// Take each step as N steps of an Nth of its length, 1 to 1000, and keep the rows of each N-th: --dt over N, N times
    /// as many steps, and --every N times what is given. For joints whose forces are too stiff for the step; which N would do, the
    /// summary says. run.json and --continue count the short steps [default: 1].
    #[arg(long, value_name = "N", value_parser = values::substeps, allow_hyphen_values = true)]
    pub substeps: Option<u64>,
    /// The tables that are written of a scene of [[bodies]]; `states` and `steps` are in any case
    /// [default: all]. `ends` has the states after each step of a run that leaves out rows (--every), by which
    /// `tumble verify` judges those that it keeps.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "TABLE,…")]
    pub tables: Option<Vec<Table>>,
    /// Format of the tables: CSV, or CSV compressed by Zstandard (states.csv.zst), about a tenth of the bytes. Every
    /// command reads both [default: csv].
    #[arg(long, value_enum)]
    pub format: Option<TableForm>,
    /// Directory for the files, made if it is not there [default: out, with --continue its own].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replaces files in that directory that are not those of an earlier run, and gives up a run that was killed there.
    #[arg(long)]
    pub overwrite: bool,
    /// Seconds between checkpoints, from which --continue goes on with a run that was killed; 0 for none [default: 10].
    #[arg(long, value_name = "SECONDS", value_parser = values::checkpoint, allow_hyphen_values = true)]
    checkpoint: Option<f64>,
    /// Also write the contact problem of every step with contacts, as step-K.dat in Siconos' text form, linearised at
    /// the step's solution (docs/contact-problem.md); only with the native solver, without joints. `tumble solve`
    /// reads them. Such files in that directory are in the way unless --overwrite is given.
    #[arg(long, value_name = "DIR")]
    pub export_problems: Option<PathBuf>,
    /// Also draw the trajectory over time, as `tumble plot` does.
    #[arg(long)]
    pub plot: bool,
    /// Also draw the motion: OUT/animation.gif.
    #[arg(long)]
    pub gif: bool,
    /// Also make a page that plays the motion in any browser: OUT/view.html.
    #[arg(long)]
    pub html: bool,
    #[command(flatten)]
    pub animation: AnimationArgs,
    /// No progress bar and no summary.
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
