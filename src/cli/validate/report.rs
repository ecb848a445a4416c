//! What was found out, as the page and the tables have it.

use tumble::validation::{self, Findings, Inputs, Laboratory, Problem};
use tumble_pictures::validation::{Curve, Experiment, Quantity, Series, Solver, Trial};

/// What is told of a problem with `inputs`, and what came of it.
pub fn experiment(problem: &dyn Problem, inputs: &Inputs, series: Vec<Series>) -> Experiment {
    let word = |&(input, value): &(validation::Input, f64)| {
        format!("{} {value} {}", input.name(), problem.unit(input)).trim_end().to_owned()
    };
    Experiment {
        name: problem.name().to_owned(),
        about: problem.about().to_owned(),
        inputs: inputs.values().iter().map(word).collect::<Vec<_>>().join(", "),
        series,
    }
}

/// A problem by one solver: its runs, the coarsest first, each with half the time step (s) of
/// the one before.
pub fn series(solver: Solver, runs: Vec<(f64, Findings, Laboratory<'_>)>) -> Series {
    let mut trials = Vec::new();
    let mut before: Option<&Findings> = None;
    for (time_step, findings, laboratory) in &runs {
        let coarser = |i: usize| before.and_then(|before| before.quantities.get(i));
        let quantities = findings.quantities.iter().enumerate();
        trials.push(Trial {
            time_step: *time_step,
            quantities: quantities
                .map(|(i, quantity)| self::quantity(quantity, coarser(i)))
                .collect(),
            steps: laboratory.steps,
            failed: laboratory.failed,
            fallback: laboratory.fallback,
            worst_certificate: laboratory.worst_certificate,
        });
        before = Some(findings);
    }
    let first = runs.into_iter().next();
    let curve = first.map_or(Curve::default(), |(_, findings, _)| curve(findings.curve));
    Series { solver, trials, curve }
}

/// A quantity, and the same with twice the time step.
fn quantity(quantity: &validation::Quantity, coarser: Option<&validation::Quantity>) -> Quantity {
    Quantity {
        name: quantity.name.to_owned(),
        unit: quantity.unit.to_owned(),
        measured: quantity.measured,
        exact: quantity.exact,
        discretisation: quantity.discretisation,
        slack: quantity.slack,
        holds: quantity.holds(),
        order: coarser.and_then(|coarser| coarser.order(quantity)),
    }
}

fn curve(curve: validation::Curve) -> Curve {
    Curve {
        name: curve.name.to_owned(),
        unit: curve.unit.to_owned(),
        times: curve.times,
        measured: curve.measured,
        exact: curve.exact,
    }
}
