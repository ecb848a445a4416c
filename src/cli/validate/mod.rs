//! `tumble validate`: simulations against closed-form answers.

mod args;
mod experiment;
mod table;

pub use args::ValidateArgs;

use super::output::{PendingFile, create_directory, progress_bar, say};
use super::simulate::raise_on_signals;
use super::{Failure, Outcome};
use crate::pictures::validation::{Experiment, Report, page};
use experiment::{Plan, Stop};
use std::io::Write;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// `tumble validate`.
pub fn run(args: &ValidateArgs) -> Result<Outcome, Failure> {
    if args.list {
        say(&table::list(&experiment::chosen(args)?))?;
        return Ok(Outcome::Done);
    }
    let plans = experiment::plan(args)?;
    let interrupt = Arc::new(AtomicBool::new(false));
    raise_on_signals(&interrupt)?;
    create_directory(&args.out)?;
    let file = PendingFile::create(&args.out, "validation.html")?;
    let report = match examine(args, plans, &interrupt) {
        Ok(report) => report,
        Err(Stop::Interrupted) => return Ok(Outcome::Interrupted),
        Err(Stop::Failed(failure)) => return Err(failure),
    };
    let mut stream = file.stream()?;
    stream
        .write_all(page(&report).as_bytes())
        .and_then(|()| stream.flush())
        .and_then(|()| stream.get_ref().sync_all())
        .map_err(|error| file.failed(&error))?;
    let path = file.publish()?;
    if !args.quiet {
        let wrote = format!("wrote {}\n", path.display());
        say(&(table::describe(&report) + &wrote + &table::verdict(&report)))?;
    }
    Ok(outcome(&report))
}

/// All runs, those of the fast solver first: they show at once what is wrong.
fn examine(
    args: &ValidateArgs,
    plans: Vec<Plan>,
    interrupt: &Arc<AtomicBool>,
) -> Result<Report, Stop> {
    let solvers = args.solver.each();
    let runs = |plan: &Plan| solvers.iter().map(|s| plan.time_steps(*s).len()).sum::<usize>();
    let bar = progress_bar(plans.iter().map(runs).sum::<usize>() as u64, "runs", args.quiet);
    let mut series: Vec<_> = plans.iter().map(|_| Vec::new()).collect();
    for &solver in solvers {
        for (plan, series) in plans.iter().zip(&mut series) {
            series.push(plan.run(solver, interrupt, || bar.inc(1))?);
        }
    }
    bar.finish_and_clear();
    let experiments = plans.into_iter().zip(series);
    let experiments = experiments.map(|(plan, series)| Experiment {
        problem: plan.problem,
        inputs: plan.inputs,
        series,
    });
    Ok(Report {
        given: experiment::flags(&args.inputs(), args.dt),
        experiments: experiments.collect(),
    })
}

fn outcome(report: &Report) -> Outcome {
    let series = || report.experiments.iter().flat_map(|experiment| &experiment.series);
    let (holding, count) = report.holding();
    if series().any(|series| series.sum(|trial| trial.failed) > 0) {
        Outcome::Unconverged
    } else if holding < count {
        Outcome::Mismatch
    } else {
        Outcome::Done
    }
}
