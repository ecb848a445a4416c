//! `tumble sweep` and `tumble merge`: many tosses of a scenario, in shares of any number of
//! machines, and their results as one table.

mod merge;
mod plan;
mod toss;

pub use merge::run as merge;

use super::args::SweepArgs;
use super::directory::OutputDirectory;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, Voice, progress_bar};
use super::scenario;
use super::shown;
use super::signals::raise_on_signals;
use plan::Plan;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::available_parallelism;

/// `tumble sweep`.
pub fn run(args: &SweepArgs) -> Result<Outcome, Failure> {
    let text = scenario::read_text(&args.scenario)?;
    let plan = Plan::new(args, text)?;
    // What is wrong with the scenario shows before the first file.
    toss::check_size(&plan, &toss::scene(&plan, &args.scenario, 0)?)?;
    let interrupt = Arc::new(AtomicBool::new(false));
    raise_on_signals(&interrupt)?;
    let out = OutputDirectory::for_pictures(&args.out)?;
    plan.write(&out)?;
    let threads = args.threads.map_or_else(available_parallelism, Ok);
    let threads = threads.map_err(|error| Failure::Other(format!("--threads: {error}")))?;

    let (index, shards) = args.shard;
    let parts: Vec<_> = (0..plan.parts()).filter(|part| part % shards == index - 1).collect();
    let bar = progress_bar(parts.len() as u64, "parts", args.quiet);
    let (mut computed, mut known, mut unsolved) = (0, 0, 0);
    for part in &parts {
        let name = plan::part_file(*part);
        if plan.knows(out.path(), *part)? {
            known += 1;
        } else {
            let Some(done) = toss::part(&plan, &args.scenario, *part, threads, &interrupt)? else {
                break;
            };
            let pending = PendingFile::create(&out, &name)?;
            pending.write(plan.sealed(*part, &done.csv).as_bytes())?;
            pending.publish()?;
            computed += 1;
            unsolved += done.unsolved;
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    let interrupted = interrupt.load(Ordering::Relaxed);
    let mut voice = Voice::new(args.quiet);
    voice.say(&format!(
        "shard {index}/{shards}: {computed} parts computed, {known} there already, of {}; steps \
         not solved in these: {unsolved}\n{} in {}\n",
        parts.len(),
        if interrupted { "interrupted; go on with the same command" } else { "done" },
        shown::path(out.path())
    ));
    voice.end(match (interrupted, unsolved) {
        (true, _) => Outcome::Interrupted,
        (false, 0) => Outcome::Done,
        (false, _) => Outcome::Unconverged,
    })
}
