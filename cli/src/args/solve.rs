//! Arguments of `tumble solve`.

use crate::values;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes: 0 all are solved; 2 bad input; 3 some problem is not solved, or one of several files cannot be read; 130 interrupted (nothing \
    is written)."
)]
pub struct SolveArgs {
    /// Problems in Siconos' text form, or folders of them: all files there that end in .dat, by their names.
    #[arg(value_name = "FILE.dat|DIR", required = true)]
    pub problems: Vec<PathBuf>,
    /// The largest residual of what counts as solved, m/s: by how much the law is missed, each contact in its own
    /// scale (docs/contact-problem.md).
    #[arg(long, value_name = "M/S", default_value = "1e-9", value_parser = values::number, allow_hyphen_values = true)]
    pub residual: f64,
    /// Which solution, where there are several: the first that is found, or that of the native solver's rule, the limit of an
    /// equal, vanishing compliance, which takes longer.
    #[arg(long, value_enum, default_value = "any")]
    pub rule: Rule,
    /// Where solutions go: a directory, made if it is not there, for NAME.solution.csv of each problem and problems.csv of
    /// all; or of one problem a file that ends in .csv [default: none are written].
    #[arg(long, value_name = "DIR|FILE.csv", visible_alias = "output")]
    pub out: Option<PathBuf>,
    /// No table.
    #[arg(long)]
    pub quiet: bool,
}

/// Which solution, where there are several.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Rule {
    /// The first that is found.
    Any,
    /// The limit of an equal, vanishing compliance.
    Compliance,
}
