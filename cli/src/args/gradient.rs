//! Arguments of `tumble gradient`.

use crate::values;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes: 0 done; 2 bad input; 3 a step did not converge, so the results are \
                  not derivatives; 130 interrupted (nothing is written)."
)]
pub struct GradientArgs {
    /// Scenario file.
    #[arg(value_name = "FILE.toml")]
    pub file: PathBuf,
    /// Quantity to differentiate, of one body or joint at the end of the run.
    #[arg(long, value_enum, value_name = "QUANTITY")]
    pub of: GradientQuantity,
    /// Arguments to differentiate by, separated by commas; --help lists them.
    #[arg(
        long,
        long_help = crate::gradient::help(),
        value_delimiter = ',',
        default_value = "velocity,spin,friction",
        value_name = "LIST"
    )]
    pub by: Vec<String>,
    /// Body: a name or a number from 0 [default: 0].
    #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true)]
    pub body: Option<String>,
    /// Joint of the coordinate or rate: a name.
    #[arg(long, value_name = "NAME", allow_hyphen_values = true)]
    pub joint: Option<String>,
    /// Axis of that joint if it has several, such as slide, turn, x or turn_y.
    #[arg(long, value_name = "AXIS", requires = "joint")]
    pub axis: Option<String>,
    /// Number of steps [default: steps of the file].
    #[arg(short, long, value_parser = values::rows, allow_hyphen_values = true)]
    pub steps: Option<u64>,
    /// Seed of the random values in the file [default: seed of the file].
    #[arg(long, value_parser = values::seed, allow_hyphen_values = true)]
    pub seed: Option<u32>,
    /// Step size of central differences to print for comparison, in the unit of each argument;
    /// costs two more runs per derivative.
    #[arg(long, value_name = "SIZE", value_parser = values::number, allow_hyphen_values = true)]
    pub differences: Option<f64>,
    /// Compliance of contacts for smoothed derivatives, 1e-9 to 1.
    ///
    /// Each step starts from the state of the exact run. A search direction where the exact
    /// derivatives are zero.
    #[arg(long, value_name = "COMPLIANCE", value_parser = values::number, allow_hyphen_values = true)]
    pub compliance: Option<f64>,
    /// Speed for smoothed derivatives on the central path of an interior point, 1e-6 to 10 m/s.
    ///
    /// Its square is the product of force and gap of each contact. Without kinks and plateaus;
    /// contacts with a gap also act. Each step starts from the state of the exact run.
    #[arg(
        long,
        value_name = "SPEED",
        value_parser = values::number,
        allow_hyphen_values = true,
        conflicts_with = "compliance"
    )]
    pub central_path: Option<f64>,
    /// Directory for gradient.csv and gradient.json; created if missing.
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
    /// Print no table.
    #[arg(short, long)]
    pub quiet: bool,
}

/// Quantity of a body or joint at the end of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum GradientQuantity {
    /// Position along x, m, world.
    X,
    Y,
    Z,
    /// Velocity along x, m/s, world.
    Vx,
    Vy,
    Vz,
    /// Speed |v|, m/s.
    Speed,
    /// Distance from the initial position, m.
    Distance,
    /// Spin about x, rad/s, body.
    Wx,
    Wy,
    Wz,
    /// Coordinate of the joint of --joint, m or rad with full turns.
    Coordinate,
    /// Rate of that coordinate, m/s or rad/s.
    Rate,
    /// Kinetic energy ½ m v² + ½ ω·I ω, J. Mass and inertia are constants here, even if they are
    /// among the arguments.
    KineticEnergy,
}
