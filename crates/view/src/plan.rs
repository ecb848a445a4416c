//! Page of a plan: targets, stages, cost history, contact modes, controls and paths.

use crate::chart::{Chart, line_key};
use crate::markup::escape;
use crate::page::{figure, number, opening, table};
use crate::plot::scale::{PlotAxis, ScaleKind};
use std::fmt::Write as _;

/// Content of the page.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanReport {
    /// Name and version of the program.
    pub program: String,
    /// Name of the problem.
    pub name: String,
    /// Status, and true if all targets are met.
    pub status: (String, bool),
    /// Missed targets and reasons; empty if all are met.
    pub reason: String,
    /// Stages of the search.
    pub stages: Vec<PlanStage>,
    /// Targets and path constraints.
    pub targets: Vec<PlanTarget>,
    /// Best cost so far, by iteration over all stages.
    pub progress: Vec<f64>,
    /// Times of the states (s).
    pub times: Vec<f64>,
    /// Controls: names with units, and one value per step.
    pub controls: Vec<(String, Vec<f64>)>,
    /// Names of contacts, and their modes in each step.
    pub contacts: Vec<(String, Vec<PlanTouch>)>,
    /// Paths of the bodies.
    pub paths: Vec<Path>,
}

/// Path of a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// Name of the body.
    pub body: String,
    /// Centres of mass (m), one per state.
    pub points: Vec<[f64; 3]>,
}

/// Result of a stage.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanStage {
    /// Name of the stage.
    pub name: String,
    /// Cost of the replay of its controls.
    pub cost: f64,
    /// Numbers of iterations and of runs.
    pub counts: [u64; 2],
    /// Reason for termination.
    pub message: String,
    /// True if the search continued from its controls.
    pub kept: bool,
}

/// A target and its error.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanTarget {
    /// Name of the target.
    pub name: String,
    /// Error and tolerance.
    pub miss: [f64; 2],
    /// Unit of both.
    pub unit: String,
}

/// Mode of a contact in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlanTouch {
    /// No contact, or no force.
    Open,
    /// Force without slip.
    Stick,
    /// Force with slip.
    Slip,
}

/// Style rules in addition to the common style sheet.
const STYLE: &str = "path.stick { fill: var(--native); stroke: none; }\n\
    path.slip { fill: var(--ipopt); stroke: none; }\n";

/// Maximum number of contacts and curves on a page.
const MOST: usize = 24;

/// Complete HTML page of a report.
#[must_use]
pub fn page(report: &PlanReport) -> String {
    let title = format!("tumble plan: {}", escape(&report.name));
    let mut html = opening(&title, STYLE);
    let _ = writeln!(html, "<p class=\"faint\">{}</p>", escape(&report.program));
    let (status, is_met) = &report.status;
    let class = if *is_met { "good" } else { "bad" };
    let _ = writeln!(
        html,
        "<p><strong class=\"{class}\">{}</strong>: all figures are from the replay, the simulated \
         run of the controls.</p>",
        escape(status)
    );
    if !report.reason.is_empty() {
        let _ = writeln!(html, "<p>{}</p>", escape(&report.reason));
    }
    html += &targets(&report.targets);
    html += &stages(&report.stages);
    html += "<div class=\"charts\">\n";
    html += &cost(&report.progress);
    html += &ribbon(report);
    for (name, values) in report.controls.iter().take(MOST) {
        html += &control(&report.times, name, values);
    }
    for path in report.paths.iter().take(MOST) {
        html += &paths(&report.times, path);
    }
    html += "</div>\n</body>\n</html>\n";
    html
}

fn targets(targets: &[PlanTarget]) -> String {
    let columns = [("requested", false), ("missed by", true), ("allowed", true), ("unit", false)];
    let mut rows = String::new();
    for PlanTarget { name, miss: [by, allowed], unit } in targets {
        let _ = writeln!(
            rows,
            "<tr class=\"first\"><th scope=\"row\">{}</th>{}{}<td>{}</td></tr>",
            escape(name),
            number("missed by", &figure(*by)),
            number("allowed", &figure(*allowed)),
            escape(unit)
        );
    }
    table(&columns, &rows)
}

fn stages(stages: &[PlanStage]) -> String {
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
            escape(&stage.name),
            number("cost", &figure(stage.cost)),
            number("iterations", &stage.counts[0].to_string()),
            number("runs", &stage.counts[1].to_string()),
            if stage.kept { "yes" } else { "no" },
            escape(&stage.message)
        );
    }
    table(&columns, &rows)
}

fn cost(progress: &[f64]) -> String {
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

/// Contact modes over time, one row per contact.
fn ribbon(report: &PlanReport) -> String {
    let count = report.contacts.len().min(MOST);
    if count == 0 {
        return String::new();
    }
    let (start, end) = ends(&report.times);
    let mut lines = PlotAxis::linear(0.0, count as f64, 0.0, 1);
    let names = report.contacts.iter().take(count).enumerate();
    lines.ticks = names.map(|(k, (name, _))| (k as f64 + 0.5, escape(name))).collect();
    let mut chart =
        Chart::new(PlotAxis::linear(start, end, 0.0, 6), lines, "time t (s)", "contact modes");
    for (k, (_, modes)) in report.contacts.iter().take(count).enumerate() {
        for (class, mode) in [("stick", PlanTouch::Stick), ("slip", PlanTouch::Slip)] {
            let spans = modes.iter().zip(report.times.windows(2)).filter(|(of, _)| **of == mode);
            let spans = spans.map(|(_, span)| (span[0], span[1]));
            chart.bars(class, spans, k as f64 + 0.15, k as f64 + 0.85);
        }
    }
    let square = |class: &str, name: &str| {
        let drawn = format!("<path class=\"{class}\" d=\"M0 1h26v8h-26z\"/>");
        crate::chart::key(&drawn, name)
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
fn paths(times: &[f64], path: &Path) -> String {
    let (start, end) = ends(times);
    let y_name = format!("position of {} (m)", path.body);
    let values = path.points.iter().flatten().copied();
    let axes =
        (PlotAxis::linear(start, end, 0.0, 6), PlotAxis::new(ScaleKind::FromZero, values, 6));
    let mut chart = Chart::new(axes.0, axes.1, "time t (s)", &y_name);
    let mut caption = String::new();
    for (k, (class, name)) in [("native", "x"), ("ipopt", "y"), ("guide", "z")].iter().enumerate() {
        chart.line(class, times.iter().zip(&path.points).map(|(time, point)| (*time, point[k])));
        caption += &line_key(class, name);
    }
    chart.figure(&format!("{y_name} over time"), &caption)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_has_all_of_it_and_no_markup_of_others() {
        let words = |text: &str| text.to_owned();
        let report = PlanReport {
            program: words("tumble"),
            name: words("box <b>"),
            status: (words("missed"), false),
            reason: words("x is missed & so on"),
            stages: vec![PlanStage {
                name: words("sample"),
                cost: 2.5,
                counts: [3, 40],
                message: words("<i>"),
                kept: true,
            }],
            targets: vec![PlanTarget {
                name: words("box.x"),
                miss: [0.25, 0.001],
                unit: words("m"),
            }],
            progress: vec![9.0, 4.0, 2.5],
            times: vec![0.0, 0.1, 0.2],
            controls: vec![(words("force (N)"), vec![1.0, -1.0])],
            contacts: vec![(words("box 0"), vec![PlanTouch::Stick, PlanTouch::Slip])],
            paths: vec![Path {
                body: words("box"),
                points: vec![[0.0; 3], [0.1, 0.0, 0.0], [0.2, 0.0, 0.1]],
            }],
        };
        let page = drawn(&report, 4);
        for part in ["missed &amp; so on", "0.250000", "40", "class=\"stick\"", "class=\"slip\""] {
            assert!(page.contains(part), "{part}");
        }
        for wrong in ["NaN", "<b>", "<i>", "<script", "http://", "https://"] {
            assert!(!page.contains(wrong), "{wrong}");
        }
    }

    fn drawn(report: &PlanReport, charts: usize) -> String {
        let page = page(report);
        assert_eq!(page.matches("<svg viewBox=\"0 0 440").count(), charts);
        page
    }
}
