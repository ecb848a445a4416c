//! The arguments of `tumble sweep` and `tumble merge`.

use crate::cli::values;
use clap::Args;
use std::num::NonZeroUsize;
use std::path::PathBuf;

#[derive(Debug, Args)]
#[command(
    after_help = "Toss i is the scenario with seed S + i. They are computed in parts, each a \
    file of its own as soon as it is complete: what is there already is not computed again, on \
    whichever machine, so that a sweep that ended early goes on where it was. When all shards are \
    done, `tumble merge DIR` makes DIR/sweep.csv of them, the same bytes whatever the shards.\n\n\
    Exit codes: 0 done; 2 bad input; 3 finished, but some step did not converge; 130 interrupted; \
    1 anything else."
)]
pub struct SweepArgs {
    /// The scenario file (TOML), of which something must be random.
    #[arg(value_name = "SCENARIO")]
    pub scenario: PathBuf,
    /// How many tosses, 1 to 100000000.
    #[arg(long, value_name = "N", value_parser = values::tosses, allow_hyphen_values = true)]
    pub tosses: u32,
    /// Seed of the first toss.
    #[arg(long, value_name = "S", value_parser = values::seed, allow_hyphen_values = true)]
    #[arg(default_value = "0")]
    pub seed: u32,
    /// Compute the i-th of n shares, i from 1 to n.
    #[arg(long, value_name = "i/n", value_parser = values::shard, default_value = "1/1")]
    pub shard: (u32, u32),
    /// Rows of each toss, 2 to 10000000 [default: the scenario's].
    #[arg(long, value_name = "ROWS", value_parser = values::rows, allow_hyphen_values = true)]
    pub steps: Option<u64>,
    /// Coefficient of friction [default: the scenario's].
    #[arg(long, value_parser = values::number, allow_hyphen_values = true)]
    pub mu: Option<f64>,
    /// Threads; the result does not depend on them [default: one a core].
    #[arg(long, value_name = "N", value_parser = values::threads, allow_hyphen_values = true)]
    pub threads: Option<NonZeroUsize>,
    /// Directory of the sweep, one for all its shards; made if it is not there.
    #[arg(long, value_name = "DIR", default_value = "out/sweep")]
    pub out: PathBuf,
    /// No progress bar and no summary.
    #[arg(long)]
    pub quiet: bool,
}

#[derive(Debug, Args)]
pub struct MergeArgs {
    /// The directory of a sweep of which all shards are done.
    #[arg(value_name = "DIR")]
    pub directory: PathBuf,
    /// No summary.
    #[arg(long)]
    pub quiet: bool,
}
