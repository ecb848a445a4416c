//! What was found out, as the page and the tables have it.

use crate::cli::shown;
use tumble::validation::{self, Convergence, Findings, Inputs, Laboratory, Problem};
use tumble_pictures::validation::number::brief;
use tumble_pictures::validation::{Curve, Experiment, Quantity, Series, Solver, Trial};

/// What is told of a problem with `inputs`, and what came of it.
pub fn experiment(problem: &dyn Problem, inputs: &Inputs, series: Vec<Series>) -> Experiment {
    let word = |&(input, value): &(validation::Input, f64)| {
        let value = shown::number(value);
        format!("{} {value} {}", input.name(), problem.unit(input)).trim_end().to_owned()
    };
    let bodies = problem.bodies();
    let several = (bodies > 1).then(|| format!("{bodies} bodies"));
    let words: Vec<_> = inputs.values().iter().map(word).chain(several).collect();
    Experiment {
        name: problem.name().to_owned(),
        about: problem.about().to_owned(),
        inputs: words.join(", "),
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
            worst_residual: laboratory.worst_residual,
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
        discrete: quantity.discrete,
        slack: quantity.slack,
        fault: fault(quantity, coarser),
        order: order(quantity, coarser),
        first_order: quantity.convergence == Convergence::Order(1),
    }
}

/// What is wrong with a quantity: it is off the discrete answer, or does not come to the exact
/// one as it is declared to.
fn fault(
    quantity: &validation::Quantity,
    coarser: Option<&validation::Quantity>,
) -> Option<String> {
    if !quantity.holds() {
        let (error, slack, unit) = (brief(quantity.error()), brief(quantity.slack), quantity.unit);
        return Some(format!("error {error} {unit}, allowed {slack} {unit}"));
    }
    let coarser = coarser.filter(|coarser| !coarser.converges(quantity))?;
    let apart = brief(coarser.discrete - coarser.exact);
    Some(match coarser.convergence {
        Convergence::Order(p) => format!("order {}, declared {p}", order(quantity, Some(coarser))),
        Convergence::Within(bound) => {
            format!("discrete − exact {apart} before, declared ≤{}", brief(bound))
        }
        _ => format!("discrete − exact {apart} before, declared exact"),
    })
}

/// What a quantity shows of its order of convergence beside the same one at twice the time step:
/// the order, or why there is none.
fn order(quantity: &validation::Quantity, coarser: Option<&validation::Quantity>) -> String {
    match (coarser.unwrap_or(quantity).convergence, coarser) {
        (Convergence::Order(_), None) => "—".to_owned(),
        (Convergence::Order(_), Some(coarser)) => {
            coarser.order(quantity).map_or("hidden".to_owned(), |order| format!("{order:.2}"))
        }
        (Convergence::Exact, _) => "exact".to_owned(),
        (Convergence::Within(bound), _) => format!("≤{}", brief(bound)),
        (Convergence::Unresolved, _) => "coarse".to_owned(),
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
