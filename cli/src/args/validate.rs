//! Arguments of `tumble validate`.

use crate::values;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Exit codes: 0 every quantity holds; 1 a quantity is off, or any other \
                        error; 2 bad input; 3 a step did not converge; 130 interrupted (no page is \
                        written).")]
pub struct ValidateArgs {
    /// Names of the problems (see --list) [default: all].
    #[arg(value_name = "PROBLEM")]
    pub problems: Vec<String>,
    /// Solver of the contact steps.
    ///
    /// Ipopt solves up to ten bodies; larger problems, and a few others, are left out and listed
    /// with the reason.
    #[arg(long, value_enum, default_value = "both")]
    pub solver: Solvers,
    /// Time step, s, 4e-6 to 0.1.
    ///
    /// Every problem also runs with half of it, and with the native solver with a quarter [default:
    /// the problem's own (see --list); with Ipopt five times that, some minutes for all].
    #[arg(long, value_name = "S", value_parser = values::halved_step, allow_hyphen_values = true)]
    pub dt: Option<f64>,
    /// Mass, kg.
    #[arg(long, value_name = "KG", value_parser = values::number, allow_hyphen_values = true)]
    pub mass: Option<f64>,
    /// Coefficient of friction.
    #[arg(long, value_parser = values::number, allow_hyphen_values = true)]
    pub mu: Option<f64>,
    /// Coefficient of restitution.
    #[arg(long, value_name = "E", value_parser = values::number, allow_hyphen_values = true)]
    pub restitution: Option<f64>,
    /// Gravity, m/s², downwards.
    #[arg(long, value_name = "G", value_parser = values::number, allow_hyphen_values = true)]
    pub gravity: Option<f64>,
    /// Slope of the ground, degrees.
    #[arg(long, value_name = "DEGREES", value_parser = values::number, allow_hyphen_values = true)]
    pub slope: Option<f64>,
    /// Initial speed, in the problem's unit.
    ///
    /// This flag and the five above apply to the problems that depend on them.
    #[arg(long, value_name = "V", value_parser = values::number, allow_hyphen_values = true)]
    pub speed: Option<f64>,
    /// List the problems with their inputs and defaults, and run none.
    #[arg(long, conflicts_with_all = ["solver", "dt", "mass", "mu", "restitution", "gravity",
        "slope", "speed", "out", "quiet"])]
    pub list: bool,
    /// Directory for validation.html; created if missing.
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
    /// Print no progress bar and no tables.
    #[arg(short, long)]
    pub quiet: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Solvers {
    /// tumble's own solver.
    Native,
    /// Ipopt on the step's nonlinear program.
    Ipopt,
    /// Both solvers, one after the other.
    Both,
}
