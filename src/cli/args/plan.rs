//! The arguments of `tumble plan`.

use crate::cli::values;
use clap::Args;
use std::num::NonZeroUsize;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes: 0 a plan that does what it should, in the replay (exact or replayed); 2 bad input; \
    3 none (missed or failed): what comes nearest is written; 130 interrupted: the best so far is written; 1 anything \
    else."
)]
pub struct PlanArgs {
    /// The problem (TOML, see docs/planning.md).
    #[arg(value_name = "PROBLEM.toml")]
    pub file: PathBuf,
    /// Controls to start from, a controls.csv, in place of those that the file names.
    #[arg(long, value_name = "FILE.csv")]
    pub start: Option<PathBuf>,
    /// Only replay the start.
    #[arg(long)]
    pub replay: bool,
    /// The most time for the search, s, in place of the file's.
    #[arg(long, value_name = "SECONDS", value_parser = values::seconds, allow_hyphen_values = true)]
    pub time: Option<f64>,
    /// Threads; the plan does not depend on them [default: one a core].
    #[arg(long, value_name = "N", value_parser = values::threads, allow_hyphen_values = true)]
    pub threads: Option<NonZeroUsize>,
    /// Directory for controls.csv, plan.json, plan.html and the files of the run, made if it is not there.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
    /// No progress and no summary.
    #[arg(long)]
    pub quiet: bool,
}
