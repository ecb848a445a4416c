//! Tables of a validation on the terminal.

use super::experiment::inputs_in_words;
use std::fmt::Write as _;
use tumble_validation::{ErrorSeries, Experiment, TestProblem, ValidationReport};
use tumble_view::page::{brief, figure};

const HEADS: [&str; 11] = [
    "quantity", "unit", "solver", "h, s", "exact", "discrete", "measured", "error", "allowed",
    "order", "verdict",
];
/// Left-aligned columns of words; numbers are right-aligned.
const WORDS: [usize; 4] = [0, 1, 2, 10];

/// Name, description, inputs and default time step of each problem.
pub fn list(problems: &[&TestProblem]) -> String {
    let mut text = String::new();
    for problem in problems {
        let (inputs, TestProblem { name, about, .. }) = (problem.inputs(), problem);
        let (words, step) = (inputs_in_words(problem, &inputs), inputs.time_step);
        let _ = writeln!(text, "{name}\n  {about}\n  inputs: {words}, dt {step} s");
    }
    text
}

/// Tables of all problems.
pub fn describe(report: &ValidationReport) -> String {
    let mut text = String::new();
    for experiment in &report.experiments {
        let _ = writeln!(text, "{}: {}", experiment.problem.name, experiment.inputs);
        align(&mut text, &rows(experiment));
        for series in &experiment.series {
            counts(&mut text, series);
        }
        text.push('\n');
    }
    text
}

/// One row per quantity and solver, at the solver's largest time step.
fn rows(experiment: &Experiment) -> Vec<[String; 11]> {
    let mut rows = vec![HEADS.map(str::to_owned)];
    for i in 0..experiment.series[0].count() {
        for (place, series) in experiment.series.iter().enumerate() {
            let trial = &series.trials[0];
            let quantity = series.quantity(i, 0);
            let once = |word: &str| if place == 0 { word.to_owned() } else { String::new() };
            rows.push([
                once(quantity.name),
                once(quantity.unit),
                series.solver.name().to_owned(),
                trial.time_step.to_string(),
                figure(quantity.exact),
                figure(quantity.discrete),
                figure(quantity.measured),
                brief(quantity.error()),
                brief(quantity.tolerance),
                series.order(i, 1),
                if series.holds(i) { "holds" } else { "OFF" }.to_owned(),
            ]);
        }
    }
    rows
}

fn align(text: &mut String, rows: &[[String; 11]]) {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max();
    let widths: [usize; 11] = std::array::from_fn(|column| width(column).unwrap_or(0));
    for row in rows {
        let mut line = String::from(" ");
        for (column, cell) in row.iter().enumerate() {
            let width = widths[column];
            let _ = if WORDS.contains(&column) {
                write!(line, " {cell:<width$}")
            } else {
                write!(line, " {cell:>width$}")
            };
            line.push(' ');
        }
        text.push_str(line.trim_end());
        text.push('\n');
    }
}

/// Step statistics of a solver.
fn counts(text: &mut String, series: &ErrorSeries) {
    let steps: Vec<_> = series.trials.iter().map(|trial| trial.time_step.to_string()).collect();
    let _ = writeln!(
        text,
        "  {}: {} steps at h = {} s, {} not converged, {} fallbacks, largest residual {} m/s",
        series.solver.name(),
        series.sum(|counts| counts.steps),
        steps.join(", "),
        series.sum(|counts| counts.failed),
        series.sum(|counts| counts.fallback),
        brief(series.worst_residual()),
    );
}

/// Problems left out with Ipopt, one line each with the reason.
pub fn left_out(problems: &[(&str, String)]) -> String {
    let line = |(name, why): &(&str, String)| format!("left out with Ipopt: {name}: {why}\n");
    problems.iter().map(line).collect()
}

/// Inaccurate quantities, one line each, and the number of accurate ones.
pub fn verdict(report: &ValidationReport) -> String {
    let mut text = String::new();
    for experiment in &report.experiments {
        for series in &experiment.series {
            for (k, trial) in series.trials.iter().enumerate() {
                for i in 0..series.count() {
                    let Some(fault) = series.fault(i, k) else { continue };
                    let _ = writeln!(
                        text,
                        "off: {}, {}, {} at h = {} s: {fault}",
                        experiment.problem.name,
                        series.quantity(i, k).name,
                        series.solver.name(),
                        trial.time_step,
                    );
                }
            }
        }
    }
    let (holding, count) = report.holding();
    let _ = writeln!(text, "{holding} of {count} quantities hold");
    text
}
