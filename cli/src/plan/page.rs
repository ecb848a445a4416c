//! plan.html: targets, stages, cost history, contact modes, controls and paths of a plan.

use nalgebra::Vector3;
use std::fmt::Write as _;
use tumble_core::contact::ContactKey;
use tumble_plan::{ContactMode, Miss, Mode, Plan, PlanProblem, PlanStatus, StageReport};
use tumble_view::chart::{Chart, PlotAxis, ScaleKind, key, line_key};
use tumble_view::page::{escape, figure, number, opening, table};

/// Style rules in addition to the common style sheet.
const STYLE: &str = "path.stick { fill: var(--native); stroke: none; }\n\
    path.slip { fill: var(--ipopt); stroke: none; }\n";

/// Maximum number of contacts and curves on a page.
const MOST: usize = 24;

/// Page of a plan, with the `costs` of all iterations.
pub fn page(problem: &PlanProblem, plan: &Plan, costs: Vec<f64>) -> String {
    let (replay, scene) = (&plan.replay, problem.scene());
    let (first, h) = (scene.start_index, scene.world.time_step());
    let times: Vec<_> = (0..=problem.steps()).map(|k| (first + k as u64) as f64 * h).collect();
    let mut html = opening(&format!("tumble plan: {}", escape(&scene.name)), STYLE);
    let _ = writeln!(html, "<p class=\"faint\">tumble {}</p>", env!("CARGO_PKG_VERSION"));
    let class = if plan.status == PlanStatus::Replayed { "good" } else { "bad" };
    let _ = writeln!(
        html,
        "<p><strong class=\"{class}\">{}</strong>: all figures are from the replay, the simulated \
         run of the controls.</p>",
        escape(plan.status.name())
    );
    if !plan.reason.is_empty() {
        let _ = writeln!(html, "<p>{}</p>", escape(&plan.reason));
    }
    html += &targets(&replay.misses);
    html += &stages(&plan.stages);
    html += "<div class=\"charts\">\n";
    html += &cost(costs);
    html += &ribbon(&times, &scene.bodies, &replay.modes);
    for (name, values) in controls(problem, &replay.controls).iter().take(MOST) {
        html += &control(&times, name, values);
    }
    for (body, name) in scene.bodies.iter().enumerate().take(MOST) {
        let points = replay.states.iter().map(|states| states[body].position);
        html += &path(&times, name, &points.collect::<Vec<_>>());
    }
    html += "</div>\n</body>\n</html>\n";
    html
}

fn targets(targets: &[Miss]) -> String {
    let columns = [("requested", false), ("missed by", true), ("allowed", true), ("unit", false)];
    let mut rows = String::new();
    for Miss { name, by, tolerance, unit, .. } in targets {
        let _ = writeln!(
            rows,
            "<tr class=\"first\"><th scope=\"row\">{}</th>{}{}<td>{}</td></tr>",
            escape(name),
            number("missed by", &figure(*by)),
            number("allowed", &figure(*tolerance)),
            escape(unit)
        );
    }
    table(&columns, &rows)
}

fn stages(stages: &[StageReport]) -> String {
    let columns = [
        ("stage", false),
        ("cost", true),
        ("iterations", true),
        ("runs", true),
        ("kept", false),
        ("result", false),
    ];
    let mut rows = String::new();
    for stage in stages {
        let _ = writeln!(
            rows,
            "<tr class=\"first\"><th scope=\"row\">{}</th>{}{}{}<td data-name=\"kept\">{}</td><td>{}</td></tr>",
            escape(stage.name),
            number("cost", &figure(stage.cost)),
            number("iterations", &stage.iterations.to_string()),
            number("runs", &stage.runs.to_string()),
            if stage.kept { "yes" } else { "no" },
            escape(&stage.message)
        );
    }
    table(&columns, &rows)
}

/// Smallest cost so far over the iterations.
fn cost(costs: Vec<f64>) -> String {
    let mut least = f64::INFINITY;
    let smallest = costs.into_iter().map(|cost| {
        least = least.min(cost);
        least
    });
    let progress: Vec<_> = smallest.filter(|cost| cost.is_finite()).collect();
    if progress.len() < 2 {
        return String::new();
    }
    let iterations = PlotAxis::linear(0.0, progress.len() as f64, 0.0, 6);
    let costs = PlotAxis::new(ScaleKind::Log, progress.iter().copied(), 6);
    let mut chart =
        Chart::new(iterations, costs, "iterations of all stages", "smallest cost so far");
    chart.line("native", progress.iter().enumerate().map(|(k, cost)| (k as f64, *cost)));
    chart.figure("smallest cost over the iterations", "")
}

/// Modes over time of the contacts that have a force in some step, in the order of their keys.
fn ribbon(times: &[f64], bodies: &[String], modes: &[Vec<ContactMode>]) -> String {
    let pressing = modes.iter().flatten().filter(|of| of.mode != Mode::Open);
    let mut keys: Vec<ContactKey> = pressing.map(|of| of.key).collect();
    keys.sort_unstable();
    keys.dedup();
    keys.truncate(MOST);
    if keys.is_empty() {
        return String::new();
    }
    let (start, end) = ends(times);
    let mut lines = PlotAxis::linear(0.0, keys.len() as f64, 0.0, 1);
    let name = |key: &ContactKey| escape(&format!("{} {}", bodies[key.body], key.point));
    lines.ticks = keys.iter().enumerate().map(|(k, key)| (k as f64 + 0.5, name(key))).collect();
    let mut chart =
        Chart::new(PlotAxis::linear(start, end, 0.0, 6), lines, "time t (s)", "contact modes");
    for (k, key) in keys.iter().enumerate() {
        let mode = |of: &Vec<ContactMode>| of.iter().find(|of| of.key == *key).map(|of| of.mode);
        for (class, drawn) in [("stick", Mode::Stick), ("slip", Mode::Slip)] {
            let spans = modes.iter().zip(times.windows(2));
            let spans = spans.filter(|(of, _)| mode(of) == Some(drawn));
            let spans = spans.map(|(_, span)| (span[0], span[1]));
            chart.bars(class, spans, k as f64 + 0.15, k as f64 + 0.85);
        }
    }
    let square = |class: &str, name: &str| {
        let drawn = format!("<path class=\"{class}\" d=\"M0 1h26v8h-26z\"/>");
        key(&drawn, name)
    };
    chart.figure("contact modes over time", &(square("stick", "sticks") + &square("slip", "slips")))
}

fn control(times: &[f64], name: &str, values: &[f64]) -> String {
    let (start, end) = ends(times);
    let axis = PlotAxis::new(ScaleKind::FromZero, values.iter().copied(), 6);
    let mut chart = Chart::new(PlotAxis::linear(start, end, 0.0, 6), axis, "time t (s)", name);
    // Each value is constant over a step.
    let held = values.iter().zip(times.windows(2));
    chart.line("native", held.flat_map(|(value, span)| [(span[0], *value), (span[1], *value)]));
    chart.figure(&format!("{name} over time"), "")
}

/// First and last time (s).
fn ends(times: &[f64]) -> (f64, f64) {
    (times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(1.0))
}

/// Coordinates of a body over time.
fn path(times: &[f64], body: &str, points: &[Vector3<f64>]) -> String {
    let (start, end) = ends(times);
    let y_name = format!("position of {} (m)", body);
    let values = points.iter().flatten().copied();
    let axes =
        (PlotAxis::linear(start, end, 0.0, 6), PlotAxis::new(ScaleKind::FromZero, values, 6));
    let mut chart = Chart::new(axes.0, axes.1, "time t (s)", &y_name);
    let mut caption = String::new();
    for (k, (class, name)) in [("native", "x"), ("ipopt", "y"), ("guide", "z")].iter().enumerate() {
        chart.line(class, times.iter().zip(points).map(|(time, point)| (*time, point[k])));
        caption += &line_key(class, name);
    }
    chart.figure(&format!("{y_name} over time"), &caption)
}

/// Curves of the components with several pieces.
fn controls(problem: &PlanProblem, numbers: &[f64]) -> Vec<(String, Vec<f64>)> {
    let first = problem.variables().iter().filter(|variable| variable.knot == 0);
    let varies = first.filter(|variable| problem.controls()[variable.control].knots > 1);
    let curve = |variable: &tumble_plan::Variable| {
        let kind = &problem.controls()[variable.control].kind;
        let name = &problem.controls()[variable.control].name;
        let (component, unit) =
            (kind.components()[variable.component], kind.unit(variable.component));
        let unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
        let at = |step| {
            let knot = problem.knot(variable.control, step);
            problem.numbers(variable.control, knot, numbers).0[variable.component]
        };
        (format!("{name}.{component}{unit}"), (0..problem.steps()).map(at).collect())
    };
    varies.map(curve).collect()
}

#[cfg(test)]
#[path = "tests/page.rs"]
mod tests;
