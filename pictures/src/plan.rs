//! The page of a plan: what it came to, the cost over the search, what contacts do, controls, and the replay.

use crate::chart::{Chart, line_key};
use crate::markup::escape;
use crate::page::{figure, number, opening, table};
use crate::plot::scale::{Axis, Kind};
use std::fmt::Write as _;

/// All that the page says.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The program that made it.
    pub program: String,
    /// What the problem is called.
    pub name: String,
    /// The status in a word, and whether all is met.
    pub status: (String, bool),
    /// What is missed, and why; empty where nothing is.
    pub reason: String,
    /// The legs: their names, costs, iterations, runs, and how they ended.
    pub legs: Vec<Leg>,
    /// What was asked for: its name, by how much it is missed, what is allowed, and the unit.
    pub targets: Vec<Target>,
    /// The least cost so far over the iterations of all legs.
    pub progress: Vec<f64>,
    /// t, s, at the begin of each step, and at the end.
    pub times: Vec<f64>,
    /// What was chosen: names with units, and a value a step.
    pub controls: Vec<(String, Vec<f64>)>,
    /// Contacts by name, and what each does in each step.
    pub contacts: Vec<(String, Vec<Touch>)>,
    /// The paths of the bodies.
    pub paths: Vec<Path>,
}

/// The path of a body, m: a point a state.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    /// The name of the body.
    pub body: String,
    /// In the replay.
    pub replay: Vec<[f64; 3]>,
    /// In the own run of the leg that found the plan; empty of a leg without one.
    pub own: Vec<[f64; 3]>,
}

/// What is said of a leg.
#[derive(Debug, Clone, PartialEq)]
pub struct Leg {
    /// Its word.
    pub name: String,
    /// The cost of the replay of what it found.
    pub cost: f64,
    /// Its iterations, and the runs that it made.
    pub counts: [u64; 2],
    /// How it ended.
    pub message: String,
    /// Whether the plan went on from it.
    pub kept: bool,
}

/// What was asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct Target {
    /// What it is.
    pub name: String,
    /// By how much it is missed, and what is allowed.
    pub miss: [f64; 2],
    /// The unit of both.
    pub unit: String,
}

/// What a contact does in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Touch {
    /// It is none, or does not press.
    Open,
    /// It sticks.
    Stick,
    /// It slips.
    Slip,
}

/// What is said of the style beside that of all pages.
const STYLE: &str = "path.stick { fill: var(--native); stroke: none; }\n\
    path.slip { fill: var(--ipopt); stroke: none; }\n";

/// More contacts and curves than this are left out of a chart.
const MOST: usize = 24;

/// The page of a report, complete in itself.
#[must_use]
pub fn page(report: &Report) -> String {
    let title = format!("tumble plan: {}", escape(&report.name));
    let mut html = opening(&title, STYLE);
    let _ = writeln!(html, "<p class=\"faint\">{}</p>", escape(&report.program));
    let (status, is_met) = &report.status;
    let class = if *is_met { "good" } else { "bad" };
    let _ = writeln!(
        html,
        "<p><strong class=\"{class}\">{}</strong>: all of this is of the replay, the run that the simulator makes of \
         the controls, but for what is called a leg's own.</p>",
        escape(status)
    );
    if !report.reason.is_empty() {
        let _ = writeln!(html, "<p>{}</p>", escape(&report.reason));
    }
    html += &targets(&report.targets);
    html += &legs(&report.legs);
    html += "<div class=\"charts\">\n";
    html += &cost(&report.progress);
    html += &ribbon(report);
    for (name, values) in report.controls.iter().take(MOST) {
        html += &control(&report.times, name, values);
    }
    html += &apart(report);
    for path in report.paths.iter().take(MOST) {
        html += &paths(&report.times, path);
    }
    html += "</div>\n</body>\n</html>\n";
    html
}

fn targets(targets: &[Target]) -> String {
    let columns = [("asked for", false), ("missed by", true), ("allowed", true), ("unit", false)];
    let mut rows = String::new();
    for Target { name, miss: [by, allowed], unit } in targets {
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

fn legs(legs: &[Leg]) -> String {
    let columns = [
        ("leg", false),
        ("cost", true),
        ("iterations", true),
        ("runs", true),
        ("kept", false),
        ("how it ended", false),
    ];
    let mut rows = String::new();
    for leg in legs {
        let _ = writeln!(
            rows,
            "<tr class=\"first\"><th scope=\"row\">{}</th>{}{}{}<td data-name=\"kept\">{}</td><td>{}</td></tr>",
            escape(&leg.name),
            number("cost", &figure(leg.cost)),
            number("iterations", &leg.counts[0].to_string()),
            number("runs", &leg.counts[1].to_string()),
            if leg.kept { "yes" } else { "no" },
            escape(&leg.message)
        );
    }
    table(&columns, &rows)
}

fn cost(progress: &[f64]) -> String {
    if progress.len() < 2 {
        return String::new();
    }
    let iterations = Axis::linear(0.0, progress.len() as f64, 0.0, 6);
    let costs = Axis::new(Kind::Log, progress.iter().copied(), 6);
    let mut chart = Chart::new(iterations, costs, ("iterations of all legs", "least cost so far"));
    chart.line("native", progress.iter().enumerate().map(|(k, cost)| (k as f64, *cost)));
    chart.figure("the least cost over the iterations", "")
}

/// The modes of contacts over time, a line a contact.
fn ribbon(report: &Report) -> String {
    let count = report.contacts.len().min(MOST);
    if count == 0 {
        return String::new();
    }
    let (start, end) = ends(&report.times);
    let mut lines = Axis::linear(0.0, count as f64, 0.0, 1);
    let names = report.contacts.iter().take(count).enumerate();
    lines.ticks = names.map(|(k, (name, _))| (k as f64 + 0.5, escape(name))).collect();
    let mut chart =
        Chart::new(Axis::linear(start, end, 0.0, 6), lines, ("time t (s)", "what contacts do"));
    for (k, (_, modes)) in report.contacts.iter().take(count).enumerate() {
        for (class, mode) in [("stick", Touch::Stick), ("slip", Touch::Slip)] {
            let spans = modes.iter().zip(report.times.windows(2)).filter(|(of, _)| **of == mode);
            let spans = spans.map(|(_, span)| (span[0], span[1]));
            chart.bars(class, spans, (k as f64 + 0.15, k as f64 + 0.85));
        }
    }
    let square = |class: &str, name: &str| {
        let drawn = format!("<path class=\"{class}\" d=\"M0 1h26v8h-26z\"/>");
        crate::chart::key(&drawn, name)
    };
    chart.figure(
        "modes of contacts over time",
        &(square("stick", "sticks") + &square("slip", "slips")),
    )
}

fn control(times: &[f64], name: &str, values: &[f64]) -> String {
    let (start, end) = ends(times);
    let axis = Axis::new(Kind::FromZero, values.iter().copied(), 6);
    let mut chart = Chart::new(Axis::linear(start, end, 0.0, 6), axis, ("time t (s)", name));
    // It is held for each step.
    let held = values.iter().zip(times.windows(2));
    chart.line("native", held.flat_map(|(value, span)| [(span[0], *value), (span[1], *value)]));
    chart.figure(&format!("{name} over time"), "")
}

/// How far the own run of the leg and the replay are apart over time, the farthest body of each state.
fn apart(report: &Report) -> String {
    let far = |k: usize| {
        let pairs = report.paths.iter().filter_map(|of| of.replay.get(k).zip(of.own.get(k)));
        let square = |(a, b): (&[f64; 3], &[f64; 3])| -> f64 {
            a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
        };
        pairs.map(square).fold(0.0, f64::max).sqrt()
    };
    let far: Vec<f64> = (0..report.times.len()).map(far).collect();
    if report.paths.iter().all(|of| of.own.is_empty()) {
        return String::new();
    }
    let (start, end) = ends(&report.times);
    let axes = (Axis::linear(start, end, 0.0, 6), Axis::new(Kind::Log, far.iter().copied(), 6));
    let mut chart = Chart::new(axes.0, axes.1, ("time t (s)", "plan and replay apart (m)"));
    chart.line("native", report.times.iter().copied().zip(far));
    let words = "how far the own run of the leg that found the plan is from its replay";
    chart.figure(words, words)
}

/// t, s, at the begin and at the end.
fn ends(times: &[f64]) -> (f64, f64) {
    (times.first().copied().unwrap_or(0.0), times.last().copied().unwrap_or(1.0))
}

/// The replay on top of the leg's own run, which is drawn wide.
fn paths(times: &[f64], path: &Path) -> String {
    let (start, end) = ends(times);
    let values = path.replay.iter().chain(&path.own).flatten().copied();
    let y_name = format!("place of {} (m)", path.body);
    let axes = (Axis::linear(start, end, 0.0, 6), Axis::new(Kind::FromZero, values, 6));
    let mut chart = Chart::new(axes.0, axes.1, ("time t (s)", &y_name));
    let keys = [("native", "x"), ("ipopt", "y"), ("guide", "z")];
    let over = |path: &[[f64; 3]], k: usize| {
        let points = times.iter().zip(path).map(|(time, point)| (*time, point[k]));
        points.collect::<Vec<_>>()
    };
    let mut caption = String::new();
    if !path.own.is_empty() {
        (0..3).for_each(|k| chart.line("exact", over(&path.own, k)));
        caption += &line_key("exact", "the leg's own run");
    }
    for (k, (class, name)) in keys.iter().enumerate() {
        chart.line(class, over(&path.replay, k));
        caption += &line_key(class, &format!("{name} of the replay"));
    }
    chart.figure(&format!("{y_name} over time"), &caption)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_has_all_of_it_and_no_markup_of_others() {
        let words = |text: &str| text.to_owned();
        let report = Report {
            program: words("tumble"),
            name: words("box <b>"),
            status: (words("missed"), false),
            reason: words("x is missed & so on"),
            legs: vec![Leg {
                name: words("sample"),
                cost: 2.5,
                counts: [3, 40],
                message: words("<i>"),
                kept: true,
            }],
            targets: vec![Target { name: words("box.x"), miss: [0.25, 0.001], unit: words("m") }],
            progress: vec![9.0, 4.0, 2.5],
            times: vec![0.0, 0.1, 0.2],
            controls: vec![(words("force (N)"), vec![1.0, -1.0])],
            contacts: vec![(words("box 0"), vec![Touch::Stick, Touch::Slip])],
            paths: vec![Path {
                body: words("box"),
                replay: vec![[0.0; 3], [0.1, 0.0, 0.0], [0.2, 0.0, 0.1]],
                own: Vec::new(),
            }],
        };
        let page = drawn(&report, 4);
        assert!(!page.contains("own run"), "there is none");
        for part in ["missed &amp; so on", "0.250000", "40", "class=\"stick\"", "class=\"slip\""] {
            assert!(page.contains(part), "{part}");
        }
        for wrong in ["NaN", "<b>", "<i>", "<script", "http://", "https://"] {
            assert!(!page.contains(wrong), "{wrong}");
        }
    }

    /// Cost, modes, a control and a path; of a leg with a run of its own that and the distance to it, also where both are one.
    #[test]
    fn a_plan_of_its_own_stands_under_its_replay() {
        let words = |text: &str| text.to_owned();
        for off in [0.0, 1e-3] {
            let replay = vec![[0.0; 3], [0.1, 0.0, 0.0], [0.2, 0.0, 0.1]];
            let own = replay.iter().map(|[x, y, z]| [*x, *y, z + off]).collect();
            let report = Report {
                program: words("tumble"),
                name: words("box"),
                status: (words("exact"), true),
                reason: String::new(),
                legs: Vec::new(),
                targets: Vec::new(),
                progress: Vec::new(),
                times: vec![0.0, 0.1, 0.2],
                controls: Vec::new(),
                contacts: Vec::new(),
                paths: vec![Path { body: words("box"), replay, own }],
            };
            let page = drawn(&report, 2);
            assert_eq!(page.matches("<path class=\"exact\"").count(), 3 + 1, "and its key");
            assert!(page.contains("plan and replay apart (m)") && !page.contains("NaN"));
        }
    }

    fn drawn(report: &Report, charts: usize) -> String {
        let page = page(report);
        assert_eq!(page.matches("<svg viewBox=\"0 0 440").count(), charts);
        page
    }
}
