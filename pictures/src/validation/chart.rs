//! The charts of the page: a curve over time, and errors over the time step.

use super::number::{brief, html};
use super::report::{Curve, Experiment, Series, Solver};
use crate::chart::{Chart, dot_key, line_key};
use crate::markup::escape;
use crate::plot::panel::{LARGEST, shown};
use crate::plot::scale::{Axis, Kind};

/// Marks along Ipopt's curve.
const MARKS: usize = 24;
/// An axis whose ends are nearer than this (SI units, or relative to the values) magnifies
/// what no eye would see, and the caption says so.
const MAGNIFIED: f64 = 1e-6;

/// The class and the radius of the mark of `solver`: a disc within Ipopt's ring where they
/// coincide.
fn mark(solver: Solver) -> (&'static str, f64) {
    match solver {
        Solver::Native => ("native", 1.8),
        Solver::Ipopt => ("ipopt", 4.0),
    }
}

/// The mark of `solver` at each point.
fn marks(chart: &mut Chart, solver: Solver, points: impl Iterator<Item = (f64, f64)>) {
    let (class, radius) = mark(solver);
    points.for_each(|point| chart.dot(class, radius, point));
}

/// The entries of the solvers; `lines` where their curves are drawn.
fn solver_keys(experiment: &Experiment, lines: bool) -> String {
    let entry = |series: &Series| {
        let (class, radius) = mark(series.solver);
        let mut name = series.solver.name().to_owned();
        if lines {
            name = format!("{name}, h = {} s", series.trials[0].time_step);
        }
        match series.solver {
            Solver::Native if lines => line_key(class, &name),
            _ => dot_key(class, radius, &name),
        }
    };
    experiment.series.iter().map(entry).collect()
}

/// The curve over time: the closed form as a broad line, the native solver as a thin one on
/// it, Ipopt as rings, so that each is seen where they coincide.
pub fn curves(experiment: &Experiment) -> String {
    let drawable = |values: &[f64]| values.iter().copied().map(shown).collect();
    let curve = |series: &Series| Curve {
        measured: drawable(&series.curve.measured),
        exact: drawable(&series.curve.exact),
        ..series.curve.clone()
    };
    let curves: Vec<_> = experiment.series.iter().map(curve).collect();
    let first = &curves[0];
    let end = curves.iter().filter_map(|curve| curve.times.last()).fold(0.0, |a: f64, b| a.max(*b));
    let values = curves.iter().flat_map(|curve| curve.measured.iter().chain(&curve.exact).copied());
    let name = format!("{} ({})", first.name, first.unit);
    let mut chart = Chart::over_time(&name, end, Kind::Linear, values);
    let mut keys = String::new();
    if first.exact.iter().any(|value| !value.is_nan()) {
        chart.curve("exact", &first.times, &first.exact);
        keys += &line_key("exact", "closed form");
    }
    for (series, curve) in experiment.series.iter().zip(&curves) {
        match series.solver {
            Solver::Native => chart.curve("native", &curve.times, &curve.measured),
            Solver::Ipopt => {
                let stride = curve.times.len().div_ceil(MARKS).max(1);
                let points = curve.times.iter().copied().zip(curve.measured.iter().copied());
                let points = points.filter(|(_, value)| !value.is_nan()).step_by(stride);
                marks(&mut chart, series.solver, points);
            }
        }
    }
    keys += &solver_keys(experiment, true);
    keys += &magnification(chart.heights(), &first.unit);
    chart.figure(&format!("{name} over time"), &keys)
}

/// What is to be said of an axis that shows next to nothing as if it were much.
fn magnification((low, high): (f64, f64), unit: &str) -> String {
    let span = high - low;
    if span >= MAGNIFIED * low.abs().max(high.abs()).max(1.0) {
        return String::new();
    }
    let span = html(&brief(span));
    format!("<b>Magnified: the whole vertical axis is {span} {}.</b>", escape(unit))
}

/// How far one quantity is from the exact answer over the time step, both on log axes, with a
/// line of slope 1; nothing where none is declared to be of first order.
pub fn errors(experiment: &Experiment) -> String {
    let Some(i) = first_order_quantity(&experiment.series[0]) else {
        return String::new();
    };
    let points = |series: &Series| -> Vec<(f64, f64)> {
        let trials = series.trials.iter();
        let points = trials.map(|trial| {
            let quantity = &trial.quantities[i];
            (trial.time_step, (quantity.measured - quantity.exact).abs())
        });
        points.filter(|(_, error)| (f64::MIN_POSITIVE..LARGEST).contains(error)).collect()
    };
    let all: Vec<_> = experiment.series.iter().flat_map(&points).collect();
    let Some(&(h, error)) = all.first() else {
        return String::new();
    };
    let least = all.iter().fold(f64::INFINITY, |least, (h, _)| least.min(*h));
    let most = all.iter().fold(0.0, |most: f64, (h, _)| most.max(*h));
    // Longer than the points are apart, so that it shows where they lie on it.
    let guide = [0.6 * least, most / 0.6].map(|end| (end, error * end / h));
    let steps = all.iter().chain(&guide).map(|point| point.0);
    let errors = all.iter().chain(&guide).map(|point| point.1);
    let quantity = &experiment.series[0].trials[0].quantities[i];
    let name = format!("|measured − exact| of {} ({})", quantity.name, quantity.unit);
    let mut chart = Chart::new(
        Axis::new(Kind::Log, steps, 4),
        Axis::new(Kind::Log, errors, 6),
        ("time step h (s)", &name),
    );
    chart.line("guide", guide);
    for series in &experiment.series {
        let points = points(series);
        if series.solver == Solver::Native {
            chart.line("native", points.iter().copied());
        }
        marks(&mut chart, series.solver, points.into_iter());
    }
    let keys = line_key("guide", "slope 1") + &solver_keys(experiment, false);
    chart.figure(&format!("{name} over the time step, log axes"), &keys)
}

/// The first quantity that is declared to be of first order.
fn first_order_quantity(series: &Series) -> Option<usize> {
    series.trials[0].quantities.iter().position(|quantity| quantity.first_order)
}
