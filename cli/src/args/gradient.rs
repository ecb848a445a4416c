//! Arguments of `tumble gradient`.

use crate::values;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes: 0 done; 2 bad input; 3 some step of the run was not solved, so that \
    what follows is no derivative; 130 interrupted (nothing is written)."
)]
pub struct GradientArgs {
    /// The scenario file.
    #[arg(value_name = "FILE.toml")]
    pub file: PathBuf,
    /// What is differentiated, of the body at the end of the run.
    #[arg(long, value_enum, value_name = "QUANTITY")]
    pub of: GradientQuantity,
    /// By what, separated by commas: of the body at the start position, turn, velocity, spin; force and torque on
    /// it through all steps; and constants of the world: friction, restitution, mass, inertia, size, radius, gravity,
    /// ground, time_step.
    #[arg(
        long,
        value_delimiter = ',',
        default_value = "velocity,spin,friction",
        value_name = "LIST"
    )]
    pub by: Vec<String>,
    /// Which body: a name, or a number from 0 [default: 0].
    #[arg(long, value_name = "NAME|INDEX", allow_hyphen_values = true)]
    pub body: Option<String>,
    /// Steps of the run [default: those of the file].
    #[arg(long, value_parser = values::rows, allow_hyphen_values = true)]
    pub steps: Option<u64>,
    /// Seed of what the file draws.
    #[arg(long, value_parser = values::seed, allow_hyphen_values = true)]
    pub seed: Option<u32>,
    /// Central differences of this size beside each derivative, in its argument's unit: two runs for each.
    #[arg(long, value_name = "SIZE", value_parser = values::number, allow_hyphen_values = true)]
    pub differences: Option<f64>,
    /// Smoothed derivatives: of the run's steps from the same states in which contacts give way by this much, 1e-9 to 1. A
    /// direction for a search where the exact ones are zero.
    #[arg(long, value_name = "COMPLIANCE", value_parser = values::number, allow_hyphen_values = true)]
    pub compliance: Option<f64>,
    /// Smoothed derivatives: of the run's steps from the same states with contacts on the central path of an interior point, whose
    /// products of force and gap are this speed squared, 1e-6 to 10 m/s. No kinks and no plateaus; what is near is felt.
    #[arg(
        long,
        value_name = "SPEED",
        value_parser = values::number,
        allow_hyphen_values = true,
        conflicts_with = "compliance"
    )]
    pub central_path: Option<f64>,
    /// Directory for gradient.csv and gradient.json; created if missing.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
    /// No table.
    #[arg(long)]
    pub quiet: bool,
}

/// A number that the body at the end of a run decides.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum GradientQuantity {
    /// Of its place, m, world.
    X,
    Y,
    Z,
    /// Of its velocity, m/s, world.
    Vx,
    Vy,
    Vz,
    /// |v|, m/s.
    Speed,
    /// From where it started, m.
    Distance,
    /// ½ m v² + ½ ω·I ω, J, with the file's mass and inertia also where they are differentiated by.
    KineticEnergy,
}
