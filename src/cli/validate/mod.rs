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
    file.write(page(&report).as_bytes())?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pictures::validation::{Series, Solver, Trial};
    use tumble::validation::{Claim, Convergence, Curve, Quantity, find};

    /// A report of one quantity of first order at two time steps, `error` m off the discrete
    /// answer at the second of them.
    fn report(error: f64, failed: u64) -> Report {
        let trial = |error: f64, time_step: f64| Trial {
            time_step,
            quantities: vec![Quantity {
                name: "way < & >",
                unit: "m",
                measured: 2.0 + time_step + error,
                discrete: 2.0 + time_step,
                exact: 2.0,
                slack: 1e-5,
                claim: Claim::Equal,
                convergence: Convergence::Order(1),
            }],
            steps: 5,
            failed,
            fallback: 0,
            worst_certificate: 1e-12,
        };
        let curve = Curve {
            name: "way",
            unit: "m",
            times: vec![0.0, 0.1, 0.2],
            measured: vec![0.0, f64::INFINITY, 1.0],
            exact: vec![f64::NAN; 3],
        };
        let trials = vec![trial(0.0, 0.01), trial(error, 0.005)];
        let series = vec![Series { solver: Solver::Native, trials, curve }];
        let problem = find("free-fall").unwrap();
        let experiment = Experiment { problem, inputs: problem.inputs(), series };
        Report { given: "--speed <b>".to_owned(), experiments: vec![experiment] }
    }

    #[test]
    fn a_quantity_that_is_off_at_one_step_is_off_and_named() {
        let good = report(1e-5, 0);
        assert!(matches!(outcome(&good), Outcome::Done));
        assert_eq!(table::verdict(&good), "1 of 1 quantities hold\n");
        assert!(!page(&good).contains(">off<"));

        let off = report(6e-5, 0);
        assert!(matches!(outcome(&off), Outcome::Mismatch));
        assert_eq!(
            table::verdict(&off),
            "off: free-fall, way < & >, native at h = 0.005 s: error 6.0e-5 m, allowed 1.0e-5 m\n\
             0 of 1 quantities hold\n"
        );
        assert_eq!(page(&off).matches(">off<").count(), 1);
        assert!(table::describe(&off).contains("OFF"));
        // No number at all is no answer.
        assert!(matches!(outcome(&report(f64::NAN, 0)), Outcome::Mismatch));
    }

    #[test]
    fn a_quantity_of_another_order_than_declared_is_off_and_named() {
        let mut other = report(0.0, 0);
        let quantity = &mut other.experiments[0].series[0].trials[1].quantities[0];
        (quantity.measured, quantity.discrete) = (2.0025, 2.0025);
        assert!(matches!(outcome(&other), Outcome::Mismatch));
        assert_eq!(
            table::verdict(&other),
            "off: free-fall, way < & >, native at h = 0.005 s: declared Order(1), found 2.00\n\
             0 of 1 quantities hold\n"
        );
        assert_eq!(page(&other).matches(">off<").count(), 1);
    }

    #[test]
    fn steps_that_did_not_converge_come_before_the_quantities() {
        assert!(matches!(outcome(&report(1e-5, 1)), Outcome::Unconverged));
        assert!(matches!(outcome(&report(1.0, 1)), Outcome::Unconverged));
    }

    #[test]
    fn what_is_no_number_leaves_a_gap_and_words_are_escaped() {
        let page = page(&report(f64::NAN, 0));
        for wrong in ["NaN", "inf\"", "way < &", "<b>"] {
            assert!(!page.contains(wrong), "{wrong}");
        }
        assert!(page.contains("way &lt; &amp; &gt;") && page.contains("--speed &lt;b&gt;"));
    }
}
