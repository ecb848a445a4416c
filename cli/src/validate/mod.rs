//! `tumble validate`: compares simulations with closed-form solutions.

mod experiment;
mod table;

use super::args::ValidateArgs;
use super::directory::OutputDirectory;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, progress_bar, say};
use super::signals::raise_on_signals;
use experiment::{ExperimentPlan, ExperimentStop};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_model::shown;
use tumble_scene::solver_choice::IPOPT_VERSION;
use tumble_validation::{Experiment, ReportedSolver, ValidationReport, page};

/// Runs `tumble validate`.
pub fn run(args: &ValidateArgs) -> Result<Outcome, Failure> {
    if args.list {
        say(&table::list(&experiment::chosen(args)?))?;
        return Ok(Outcome::Done);
    }
    let plans = experiment::plan(args)?;
    let interrupt = Arc::new(AtomicBool::new(false));
    raise_on_signals(&interrupt)?;
    let directory = OutputDirectory::for_pictures(&args.out)?;
    let file = PendingFile::create(&directory, "validation.html")?;
    let report = match examine(args, plans, &interrupt) {
        Ok(report) => report,
        Err(ExperimentStop::Interrupted) => return Ok(Outcome::Interrupted),
        Err(ExperimentStop::Failed(failure)) => return Err(failure),
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

/// Runs all problems, first with the faster solver.
fn examine(
    args: &ValidateArgs,
    plans: Vec<ExperimentPlan>,
    interrupt: &Arc<AtomicBool>,
) -> Result<ValidationReport, ExperimentStop> {
    let solvers = experiment::each(args.solver);
    let takes =
        |solver: &&ReportedSolver, plan: &ExperimentPlan| experiment::takes(**solver, plan.problem);
    let runs = |plan: &ExperimentPlan| -> usize {
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
    let experiments =
        plans.into_iter().zip(series).map(|(ExperimentPlan { problem, inputs, .. }, series)| {
            let inputs = experiment::inputs_in_words(problem, &inputs);
            Experiment { problem: *problem, inputs, series }
        });
    Ok(ValidationReport {
        program: program(),
        given: experiment::flags(&experiment::given(args), args.dt),
        experiments: experiments.collect(),
    })
}

/// Versions of tumble and Ipopt.
fn program() -> String {
    let ipopt = if IPOPT_VERSION.is_empty() { "not in this build" } else { IPOPT_VERSION };
    format!("tumble {}, Ipopt {ipopt}", env!("CARGO_PKG_VERSION"))
}

fn outcome(report: &ValidationReport) -> Outcome {
    let series = || report.experiments.iter().flat_map(|experiment| &experiment.series);
    let (holding, count) = report.holding();
    if series().any(|series| series.sum(|counts| counts.failed) > 0) {
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
    use tumble_validation::{
        Convergence, ErrorSeries, ProblemFindings, QuantityClaim, StepCounts, TestCurve,
        TestQuantity, Trial, find,
    };

    /// Report with one quantity of first order at two time steps. At the second one it differs from
    /// the discrete solution by `error` m.
    fn report(error: f64, failed: u64) -> ValidationReport {
        let trial = |error: f64, time_step: f64| Trial {
            time_step,
            findings: ProblemFindings {
                quantities: vec![TestQuantity {
                    name: "way",
                    unit: "m",
                    measured: 2.0 + time_step + error,
                    discrete: 2.0 + time_step,
                    exact: 2.0,
                    tolerance: 1e-5,
                    claim: QuantityClaim::Equal,
                    convergence: Convergence::Order(1),
                }],
                curve: TestCurve::default(),
            },
            counts: StepCounts { steps: 5, failed, fallback: 0, worst_residual: 1e-12 },
        };
        let trials = vec![trial(0.0, 0.01), trial(error, 0.005)];
        let series = vec![ErrorSeries { solver: ReportedSolver::Native, trials }];
        let (problem, inputs) = (*find("free-fall").unwrap(), "mass 2 kg".to_owned());
        let experiments = vec![Experiment { problem, inputs, series }];
        ValidationReport { program: "tumble".to_owned(), given: String::new(), experiments }
    }

    #[test]
    fn a_quantity_that_is_off_at_one_step_is_off_and_named() {
        let good = report(0.9e-5, 0);
        assert!(matches!(outcome(&good), Outcome::Done));
        assert_eq!(table::verdict(&good), "1 of 1 quantities hold\n");

        let off = report(6e-5, 0);
        assert!(matches!(outcome(&off), Outcome::Mismatch));
        assert_eq!(
            table::verdict(&off),
            "off: free-fall, way, native at h = 0.005 s: error 6.0e-5 m, allowed 1.0e-5 m\n\
             0 of 1 quantities hold\n"
        );
        assert!(table::describe(&off).contains("OFF"));
        // NaN is an inaccurate result.
        assert!(matches!(outcome(&report(f64::NAN, 0)), Outcome::Mismatch));
    }

    #[test]
    fn steps_that_did_not_converge_come_before_the_quantities() {
        assert!(matches!(outcome(&report(0.9e-5, 1)), Outcome::Unconverged));
        assert!(matches!(outcome(&report(1.0, 1)), Outcome::Unconverged));
    }
}
