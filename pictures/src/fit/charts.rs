//! The charts of the page.

use super::report::{Motion, Report, Toss};
use crate::chart::{Chart, dot_key, line_key};
use crate::plot::scale::{Axis, Kind};

/// The classes of the style in which curves are drawn.
const RECORDED: &str = "exact";
const SIMULATED: &str = "native";
const BEFORE: &str = "guide";

/// Of a toss in the chart of both errors.
const DOT: f64 = 2.6;

/// Curves over time on one pair of axes.
fn over_time(name: &str, times: &[f64], curves: &[(&str, Vec<f64>)], keys: &str) -> String {
    let end = times.last().copied().unwrap_or(1.0);
    let values = curves.iter().flat_map(|(_, values)| values.iter().copied());
    let mut chart = Chart::over_time(name, end, Kind::FromZero, values);
    for (class, values) in curves {
        chart.curve(class, times, values);
    }
    chart.figure(&format!("{name} over time"), keys)
}

/// The path seen from above, as long in x as in y.
fn from_above(motion: &Motion, keys: &str) -> String {
    let all = || motion.recorded.iter().chain(&motion.simulated).filter(|p| !p[0].is_nan());
    let range = |axis: usize| {
        let range = (f64::INFINITY, f64::NEG_INFINITY);
        all().fold(range, |(low, high), p| (low.min(p[axis]), high.max(p[axis])))
    };
    let (x, y) = (range(0), range(1));
    let half = 0.53 * (x.1 - x.0).max(y.1 - y.0).max(1e-3);
    let axis = |(low, high): (f64, f64)| {
        let middle = 0.5 * (low + high);
        Axis::linear(middle - half, middle + half, 0.0, 5)
    };
    let mut chart = Chart::new(axis(x), axis(y), ("x (m)", "y (m), from above"));
    for (class, path) in [(RECORDED, &motion.recorded), (SIMULATED, &motion.simulated)] {
        // What is no number is at the ends of a path.
        chart.line(class, path.iter().filter(|p| !p[0].is_nan()).map(|p| (p[0], p[1])));
    }
    chart.figure("the path from above", keys)
}

/// The charts of one toss: height, path, distance and angle; `length` in m.
pub fn motion(motion: &Motion) -> String {
    let both = line_key(RECORDED, "recorded") + &line_key(SIMULATED, "simulated");
    let height = |path: &[[f64; 3]]| path.iter().map(|p| p[2]).collect::<Vec<_>>();
    let heights = [(RECORDED, height(&motion.recorded)), (SIMULATED, height(&motion.simulated))];
    let distance = motion
        .recorded
        .iter()
        .zip(&motion.simulated)
        .map(|(a, b)| 1000.0 * (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt());
    let distance = [(SIMULATED, distance.collect::<Vec<_>>())];
    let angle = [(SIMULATED, motion.angle.clone())];
    let times = &motion.times;
    [
        over_time("height of the centre (m)", times, &heights, &both),
        from_above(motion, &both),
        over_time("distance of the centres (mm)", times, &distance, ""),
        over_time("angle between the attitudes (°)", times, &angle, ""),
    ]
    .concat()
}

/// The share of tosses whose error is below a value.
fn shares(
    name: &str,
    tosses: &[Toss],
    error: impl Fn(&Toss) -> [f64; 2],
    searched: bool,
) -> String {
    let sorted = |which: usize| {
        let mut errors: Vec<f64> = tosses.iter().map(|toss| error(toss)[which]).collect();
        errors.sort_by(f64::total_cmp);
        errors
    };
    let (before, found) = (sorted(0), sorted(1));
    let most = before.iter().chain(&found).copied().fold(0.0, f64::max);
    let mut chart = Chart::new(
        Axis::linear(0.0, most, 0.0, 6),
        Axis::linear(0.0, 100.0, 0.0, 5),
        (name, "share of recordings below (%)"),
    );
    let curve = |errors: &[f64]| {
        let step = 100.0 / errors.len() as f64;
        let points = errors.iter().enumerate();
        points.map(|(k, error)| (*error, (k + 1) as f64 * step)).collect::<Vec<_>>()
    };
    let mut keys = line_key(SIMULATED, "found");
    if searched {
        chart.line(BEFORE, curve(&before));
        keys = line_key(BEFORE, "start") + &keys;
    }
    chart.line(SIMULATED, curve(&found));
    chart.figure(&format!("{name}: share of recordings below"), &keys)
}

/// Distributions of the errors, and both errors of each toss.
pub fn errors(report: &Report) -> String {
    let (tosses, searched) = (&report.tosses, !report.parameters.is_empty());
    let position = shares("mean distance (% of the length)", tosses, |t| t.position, searched);
    let rotation = shares("mean angle (°)", tosses, |t| t.rotation, searched);
    let most = |of: &dyn Fn(&Toss) -> f64| tosses.iter().map(of).fold(0.0, f64::max);
    let mut chart = Chart::new(
        Axis::linear(0.0, most(&|t| t.position[1]), 0.02, 6),
        Axis::linear(0.0, most(&|t| t.rotation[1]), 0.02, 6),
        ("mean distance (% of the length)", "mean angle (°)"),
    );
    for toss in tosses {
        let class = if toss.other_face { "ipopt" } else { "native" };
        chart.dot(class, DOT, (toss.position[1], toss.rotation[1]));
    }
    let [same, other] = match report.is_of_several {
        true => ["at most 45° apart at the end", "more"],
        false => ["the same face", "another face at the end"],
    };
    let keys = dot_key("native", DOT, same) + &dot_key("ipopt", DOT, other);
    position + &rotation + &chart.figure("both errors of every recording", &keys)
}

/// The least loss over the evaluations.
pub fn progress(losses: &[f64]) -> String {
    if losses.len() < 2 {
        return String::new();
    }
    let count = losses.len() as f64;
    let mut chart = Chart::new(
        Axis::linear(0.0, count, 0.0, 6),
        Axis::new(Kind::Linear, losses.iter().copied(), 6),
        ("evaluations with all substeps", "least loss so far"),
    );
    chart.line(SIMULATED, losses.iter().enumerate().map(|(k, loss)| (k as f64, *loss)));
    chart.figure("the least loss over the evaluations", "")
}
