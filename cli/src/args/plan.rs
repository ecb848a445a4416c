//! Arguments of `tumble plan`.

use crate::values;
use clap::Args;
use std::num::NonZeroUsize;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(
    after_help = "Exit codes: 0 the replay meets all targets; 2 bad input; 3 it does not (missed or \
    failed), and the nearest plan is written; 130 interrupted, and the best plan so far is \
    written; 1 any other error."
)]
pub struct PlanArgs {
    /// Planning problem (TOML, see docs/planning.md).
    #[arg(value_name = "PROBLEM.toml")]
    pub file: PathBuf,
    /// Initial controls, a controls.csv; overrides `start` of the file.
    #[arg(long, value_name = "FILE.csv")]
    pub start: Option<PathBuf>,
    /// Replay the initial controls without a search.
    #[arg(long)]
    pub replay: bool,
    /// Time limit of the search, s; overrides `time` of the file.
    #[arg(long, value_name = "SECONDS", value_parser = values::seconds, allow_hyphen_values = true)]
    pub time: Option<f64>,
    /// Number of threads [default: one per core]. The plan does not depend on it.
    #[arg(long, value_name = "N", value_parser = values::threads, allow_hyphen_values = true)]
    pub threads: Option<NonZeroUsize>,
    /// Directory for controls.csv, plan.json, plan.html and the files of the run; created if missing.
    #[arg(short, long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
    /// Replace files in that directory that no earlier run wrote.
    #[arg(long)]
    pub overwrite: bool,
    /// Print no progress and no summary.
    #[arg(short, long)]
    pub quiet: bool,
}
