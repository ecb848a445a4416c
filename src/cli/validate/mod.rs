//! `tumble validate`: simulations against closed-form answers.

mod experiment;
mod report;
mod table;

use super::args::ValidateArgs;
use super::directory::OutputDirectory;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, progress_bar, say};
use super::shown;
use super::signals::raise_on_signals;
use experiment::{Plan, Stop};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::validation::Problem;
use tumble_pictures::validation::{Report, Solver, page};

/// `tumble validate`.
pub fn run(args: &ValidateArgs) -> Result<Outcome, Failure> {
    if args.list {
        let usual = |problem: &dyn Problem| {
            let inputs = problem.inputs();
            (report::experiment(problem, &inputs, Vec::new()), inputs.time_step)
        };
        let problems: Vec<_> = experiment::chosen(args)?.into_iter().map(usual).collect();
        say(&table::list(&problems))?;
        return Ok(Outcome::Done);
    }
    let plans = experiment::plan(args)?;
    let interrupt = Arc::new(AtomicBool::new(false));
    raise_on_signals(&interrupt)?;
    let directory = OutputDirectory::for_pictures(&args.out)?;
    let file = PendingFile::create(&directory, "validation.html")?;
    let report = match examine(args, plans, &interrupt) {
        Ok(report) => report,
        Err(Stop::Interrupted) => return Ok(Outcome::Interrupted),
        Err(Stop::Failed(failure)) => return Err(failure),
    };
    file.write(page(&report).as_bytes())?;
    let path = file.publish()?;
    if !args.quiet {
        let wrote = format!("wrote {}\n", shown::path(&path));
        let left_out = table::left_out(&experiment::left_out(args)?);
        say(&(table::describe(&report) + &wrote + &left_out + &table::verdict(&report)))?;
    }
    Ok(outcome(&report))
}

/// All runs, those of the fast solver first: they show at once what is wrong.
fn examine(
    args: &ValidateArgs,
    plans: Vec<Plan>,
    interrupt: &Arc<AtomicBool>,
) -> Result<Report, Stop> {
    let solvers = experiment::each(args.solver);
    let takes = |solver: &&Solver, plan: &Plan| experiment::takes(**solver, plan.problem);
    let runs = |plan: &Plan| -> usize {
        let solvers = solvers.iter().filter(|solver| takes(solver, plan));
        solvers.map(|solver| plan.time_steps(*solver).len()).sum()
    };
    let bar = progress_bar(plans.iter().map(runs).sum::<usize>() as u64, "runs", args.quiet);
    let mut series: Vec<_> = plans.iter().map(|_| Vec::new()).collect();
    for solver in solvers {
        for (plan, series) in plans.iter().zip(&mut series).filter(|(plan, _)| takes(&solver, plan))
        {
            series.push(plan.run(*solver, interrupt, || bar.inc(1))?);
        }
    }
    bar.finish_and_clear();
    let experiments = plans.into_iter().zip(series);
    let experiments =
        experiments.map(|(plan, series)| report::experiment(plan.problem, &plan.inputs, series));
    Ok(Report {
        program: format!(
            "tumble {}, Ipopt {}",
            env!("CARGO_PKG_VERSION"),
            env!("TUMBLE_IPOPT_VERSION")
        ),
        given: experiment::flags(&experiment::given(args), args.dt),
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
    use tumble_pictures::validation::{Curve, Experiment, Quantity, Series, Solver, Trial};

    /// A report of one quantity of first order at two time steps, `error` m off the discrete
    /// answer at the second of them.
    fn report(error: f64, failed: u64) -> Report {
        let trial = |error: f64, time_step: f64| Trial {
            time_step,
            quantities: vec![Quantity {
                name: "way".to_owned(),
                unit: "m".to_owned(),
                measured: 2.0 + time_step + error,
                discrete: 2.0 + time_step,
                exact: 2.0,
                slack: 1e-5,
                fault: (error.is_nan() || error.abs() > 1.1e-5)
                    .then(|| "error, allowed".to_owned()),
                order: "1.00".to_owned(),
                first_order: true,
            }],
            steps: 5,
            failed,
            fallback: 0,
            worst_residual: 1e-12,
        };
        let trials = vec![trial(0.0, 0.01), trial(error, 0.005)];
        let series = vec![Series { solver: Solver::Native, trials, curve: Curve::default() }];
        let words = |text: &str| text.to_owned();
        let (name, about, inputs) = (words("free-fall"), words("It falls."), words("mass 2 kg"));
        let experiments = vec![Experiment { name, about, inputs, series }];
        Report { program: words("tumble"), given: String::new(), experiments }
    }

    #[test]
    fn a_quantity_that_is_off_at_one_step_is_off_and_named() {
        let good = report(1e-5, 0);
        assert!(matches!(outcome(&good), Outcome::Done));
        assert_eq!(table::verdict(&good), "1 of 1 quantities hold\n");

        let off = report(6e-5, 0);
        assert!(matches!(outcome(&off), Outcome::Mismatch));
        assert_eq!(
            table::verdict(&off),
            "off: free-fall, way, native at h = 0.005 s: error, allowed\n\
             0 of 1 quantities hold\n"
        );
        assert!(table::describe(&off).contains("OFF"));
        // No number at all is no answer.
        assert!(matches!(outcome(&report(f64::NAN, 0)), Outcome::Mismatch));
    }

    #[test]
    fn steps_that_did_not_converge_come_before_the_quantities() {
        assert!(matches!(outcome(&report(1e-5, 1)), Outcome::Unconverged));
        assert!(matches!(outcome(&report(1.0, 1)), Outcome::Unconverged));
    }
}
