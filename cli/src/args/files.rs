//! Arguments of the commands that read a file.

use super::shared::{AnimationArgs, PhysicsArgs, RobotArgs};
use crate::values;
use clap::Args;
use std::path::PathBuf;

#[derive(Debug, Args)]
pub struct GifArgs {
    /// The trajectory, or a table of several bodies. Its parameters come from run.json beside it; the flags below go
    /// before them.
    #[arg(value_name = "FILE.csv")]
    pub file: PathBuf,
    /// Directory for animation.gif, created if missing, or a file name that ends in .gif [default: the directory of
    /// FILE.csv].
    #[arg(long, value_name = "DIR|FILE")]
    pub out: Option<PathBuf>,
    #[command(flatten)]
    pub animation: AnimationArgs,
    #[command(flatten)]
    pub physics: PhysicsArgs,
    /// No progress bar and no summary.
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct PlotArgs {
    /// The trajectory, or a table of several bodies. Its parameters come from run.json beside it; flags that are given
    /// override them. The defaults below hold only where there is no run.json.
    #[arg(value_name = "FILE.csv")]
    pub file: PathBuf,
    /// Directory for the pictures, made if it is not there [default: that of FILE.csv].
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Of several bodies, whose motion is drawn: a name, or a number from 0 [default: 0].
    #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true)]
    pub body: Option<String>,
    #[command(flatten)]
    pub physics: PhysicsArgs,
}

#[derive(Debug, Args)]
pub struct ViewArgs {
    /// The trajectory, or a table of several bodies, or two to compare. The parameters of each come from run.json beside
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
    /// The trajectory, or a table of several bodies. Its parameters come from run.json beside it; flags that are given
    /// override them. The defaults below hold only where there is no run.json.
    #[arg(value_name = "FILE.csv")]
    pub file: PathBuf,
    #[command(flatten)]
    pub physics: PhysicsArgs,
    /// How many of the worst steps to print.
    #[arg(long, value_name = "N", value_parser = values::count, default_value = "5", allow_hyphen_values = true)]
    pub worst: usize,
}

#[derive(Debug, Args)]
pub struct InspectArgs {
    /// JSON with state (13), alpha (8), x (61), obj_factor, multipliers (62), and
    /// optionally dt, mu, mass, inertia (3×3), gravity, epsilon; or of several bodies with bodies
    /// (each mass, inertia, state, and optionally wrench (6)), contacts (each a, b or null, point,
    /// frame (3×3, t₁, t₂, n as columns), offset, friction, and optionally radius, anchor (3)), x and
    /// multipliers (13 n + 6 K), obj_factor, and optionally dt, gravity, epsilon, share, stiffness
    /// (docs/formulation.md, section 12); `-` reads standard input.
    #[arg(value_name = "POINT.json")]
    pub file: PathBuf,
}

#[derive(Debug, Args)]
pub struct ConvertArgs {
    /// A robot, URDF or MJCF, or a scenario of several bodies with or without robots.
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
    /// The scenario file that is written: bodies, joints and motors, with all numbers.
    #[arg(value_name = "OUT.toml")]
    pub out: PathBuf,
    #[command(flatten)]
    pub robot: RobotArgs,
    /// No summary.
    #[arg(long)]
    pub quiet: bool,
}
