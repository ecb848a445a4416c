//! Arguments of `tumble solve`.

use crate::values;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes: 0 all problems are solved; 2 bad input; 3 a problem is not solved, \
                  or one of several files cannot be read; 130 interrupted (nothing is written)."
)]
pub struct SolveArgs {
    /// Files in Siconos' text format, or folders, which stand for all their files that end in .dat.
    #[arg(value_name = "FILE.dat|DIR", required = true)]
    pub problems: Vec<PathBuf>,
    /// Largest residual of a solved problem, m/s: the violation of the contact law, each contact in
    /// its own scale (docs/contact-problem.md).
    #[arg(long, value_name = "M/S", default_value = "1e-9", value_parser = values::number, allow_hyphen_values = true)]
    pub residual: f64,
    /// Selection rule if a problem has several solutions: the first found, or the limit of an
    /// equal, vanishing compliance, which is the native solver's rule and takes longer.
    #[arg(long, value_enum, default_value = "any")]
    pub rule: Rule,
    /// Directory for the solutions, created if missing: NAME.solution.csv per problem and
    /// problems.csv for all.
    ///
    /// For one problem, also a file name that ends in .csv [default: no files].
    #[arg(short, long, value_name = "DIR|FILE.csv", visible_alias = "output")]
    pub out: Option<PathBuf>,
    /// Print no table.
    #[arg(short, long)]
    pub quiet: bool,
}

/// Selection rule if a problem has several solutions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Rule {
    /// First solution found.
    Any,
    /// Limit of an equal, vanishing compliance.
    Compliance,
}
