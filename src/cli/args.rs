//! The arguments, and what each value may be.

use super::settings::{Attitude, Frame, Inertia};
use super::validate::ValidateArgs;
use super::values::{self, LoadKnot};
use crate::pictures::animation::View;
use clap::{Args, Parser, Subcommand, ValueEnum};
use nalgebra::Vector3;
use serde::Deserialize;
use std::path::PathBuf;
use tumble::detection::Detection;
use tumble::error::Error;
use tumble::plane::Plane;
use tumble::scene::Scene;

const VERSION: &str =
    concat!(env!("CARGO_PKG_VERSION"), " (Ipopt ", env!("TUMBLE_IPOPT_VERSION"), ")");

/// Rigid bodies in hard frictional contact: every time step one optimisation problem,
/// solved and certified.
///
/// Without a verb: simulate a scene and write OUT/trajectory.csv and OUT/run.json.
#[derive(Debug, Parser)]
#[command(version = VERSION, args_conflicts_with_subcommands = true)]
#[command(after_help = "Exit codes: 0 done; 2 bad input; 3 finished, but some step did not \
    converge; 130 interrupted; 1 anything else.")]
pub struct Cli {
    #[command(subcommand)]
    pub command: Option<Command>,
    #[command(flatten)]
    pub simulate: SimulateArgs,
}

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Recompute the certificate of every step of a trajectory from the file alone.
    Verify(VerifyArgs),
    /// Draw a trajectory as an animated GIF.
    Gif(GifArgs),
    /// Draw a trajectory over time: plot and plot-energy, each as .png and .svg.
    Plot(PlotArgs),
    /// Make a page that plays one or two trajectories in any browser: view.html.
    View(ViewArgs),
    /// Evaluate the step's nonlinear program at a point: values and exact derivatives.
    Inspect(InspectArgs),
    /// Compare simulations with the closed-form answers of textbook problems: a table, and
    /// OUT/validation.html.
    Validate(ValidateArgs),
}

#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// What is simulated: a scene of the tutorial [default: drop].
    #[arg(long, value_enum)]
    pub scene: Option<SceneName>,
    /// What is simulated: a scenario file (TOML, see scenarios/README.md). Flags that are
    /// given go before its values.
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    pub scenario: Option<PathBuf>,
    /// Rows of the trajectory, k = 0 … N−1: N−1 steps [default: drop 1000, floating 1200].
    #[arg(long, value_name = "N", value_parser = values::rows, allow_hyphen_values = true)]
    pub steps: Option<u64>,
    /// Seed of the attitude at the start, drawn as numpy.random.seed(SEED) and rand(4) do.
    /// The floating scene draws nothing and only records it [default: 42].
    #[arg(long, value_parser = values::seed, allow_hyphen_values = true)]
    pub seed: Option<u32>,
    #[command(flatten)]
    pub physics: PhysicsArgs,
    /// Position of the centre of mass at the start, m [default: drop 0,0,2.5, floating
    /// 0,0,3].
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub position: Option<Vector3<f64>>,
    /// The position's Z alone, m.
    #[arg(long, value_name = "M", value_parser = values::number, allow_hyphen_values = true)]
    pub height: Option<f64>,
    /// Attitude at the start, body → frame: a quaternion, made a unit one, or `random`, drawn
    /// from the seed [default: drop random, floating 1,0,0,0].
    #[arg(long, value_name = "W,X,Y,Z", value_parser = values::attitude, allow_hyphen_values = true)]
    pub attitude: Option<Attitude>,
    /// Velocity at the start, m/s [default: drop 0,4,0, floating 2,0,0].
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub velocity: Option<Vector3<f64>>,
    /// Angular velocity at the start, rad/s, body [default: drop 0,-2,1, floating 2,4,6].
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub spin: Option<Vector3<f64>>,
    /// In which frame position, attitude and velocity at the start are given: the world's, or
    /// the ground's, whose z is the plane's normal and the height above it [default: world].
    #[arg(long, value_enum)]
    pub frame: Option<Frame>,
    /// Who solves the contact steps: Ipopt as in the tutorial, or tumble's own solver,
    /// exact and a thousand times faster [default: ipopt].
    #[arg(long, value_enum)]
    pub solver: Option<SolverName>,
    /// Which corners may carry a force: those at most 5 mm high at step k (the tutorial's
    /// rule), or also those that free flight would take to the ground in this step
    /// [default: predictive].
    #[arg(long, value_enum)]
    pub detection: Option<DetectionName>,
    /// Ipopt's tolerance; only with --solver ipopt [default: 1e-6].
    #[arg(long, value_parser = values::number, allow_hyphen_values = true)]
    pub tol: Option<f64>,
    /// Ipopt's iteration limit for a step; only with --solver ipopt [default: 300].
    #[arg(long, value_name = "N", value_parser = values::iterations, allow_hyphen_values = true)]
    pub max_iter: Option<u32>,
    /// What becomes of a step that Ipopt does not solve from its first start: try other
    /// starts and at last the native solution, record it as failed and go on, or stop
    /// [default: ladder; with --solver native: record].
    #[arg(long, value_enum)]
    pub on_failure: Option<OnFailure>,
    /// Directory for the files, made if it is not there.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
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

/// How an animation looks, for `simulate` and `gif`.
#[derive(Debug, Args)]
pub struct AnimationArgs {
    /// Speed of the animation: 0.1 is ten times slower than real [default: 1].
    #[arg(long, value_name = "FACTOR", value_parser = values::speed, allow_hyphen_values = true)]
    pub gif_speed: Option<f64>,
    /// Width and height of the animation, pixels [default: 800].
    #[arg(long, value_name = "PIXELS", value_parser = values::pixels, allow_hyphen_values = true)]
    pub gif_size: Option<u16>,
    /// Where the animation is seen from: degrees about the vertical, from x towards y, and
    /// degrees above the horizon, 0 to 90 [default: -32,20].
    #[arg(long, value_name = "AZIMUTH,ELEVATION", value_parser = values::view, allow_hyphen_values = true)]
    pub camera: Option<View>,
}

#[derive(Debug, Args)]
pub struct GifArgs {
    /// The trajectory. Its parameters come from run.json beside it; the flags below go
    /// before them.
    #[arg(value_name = "FILE.csv")]
    pub file: PathBuf,
    /// Directory for animation.gif, made if it is not there [default: that of FILE.csv].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub animation: AnimationArgs,
    #[command(flatten)]
    pub physics: PhysicsArgs,
    /// No progress bar and no summary.
    #[arg(long)]
    pub quiet: bool,
}

/// What certificates depend on: the constants of the model, and the load.
#[derive(Debug, Args)]
pub struct PhysicsArgs {
    /// Time step, s [default: drop 0.002, floating 0.001].
    #[arg(long, value_name = "S", value_parser = values::number, allow_hyphen_values = true)]
    pub dt: Option<f64>,
    /// Coefficient of friction [default: 0.3].
    #[arg(long, value_parser = values::number, allow_hyphen_values = true)]
    pub mu: Option<f64>,
    /// Mass, kg [default: 10].
    #[arg(long, value_name = "KG", value_parser = values::number, allow_hyphen_values = true)]
    pub mass: Option<f64>,
    /// Inertia, kg m², body frame: one number (times the unit matrix), three (diagonal),
    /// nine (the matrix by rows), or `solid`, that of a box of equal density [default: 0.01].
    #[arg(long, value_name = "I", value_parser = values::inertia, allow_hyphen_values = true)]
    pub inertia: Option<Inertia>,
    /// Sides of the box, m: one number (a cube) or three, along the body's axes
    /// [default: 2].
    #[arg(long = "box", value_name = "L", value_parser = values::sides, allow_hyphen_values = true)]
    pub sides: Option<Vector3<f64>>,
    /// The ground: its slope in degrees, falling towards +x, or its normal and, if it does not
    /// pass through the origin, its distance from there along the normal, m [default: 0].
    #[arg(long, value_name = "DEGREES|NX,NY,NZ[,D]", value_parser = values::plane, allow_hyphen_values = true)]
    pub plane: Option<Plane>,
    /// An external force, N, world: constant, or, given once for each knot as T:X,Y,Z, linear
    /// between the times T in s [default: none].
    #[arg(long, value_name = "[T:]X,Y,Z", value_parser = values::load_knot, allow_hyphen_values = true)]
    pub force: Vec<LoadKnot>,
    /// An external torque, N m, body frame; as --force [default: none].
    #[arg(long, value_name = "[T:]X,Y,Z", value_parser = values::load_knot, allow_hyphen_values = true)]
    pub torque: Vec<LoadKnot>,
    /// Where the external force acts, m, body frame, from the centre of mass [default:
    /// 0,0,0].
    #[arg(long, value_name = "X,Y,Z", value_parser = values::vector, allow_hyphen_values = true)]
    pub force_at: Option<Vector3<f64>>,
    /// Gravity, m/s²: one number (downwards) or the vector X,Y,Z [default: drop 9.81,
    /// floating 0].
    #[arg(long, value_name = "G", value_parser = values::gravity, allow_hyphen_values = true)]
    pub gravity: Option<Vector3<f64>>,
}

#[derive(Debug, Args)]
pub struct PlotArgs {
    /// The trajectory. Its parameters come from run.json beside it; flags that are given
    /// override them. The defaults below hold only where there is no run.json.
    #[arg(value_name = "FILE.csv")]
    pub file: PathBuf,
    /// Directory for the pictures, made if it is not there [default: that of FILE.csv].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub physics: PhysicsArgs,
}

#[derive(Debug, Args)]
pub struct ViewArgs {
    /// The trajectory, or two to compare. The parameters of each come from run.json beside
    /// it; flags that are given override them. The defaults below hold only where there is
    /// no run.json.
    #[arg(value_name = "FILE.csv", num_args = 1..=2, required = true)]
    pub files: Vec<PathBuf>,
    /// Directory for view.html, made if it is not there [default: that of the first file].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub physics: PhysicsArgs,
    /// No summary.
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct VerifyArgs {
    /// The trajectory. Its parameters come from run.json beside it; flags that are given
    /// override them. The defaults below hold only where there is no run.json.
    #[arg(value_name = "FILE.csv")]
    pub file: PathBuf,
    #[command(flatten)]
    pub physics: PhysicsArgs,
    /// How many of the worst steps to print.
    #[arg(long, value_name = "N", default_value_t = 5, allow_hyphen_values = true)]
    pub worst: usize,
}

#[derive(Debug, Args)]
pub struct InspectArgs {
    /// JSON with state (13), alpha (8), x (61), obj_factor, multipliers (62), and
    /// optionally dt, mu, mass, inertia (3×3), gravity, epsilon; `-` reads standard input.
    #[arg(value_name = "POINT.json")]
    pub file: PathBuf,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SceneName {
    /// A cube thrown on the ground.
    Drop,
    /// A cube floating without gravity or ground.
    Floating,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SolverName {
    /// Ipopt on the tutorial's nonlinear program.
    Ipopt,
    /// Newton's method on the contact law itself.
    Native,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum OnFailure {
    /// Climb the ladder of other starts; only with --solver ipopt.
    Ladder,
    /// Keep the point found, as the tutorial does, but say so.
    Record,
    /// End the run before such a step.
    Stop,
}

impl OnFailure {
    pub fn name(self) -> &'static str {
        match self {
            Self::Ladder => "ladder",
            Self::Record => "record",
            Self::Stop => "stop",
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DetectionName {
    /// z ≤ 5 mm at step k.
    Height,
    /// The same, or free flight ends at z ≤ 0.
    Predictive,
}

impl SceneName {
    pub fn scene(self) -> Scene {
        match self {
            Self::Drop => Scene::drop(),
            Self::Floating => Scene::floating(),
        }
    }
}

impl From<DetectionName> for Detection {
    fn from(name: DetectionName) -> Self {
        match name {
            DetectionName::Height => Self::Height,
            DetectionName::Predictive => Self::Predictive,
        }
    }
}

/// The flag (or field of a file) that sets what the model refused.
pub fn flag_behind(error: &Error) -> Option<&'static str> {
    match error {
        Error::Inertia(_) => Some("inertia"),
        Error::OutOfRange { field, .. } => match *field {
            "time step (s)" => Some("dt"),
            "coefficient of friction" => Some("mu"),
            "mass (kg)" => Some("mass"),
            "gravity (m/s²)" => Some("gravity"),
            "half side of the box (m)" => Some("box"),
            "smoothing epsilon (N)" => Some("epsilon"),
            "position (m)" => Some("position or height"),
            "norm of the attitude quaternion" => Some("attitude"),
            "normal of the plane" | "length of the plane's normal" | "offset of the plane (m)" => {
                Some("plane")
            }
            "load (N, N m)" | "time of the load (s)" => Some("force or torque"),
            "point of the load (m)" => Some("force-at"),
            "velocity (m/s)" => Some("velocity"),
            "spin (rad/s)" => Some("spin"),
            _ => None,
        },
        Error::Ipopt(tumble::ipopt::IpoptError::Option { name, .. }) => Some(name),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_definition_is_consistent() {
        Cli::command().debug_assert();
    }
}
