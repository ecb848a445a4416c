//! The HTML page of a report: a summary, and tables and charts for each problem.

use crate::report::{ErrorSeries, Experiment, ReportedSolver, ValidationReport};
use crate::{Convergence, TestCurve};
use std::fmt::Write as _;
use tumble_view::page::{
    Chart, LARGEST, brief, dot_key, drawable, escape, figure, html, line_key, number, opening,
    table,
};

/// The explanation of the tables.
const READING: &str = "Each problem is simulated with a time step h and with its halves. The \
    exact answer is that of Newton's and Coulomb's laws in continuous time, the discrete one \
    what the step's own equations give for the motion, both solved by hand. A quantity holds if \
    at every h its error, measured − discrete, is within what rounding and the residuals of the \
    steps allow (100 % of it is the bound itself, which a step may reach), and if measured − exact \
    shrinks as declared. The order in h is p where it goes like h<sup>p</sup>, from the row above and this one; “exact” stands where the step is exact, \
    a bound where the difference depends on how the steps happen to fall, “hidden” where the \
    residuals hide the order, and “coarse” where the steps are too coarse for one.";

/// `report` as a self-contained HTML page. Equal reports produce equal bytes.
#[must_use]
pub fn page(report: &ValidationReport) -> String {
    let (holding, count) = report.holding();
    let inputs = match report.given.as_str() {
        "" => "the usual ones of each problem".to_owned(),
        given => format!("the usual ones of each problem, but {}", escape(given)),
    };
    let class = if holding == count { "good" } else { "bad" };
    let mut page = opening("tumble, checked against closed forms", "");
    let _ = write!(
        page,
        "<p class=\"faint\">{}. Inputs: {inputs}.</p>\n\
         <p><strong class=\"{class}\">{holding} of {count} quantities hold</strong>, each counted \
         once for every solver.</p>\n<p>{READING}</p>\n{}",
        escape(&report.program),
        summary(report),
    );
    for experiment in &report.experiments {
        let _ = write!(
            page,
            "<section id=\"{name}\">\n<h2>{name}</h2>\n<p>{}</p>\n<p class=\"faint\">Inputs: {}.</p>\n\
             {}<div class=\"charts\">\n{}{}</div>\n</section>\n",
            escape(experiment.problem.about),
            escape(&experiment.inputs),
            quantities(experiment),
            curves(experiment),
            errors(experiment),
            name = experiment.problem.name,
        );
    }
    page.push_str("</body>\n</html>\n");
    page
}

fn verdict(holds: bool, good: &str, bad: &str) -> String {
    let (class, text) = if holds { ("good", good) } else { ("bad", bad) };
    format!("<td class=\"verdict {class}\">{text}</td>")
}

/// A count that should be 0.
fn fault(name: &str, count: u64) -> String {
    let class = if count == 0 { "n" } else { "n bad" };
    format!("<td class=\"{class}\" data-name=\"{name}\">{count}</td>")
}

/// The columns of a table: words, and then numbers.
fn columns<'a>(words: &[&'a str], numbers: &[&'a str]) -> Vec<(&'a str, bool)> {
    let words = words.iter().map(|name| (*name, false));
    words.chain(numbers.iter().map(|name| (*name, true))).collect()
}

/// Rows of a table with one head for all.
fn headed(head: &str, rows: &[String]) -> String {
    let span = rows.len();
    let head = format!("<th scope=\"rowgroup\" rowspan=\"{span}\">{head}</th>");
    let row = |(k, row): (usize, &String)| match k {
        0 => format!("<tr class=\"first\">{head}{row}</tr>\n"),
        _ => format!("<tr>{row}</tr>\n"),
    };
    rows.iter().enumerate().map(row).collect()
}

/// One row for each problem and solver.
fn summary(report: &ValidationReport) -> String {
    let columns = columns(
        &["problem", "solver", "quantities that hold"],
        &[
            "largest error, of the allowed",
            "steps",
            "not converged",
            "fallbacks",
            "largest residual, m/s",
        ],
    );
    let row = |series: &ErrorSeries| {
        let (holding, count) = series.holding();
        let hold = format!("{holding} of {count}");
        [
            format!("<td>{}</td>", series.solver.name()),
            verdict(holding == count, &hold, &hold),
            number("largest error", &share(series)),
            number("steps", &series.sum(|counts| counts.steps).to_string()),
            fault("not converged", series.sum(|counts| counts.failed)),
            number("fallbacks", &series.sum(|counts| counts.fallback).to_string()),
            number("largest residual, m/s", &brief(series.worst_residual())),
        ]
        .concat()
    };
    let rows = report.experiments.iter().map(|experiment| {
        let name = experiment.problem.name;
        let rows: Vec<_> = experiment.series.iter().map(row).collect();
        headed(&format!("<a href=\"#{name}\">{name}</a>"), &rows)
    });
    table(&columns, &rows.collect::<String>())
}

/// The largest |error| in percent of the tolerance; a dash if one is not a number. A share below 1 is
/// rounded down, so that an error within the bound never reads as at it.
fn share(series: &ErrorSeries) -> String {
    let quantities = series.trials.iter().flat_map(|trial| &trial.findings.quantities);
    let shares = quantities
        .filter(|quantity| quantity.error() != 0.0)
        .map(|quantity| (quantity.error() / quantity.tolerance).abs());
    match shares.max_by(f64::total_cmp) {
        None => "0 %, within".to_owned(),
        Some(share) if share < 0.01 => "below 1 %, within".to_owned(),
        Some(share) if share <= 1.0 => format!("{} %, within", (100.0 * share).floor()),
        Some(share) if share < 100.0 => format!("{} %, beyond", (100.0 * share).ceil()),
        Some(share) if share.is_finite() => format!("{share:.0} times, beyond"),
        Some(_) => "—".to_owned(),
    }
}

/// One row for each quantity, solver and time step.
fn quantities(experiment: &Experiment) -> String {
    let mut columns = columns(
        &["quantity", "solver"],
        &["h, s", "exact", "discrete", "measured", "error", "allowed", "order in h"],
    );
    columns.push(("verdict", false));
    let row = |series: &ErrorSeries, i: usize, k: usize| {
        let (quantity, span) = (series.quantity(i, k), series.trials.len());
        let solver = format!("<td rowspan=\"{span}\">{}</td>", series.solver.name());
        [
            if k == 0 { solver } else { String::new() },
            number("h, s", &series.trials[k].time_step.to_string()),
            number("exact", &figure(quantity.exact)),
            number("discrete", &figure(quantity.discrete)),
            number("measured", &figure(quantity.measured)),
            number("error", &brief(quantity.error())),
            number("allowed", &brief(quantity.tolerance)),
            number("order", &series.order(i, k)),
            verdict(series.fault(i, k).is_none(), "holds", "off"),
        ]
        .concat()
    };
    let rows = (0..experiment.series[0].count()).map(|i| {
        let named = experiment.series[0].quantity(i, 0);
        let unit = if named.unit == "1" { String::new() } else { format!(", {}", named.unit) };
        let of =
            |series: &'_ ErrorSeries| (0..series.trials.len()).map(|k| row(series, i, k)).collect();
        let rows: Vec<Vec<String>> = experiment.series.iter().map(of).collect();
        headed(&escape(&format!("{}{unit}", named.name)), &rows.concat())
    });
    table(&columns, &rows.collect::<String>())
}

/// Marks along Ipopt's curve.
const MARKS: usize = 24;
/// The caption says that an axis is magnified if its ends are nearer than this (SI units, or relative
/// to the values).
const MAGNIFIED: f64 = 1e-6;

/// Class and radius of the mark of `solver`: a disc for the native solver within Ipopt's ring.
fn mark(solver: ReportedSolver) -> (&'static str, f64) {
    match solver {
        ReportedSolver::Native => ("native", 1.8),
        ReportedSolver::Ipopt => ("ipopt", 4.0),
    }
}

fn marks(chart: &mut Chart, solver: ReportedSolver, points: impl Iterator<Item = (f64, f64)>) {
    let (class, radius) = mark(solver);
    points.for_each(|(x, y)| chart.dot(class, radius, x, y));
}

/// The legend of the solvers; `lines` for curves over time.
fn solver_keys(experiment: &Experiment, lines: bool) -> String {
    let entry = |series: &ErrorSeries| {
        let (class, radius) = mark(series.solver);
        let mut name = series.solver.name().to_owned();
        if lines {
            name = format!("{name}, h = {} s", series.trials[0].time_step);
        }
        match series.solver {
            ReportedSolver::Native if lines => line_key(class, &name),
            _ => dot_key(class, radius, &name),
        }
    };
    experiment.series.iter().map(entry).collect()
}

/// The curve over time: the closed form as a broad line, the native solver as a thin one on it, Ipopt
/// as rings.
fn curves(experiment: &Experiment) -> String {
    let values = |values: &[f64]| values.iter().copied().map(drawable).collect();
    let curve = |series: &ErrorSeries| {
        let curve = &series.trials[0].findings.curve;
        TestCurve {
            measured: values(&curve.measured),
            exact: values(&curve.exact),
            ..curve.clone()
        }
    };
    let curves: Vec<_> = experiment.series.iter().map(curve).collect();
    let first = &curves[0];
    let end = curves.iter().filter_map(|curve| curve.times.last()).fold(0.0, |a: f64, b| a.max(*b));
    let values = curves.iter().flat_map(|curve| curve.measured.iter().chain(&curve.exact).copied());
    let name = format!("{} ({})", first.name, first.unit);
    let mut chart = Chart::linear_over_time(&name, end, values);
    let mut keys = String::new();
    if first.exact.iter().any(|value| !value.is_nan()) {
        chart.curve("exact", &first.times, &first.exact);
        keys += &line_key("exact", "closed form");
    }
    for (series, curve) in experiment.series.iter().zip(&curves) {
        match series.solver {
            ReportedSolver::Native => chart.curve("native", &curve.times, &curve.measured),
            ReportedSolver::Ipopt => {
                let stride = curve.times.len().div_ceil(MARKS).max(1);
                let points = curve.times.iter().copied().zip(curve.measured.iter().copied());
                let points = points.filter(|(_, value)| !value.is_nan()).step_by(stride);
                marks(&mut chart, series.solver, points);
            }
        }
    }
    keys += &solver_keys(experiment, true);
    let [low, high] = chart.heights();
    keys += &magnification(low, high, first.unit);
    chart.figure(&format!("{name} over time"), &keys)
}

/// The remark on a magnified axis.
fn magnification(low: f64, high: f64, unit: &str) -> String {
    let span = high - low;
    if span >= MAGNIFIED * low.abs().max(high.abs()).max(1.0) {
        return String::new();
    }
    let span = html(&brief(span));
    format!("<b>Magnified: the whole vertical axis is {span} {}.</b>", escape(unit))
}

/// |measured − exact| of the first quantity of first order over the time step, with a line of slope 1.
fn errors(experiment: &Experiment) -> String {
    let quantities = &experiment.series[0].trials[0].findings.quantities;
    let first_order = Convergence::Order(1);
    let i = quantities.iter().position(|quantity| quantity.convergence == first_order);
    let Some(i) = i else { return String::new() };
    let points = |series: &ErrorSeries| -> Vec<(f64, f64)> {
        let points = series.trials.iter().map(|trial| {
            let quantity = &trial.findings.quantities[i];
            (trial.time_step, (quantity.measured - quantity.exact).abs())
        });
        points.filter(|(_, error)| (f64::MIN_POSITIVE..LARGEST).contains(error)).collect()
    };
    let all: Vec<_> = experiment.series.iter().flat_map(&points).collect();
    let Some(&(h, error)) = all.first() else { return String::new() };
    let least = all.iter().fold(f64::INFINITY, |least, (h, _)| least.min(*h));
    let most = all.iter().fold(0.0, |most: f64, (h, _)| most.max(*h));
    // Longer than the points are apart, so that it shows where they lie on it.
    let guide = [0.6 * least, most / 0.6].map(|end| (end, error * end / h));
    let name = format!("|measured − exact| of {} ({})", quantities[i].name, quantities[i].unit);
    let shown = all.iter().chain(&guide).copied();
    let mut chart = Chart::logarithmic(shown, "time step h (s)", &name);
    chart.line("guide", guide);
    for series in &experiment.series {
        let points = points(series);
        if series.solver == ReportedSolver::Native {
            chart.line("native", points.iter().copied());
        }
        marks(&mut chart, series.solver, points.into_iter());
    }
    let keys = line_key("guide", "slope 1") + &solver_keys(experiment, false);
    chart.figure(&format!("{name} over the time step, log axes"), &keys)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quantity::{equal, order};
    use crate::{ProblemFindings, StepCounts, Trial, find};

    /// A report of one quantity at two time steps, with the error `error` (m) at the second.
    fn report(error: f64) -> ValidationReport {
        let trial = |error: f64, h: f64| {
            let curve = TestCurve {
                name: "way",
                unit: "m",
                times: vec![0.0, 0.1, 0.2],
                measured: vec![0.0, f64::INFINITY, 1.0],
                exact: vec![f64::NAN; 3],
            };
            let quantity = equal(("way < & >", "m"), 2.0 + h + error, 2.0, 1e-5);
            let quantities = vec![quantity.stepped(2.0 + h, order(1, 100.0))];
            let counts = StepCounts { steps: 5, failed: 0, fallback: 0, worst_residual: 1e-12 };
            Trial { time_step: h, findings: ProblemFindings { quantities, curve }, counts }
        };
        let trials = vec![trial(0.0, 0.01), trial(error, 0.005)];
        let series = vec![ErrorSeries { solver: ReportedSolver::Native, trials }];
        let (problem, inputs) = (*find("free-fall").unwrap(), "mass 2 kg".to_owned());
        let experiments = vec![Experiment { problem, inputs, series }];
        let (program, given) = ("tumble".to_owned(), "--speed <b>".to_owned());
        ValidationReport { program, given, experiments }
    }

    #[test]
    fn an_error_beyond_the_tolerance_has_one_verdict() {
        assert!(!page(&report(0.9e-5)).contains(">off<"));
        assert_eq!(page(&report(6e-5)).matches(">off<").count(), 1);
    }

    #[test]
    fn shares_of_the_tolerance_are_rounded_away_from_the_bound() {
        for (error, expected) in [
            (0.0, "0 %, within"),
            (1e-8, "below 1 %, within"),
            (0.315e-5, "31 %, within"),
            (0.9996e-5, "99 %, within"),
            (1.0001e-5, "101 %, beyond"),
            (6e-3, "600 times, beyond"),
        ] {
            let page = page(&report(error));
            assert!(page.contains(&format!("largest error\">{expected}<")), "{error}");
        }
    }

    #[test]
    fn a_curve_that_magnifies_rounding_has_a_remark() {
        let mut report = report(0.0);
        assert!(!page(&report).contains("Magnified"));
        let findings = &mut report.experiments[0].series[0].trials[0].findings;
        findings.curve.measured = vec![0.0, 1.6e-9, 1.6e-9];
        assert!(page(&report).contains("the whole vertical axis is 1.8·10<sup>−9</sup> m"));
    }

    #[test]
    fn a_value_that_is_not_a_number_leaves_a_gap_and_words_are_escaped() {
        let page = page(&report(f64::NAN));
        for wrong in ["NaN", "inf\"", "way < &", "<b>"] {
            assert!(!page.contains(wrong), "{wrong}");
        }
        assert!(page.contains("way &lt; &amp; &gt;") && page.contains("--speed &lt;b&gt;"));
    }
}
