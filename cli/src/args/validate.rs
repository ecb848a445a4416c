//! Arguments of `tumble validate`.

use crate::values;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(after_help = "Exit codes: 0 every quantity holds; 1 a quantity is off, or anything \
    else; 2 bad input; 3 some step did not converge; 130 interrupted (no page is written).")]
pub struct ValidateArgs {
    /// The problems, by name (see --list) [default: all].
    #[arg(value_name = "PROBLEM")]
    pub problems: Vec<String>,
    /// Who solves the contact steps. Ipopt's path is of up to ten bodies: problems of more, and few
    /// others, are left out with it, and named with the reason.
    #[arg(long, value_enum, default_value = "both")]
    pub solver: Solvers,
    /// Time step, s. Every problem is also run with its half, the native solver with its
    /// quarter as well [default: the problem's own (see --list), and five times that with
    /// Ipopt, which is slower: some minutes for all].
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
    /// Speed at the start, in the problem's unit. This and the five flags above go to the
    /// problems that depend on them.
    #[arg(long, value_name = "V", value_parser = values::number, allow_hyphen_values = true)]
    pub speed: Option<f64>,
    /// List the problems with their inputs and usual values; run none.
    #[arg(long, conflicts_with_all = ["solver", "dt", "mass", "mu", "restitution", "gravity",
        "slope", "speed", "out", "quiet"])]
    pub list: bool,
    /// Directory for validation.html, made if it is not there.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
    /// No progress bar and no tables.
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Solvers {
    /// tumble's own solver.
    Native,
    /// Ipopt on the step's nonlinear program.
    Ipopt,
    /// One after the other.
    Both,
}
