//! `tumble gradient`: derivatives of a scalar result of a run.

mod argument;
mod joint;
mod task;

use super::args::{GradientArgs, GradientQuantity};
use super::directory::OutputDirectory;
use super::input;
use super::outcome::{Failure, Outcome};
use super::output::{PendingFile, quoted, say};
use super::scenario::read_text;
use super::signals::raise_on_signals;
use argument::arguments;
pub use argument::help;
use joint::JointQuantity;
use serde::Serialize;
use std::fmt::Write as _;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use task::{GradientRow, GradientStop, Task};
use tumble_core::solver::native::{Smoothing, StepDerivative};
use tumble_model::shown;
use tumble_scene::scene::Scene;
use tumble_scene::settings::Settings;

/// Content of gradient.json.
#[derive(Debug, Serialize)]
struct GradientReport<'a> {
    scene: &'a str,
    of: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    joint: Option<&'a str>,
    body: &'a str,
    steps: u64,
    value: f64,
    /// Size of the smoothing, which changes the differentiated steps.
    #[serde(skip_serializing_if = "Option::is_none")]
    compliance: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    central_path_m_s: Option<f64>,
    #[serde(skip)]
    smoothing: Option<Smoothing>,
    /// Margin, m/s, and its step; null if no kink is near.
    margin: Option<(f64, u64)>,
    feature_margin: Option<(f64, u64)>,
    /// Numbers of steps: failed or wild, with unknown features, and with kept force distributions.
    unsolved: u64,
    unknown: u64,
    kept: u64,
    /// Number of steps with partial restitution.
    limited: u64,
    derivatives: &'a [GradientRow],
}

/// Smoothing of the derivatives.
fn smoothing(args: &GradientArgs) -> Result<Option<Smoothing>, Failure> {
    let compliance = args.compliance.map(|by| ("--compliance", Smoothing::Compliance(by)));
    let central = args.central_path.map(|by| ("--central-path", Smoothing::CentralPath(by)));
    let Some((flag, smoothing)) = compliance.or(central) else { return Ok(None) };
    match StepDerivative::smoothed(smoothing) {
        Ok(_) => Ok(Some(smoothing)),
        Err(error) => Err(Failure::Input(format!("{flag}: {error}"))),
    }
}

/// Runs `tumble gradient`.
pub fn run(args: &GradientArgs) -> Result<Outcome, Failure> {
    let arguments = arguments("--by", &args.by)?;
    if args.differences.is_some_and(|by| !(by > 0.0 && by < 1.0)) {
        return Err(Failure::Input(
            "--differences: a size above 0 and below 1 is needed".to_owned(),
        ));
    }
    let smoothing = smoothing(args)?;
    let text = read_text(&args.file)?;
    let flags = Settings {
        seed: args.seed,
        steps: args.steps.map(|steps| steps + 1),
        ..Settings::default()
    };
    let scene = Scene::of_text(&text, &args.file, flags, &input::bytes)?;
    if scene.solver() == "ipopt" {
        let why = "derivatives need steps solved to rounding; use the native solver, the default";
        return Err(Failure::Input(format!("{}: solver: {why}", shown::path(&args.file))));
    }
    let body = body_of(&scene, args.body.as_deref())?;
    let joint = joint_of(&scene, args)?;
    let interrupt = Arc::new(AtomicBool::new(false));
    raise_on_signals(&interrupt)?;
    let task = Task { scene: &scene, body, of: args.of, joint, smoothing, interrupt: &interrupt };
    let (value, found, rows) = match task.derivatives(&arguments, args.differences) {
        Ok(found) => found,
        Err(GradientStop::Interrupted) => return Ok(Outcome::Interrupted),
        Err(GradientStop::Failed(failure)) => return Err(failure),
    };
    let near = |(margin, at): (f64, u64)| margin.is_finite().then_some((margin, at));
    let report = GradientReport {
        scene: &scene.name,
        of: name_of(args.of),
        joint: args.joint.as_deref(),
        body: &scene.bodies[body],
        steps: scene.rows - 1,
        value,
        compliance: args.compliance,
        central_path_m_s: args.central_path,
        smoothing,
        margin: near(found.margin),
        feature_margin: near(found.feature_margin),
        unsolved: found.unsolved,
        unknown: found.unknown,
        kept: found.kept,
        limited: found.limited,
        derivatives: &rows,
    };
    let directory = OutputDirectory::for_pictures(&args.out)?;
    let (csv, json) = (
        PendingFile::create(&directory, "gradient.csv")?,
        PendingFile::create(&directory, "gradient.json")?,
    );
    csv.write(table(&rows).as_bytes())?;
    let text = serde_json::to_string_pretty(&report);
    let text = text.map_err(|error| Failure::Other(format!("gradient.json: {error}")))?;
    json.write((text + "\n").as_bytes())?;
    let (csv, json) = (csv.publish()?, json.publish()?);
    if !args.quiet {
        say(&(described(&report)
            + &format!("wrote {} and {}\n", shown::path(&csv), shown::path(&json))))?;
    }
    Ok(if found.unsolved > 0 { Outcome::Unconverged } else { Outcome::Done })
}

/// Name of a quantity.
pub fn name_of(quantity: GradientQuantity) -> String {
    use clap::ValueEnum;
    quantity.to_possible_value().map_or(String::new(), |value| value.get_name().to_owned())
}

/// Joint of a coordinate or rate.
fn joint_of(scene: &Scene, args: &GradientArgs) -> Result<Option<JointQuantity>, Failure> {
    let is_of_joint = matches!(args.of, GradientQuantity::Coordinate | GradientQuantity::Rate);
    match &args.joint {
        Some(name) if is_of_joint => JointQuantity::of(scene, name, args.axis.as_deref()).map(Some),
        None if !is_of_joint => Ok(None),
        Some(_) => {
            let why = "only coordinate and rate are of a joint; leave --joint out";
            Err(Failure::Input(format!("--of {}: {why}", name_of(args.of))))
        }
        None => {
            let why = "a joint is needed; give its name with --joint";
            Err(Failure::Input(format!("--of {}: {why}", name_of(args.of))))
        }
    }
}

fn body_of(scene: &Scene, wanted: Option<&str>) -> Result<usize, Failure> {
    let Some(wanted) = wanted else { return Ok(0) };
    let by_name = scene.bodies.iter().position(|name| name == wanted);
    let by_index = || wanted.parse().ok().filter(|index| *index < scene.bodies.len());
    by_name.or_else(by_index).ok_or_else(|| {
        let last = scene.bodies.len() - 1;
        let why =
            format!("the scene has no such body; allowed: a name, or a number from 0 to {last}");
        Failure::Input(format!("--body {wanted}: {why}"))
    })
}

/// Text of gradient.csv.
fn table(rows: &[GradientRow]) -> String {
    let mut text = "argument,component,part,unit,derivative,difference\n".to_owned();
    for GradientRow { argument, component, part, unit, derivative, difference } in rows {
        let difference = difference.map_or(String::new(), |difference| difference.to_string());
        let part = quoted(part);
        let _ = writeln!(text, "{argument},{component},{part},{unit},{derivative},{difference}");
    }
    text
}

/// Summary on the terminal.
fn described(report: &GradientReport<'_>) -> String {
    let GradientReport { of, joint, body, steps, value, .. } = report;
    let owner = joint.unwrap_or(body);
    let mut text = format!("{of} of {owner} after {steps} steps: {value}\n");
    if let Some(smoothing) = report.smoothing {
        let _ = writeln!(text, "  smoothed by {smoothing}: not the exact derivatives of the run");
    }
    for GradientRow { argument, part, unit, derivative, difference, .. } in report.derivatives {
        let per = if unit.is_empty() { String::new() } else { format!(" per {unit}") };
        let beside = difference
            .map_or(String::new(), |difference| format!("  (difference {difference:.9e})"));
        let _ = writeln!(text, "  {argument:>11} {part:<8}  {derivative:>18.9e}{per}{beside}");
    }
    let near = |text: &mut String, what, margin: Option<(f64, u64)>| {
        if let Some((margin, at)) = margin {
            let _ = writeln!(text, "nearest kink {what}: {margin:.1e} m/s, in step {at}");
        }
    };
    near(&mut text, "of the contact law or set", report.margin);
    near(&mut text, "of the touching features", report.feature_margin);
    for (count, what) in [
        (report.unsolved, "not solved: the results are not derivatives"),
        (report.unknown, "with features treated as fixed in their bodies"),
        (report.kept, "with force shares that depend on the history"),
        (report.limited, "with reduced restitution, treated as constant"),
    ] {
        if count > 0 {
            let _ = writeln!(text, "{count} steps {what}");
        }
    }
    text
}
