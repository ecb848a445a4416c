//! The arguments, and what each value may be.

use crate::pictures::animation::View;
use clap::{Args, Parser, Subcommand, ValueEnum};
use nalgebra::{Matrix3, Vector3};
use std::path::PathBuf;
use tumble::detection::Detection;
use tumble::error::Error;
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
}

#[derive(Debug, Args)]
pub struct SimulateArgs {
    /// What is simulated.
    #[arg(long, value_enum, default_value_t = SceneName::Drop)]
    pub scene: SceneName,
    /// Rows of the trajectory, k = 0 … N−1: N−1 steps [default: drop 1000, floating 1200].
    #[arg(long, value_name = "N", value_parser = rows, allow_hyphen_values = true)]
    pub steps: Option<u64>,
    /// Seed of the attitude at the start, drawn as numpy.random.seed(SEED) and rand(4) do.
    /// The floating scene draws nothing and only records it.
    #[arg(long, default_value_t = 42, value_parser = seed, allow_hyphen_values = true)]
    pub seed: u32,
    #[command(flatten)]
    pub physics: PhysicsArgs,
    /// Sides of the box, m: one number (a cube) or three, along the body's axes
    /// [default: 2].
    #[arg(long = "box", value_name = "L", value_parser = sides, allow_hyphen_values = true)]
    pub sides: Option<Vector3<f64>>,
    /// Height of the centre of mass at the start, m [default: drop 2.5, floating 3].
    #[arg(long, value_name = "M", value_parser = number, allow_hyphen_values = true)]
    pub height: Option<f64>,
    /// Velocity at the start, m/s, world [default: drop 0,4,0, floating 2,0,0].
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub velocity: Option<Vector3<f64>>,
    /// Angular velocity at the start, rad/s, body [default: drop 0,-2,1, floating 2,4,6].
    #[arg(long, value_name = "X,Y,Z", value_parser = vector, allow_hyphen_values = true)]
    pub spin: Option<Vector3<f64>>,
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
    #[arg(long, value_parser = number, allow_hyphen_values = true)]
    pub tol: Option<f64>,
    /// Ipopt's iteration limit for a step; only with --solver ipopt [default: 300].
    #[arg(long, value_name = "N", value_parser = iterations, allow_hyphen_values = true)]
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
    #[arg(long, value_name = "FACTOR", value_parser = speed, allow_hyphen_values = true)]
    pub gif_speed: Option<f64>,
    /// Width and height of the animation, pixels [default: 800].
    #[arg(long, value_name = "PIXELS", value_parser = pixels, allow_hyphen_values = true)]
    pub gif_size: Option<u16>,
    /// Where the animation is seen from: degrees about the vertical, from x towards y, and
    /// degrees above the horizon, 0 to 90 [default: -32,20].
    #[arg(long, value_name = "AZIMUTH,ELEVATION", value_parser = view, allow_hyphen_values = true)]
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

/// The constants of the model that `simulate` and `verify` share.
#[derive(Debug, Args)]
pub struct PhysicsArgs {
    /// Time step, s [default: drop 0.002, floating 0.001].
    #[arg(long, value_name = "S", value_parser = number, allow_hyphen_values = true)]
    pub dt: Option<f64>,
    /// Coefficient of friction [default: 0.3].
    #[arg(long, value_parser = number, allow_hyphen_values = true)]
    pub mu: Option<f64>,
    /// Mass, kg [default: 10].
    #[arg(long, value_name = "KG", value_parser = number, allow_hyphen_values = true)]
    pub mass: Option<f64>,
    /// Inertia, kg m², body frame: one number (times the unit matrix), three (diagonal) or
    /// nine (the matrix by rows) [default: 0.01].
    #[arg(long, value_name = "I", value_parser = inertia, allow_hyphen_values = true)]
    pub inertia: Option<Matrix3<f64>>,
    /// Gravity, m/s²: one number (downwards) or the vector X,Y,Z [default: drop 9.81,
    /// floating 0].
    #[arg(long, value_name = "G", value_parser = gravity, allow_hyphen_values = true)]
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

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SolverName {
    /// Ipopt on the tutorial's nonlinear program.
    Ipopt,
    /// Newton's method on the contact law itself.
    Native,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
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

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
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
            "position (m)" => Some("height"),
            "velocity (m/s)" => Some("velocity"),
            "spin (rad/s)" => Some("spin"),
            _ => None,
        },
        Error::Ipopt(tumble::ipopt::IpoptError::Option { name, .. }) => Some(name),
        _ => None,
    }
}

fn number(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err("a finite number is needed".to_owned()),
    }
}

fn integer<T: std::str::FromStr + PartialOrd>(
    text: &str,
    low: T,
    high: T,
    needed: &str,
) -> Result<T, String> {
    match text.trim().parse::<T>() {
        Ok(value) if low <= value && value <= high => Ok(value),
        _ => Err(format!("a whole number from {needed} is needed")),
    }
}

fn rows(text: &str) -> Result<u64, String> {
    integer(text, 1, 10_000_000, "1 to 10000000")
}

fn seed(text: &str) -> Result<u32, String> {
    integer(text, 0, u32::MAX, "0 to 4294967295")
}

fn iterations(text: &str) -> Result<u32, String> {
    integer(text, 1, 1_000_000, "1 to 1000000")
}

fn speed(text: &str) -> Result<f64, String> {
    match number(text) {
        Ok(value) if (1e-4..=1e4).contains(&value) => Ok(value),
        _ => Err("a number from 0.0001 to 10000 is needed".to_owned()),
    }
}

fn pixels(text: &str) -> Result<u16, String> {
    integer(text, 100, 2000, "100 to 2000")
}

fn view(text: &str) -> Result<View, String> {
    match numbers(text).as_deref() {
        Some(&[azimuth, elevation])
            if azimuth.abs() <= 360.0 && (0.0..=90.0).contains(&elevation) =>
        {
            Ok(View { azimuth, elevation })
        }
        _ => Err("an azimuth from -360 to 360 and an elevation from 0 to 90 are needed".to_owned()),
    }
}

fn numbers(text: &str) -> Option<Vec<f64>> {
    text.split(',').map(|part| number(part).ok()).collect()
}

fn vector(text: &str) -> Result<Vector3<f64>, String> {
    match numbers(text).as_deref() {
        Some(&[x, y, z]) => Ok(Vector3::new(x, y, z)),
        _ => Err("three finite numbers X,Y,Z are needed".to_owned()),
    }
}

fn sides(text: &str) -> Result<Vector3<f64>, String> {
    match numbers(text).as_deref() {
        Some(&[side]) => Ok(Vector3::repeat(side)),
        Some(&[x, y, z]) => Ok(Vector3::new(x, y, z)),
        _ => Err("one finite number (a cube) or three X,Y,Z are needed".to_owned()),
    }
}

fn gravity(text: &str) -> Result<Vector3<f64>, String> {
    match numbers(text).as_deref() {
        Some(&[g]) => Ok(Vector3::new(0.0, 0.0, -g)),
        Some(&[x, y, z]) => Ok(Vector3::new(x, y, z)),
        _ => Err("one finite number (downwards) or three X,Y,Z are needed".to_owned()),
    }
}

fn inertia(text: &str) -> Result<Matrix3<f64>, String> {
    match numbers(text).as_deref() {
        Some(&[moment]) => Ok(Matrix3::from_diagonal_element(moment)),
        Some(&[x, y, z]) => Ok(Matrix3::from_diagonal(&Vector3::new(x, y, z))),
        Some(all) if all.len() == 9 => Ok(Matrix3::from_row_slice(all)),
        _ => Err("one, three or nine finite numbers are needed".to_owned()),
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

    #[test]
    fn matrices_come_from_one_three_or_nine_numbers() {
        assert_eq!(inertia("2").unwrap(), Matrix3::identity() * 2.0);
        assert_eq!(inertia("1,2,3").unwrap()[(2, 2)], 3.0);
        assert_eq!(inertia("1,2,3,4,5,6,7,8,9").unwrap()[(0, 2)], 3.0);
        for bad in ["", "1,2", "nan", "1,inf,2", "1;2;3"] {
            assert!(inertia(bad).is_err(), "{bad}");
        }
    }
}
