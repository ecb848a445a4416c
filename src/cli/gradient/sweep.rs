//! `tumble gradient --sweep`: the number and its derivative while one number of an argument goes through a range.

use super::super::args::GradientArgs;
use super::super::directory::OutputDirectory;
use super::super::outcome::{Failure, Outcome};
use super::super::output::{PendingFile, say};
use super::super::shown;
use super::argument::Range;
use super::name_of;
use super::task::{Stop, Task};
use std::fmt::Write as _;
use tumble_pictures::plot::{Sweep, png, sweep};

/// One value of the range.
struct Point {
    at: f64,
    value: f64,
    derivative: f64,
    difference: Option<f64>,
    margin: f64,
    unsolved: u64,
}

/// Goes through `range` and writes sweep.csv and the picture.
pub fn run(args: &GradientArgs, task: &Task<'_>, range: Range) -> Result<Outcome, Failure> {
    let points = match points(args, task, range) {
        Ok(points) => points,
        Err(Stop::Interrupted) => return Ok(Outcome::Interrupted),
        Err(Stop::Failed(failure)) => return Err(failure),
    };
    let of = |part: fn(&Point) -> f64| points.iter().map(part).collect::<Vec<f64>>();
    let unit = args.of.unit();
    let quantity = format!("{} of {} ({unit})", name_of(args.of), task.scene.bodies[task.body]);
    let smoothed = task.smoothing.map_or(String::new(), |by| format!(", smoothed by {by}"));
    let picture = sweep(&Sweep {
        heading: &format!(
            "{}: {} after {} steps",
            task.scene.name,
            name_of(args.of),
            task.scene.rows - 1
        ),
        argument: &range.described(),
        quantity: &quantity,
        slope: &format!("its derivative{smoothed}"),
        at: &of(|point| point.at),
        values: &of(|point| point.value),
        derivatives: &of(|point| point.derivative),
        differences: &of(|point| point.difference.unwrap_or(f64::NAN)),
    });
    let bytes =
        png(&picture).map_err(|why| Failure::Other(format!("the sweep cannot be drawn: {why}")))?;
    let directory = OutputDirectory::for_pictures(&args.out)?;
    let files = [
        (PendingFile::create(&directory, "sweep.csv")?, table(&points).into_bytes()),
        (PendingFile::create(&directory, "sweep.svg")?, picture.into_bytes()),
        (PendingFile::create(&directory, "sweep.png")?, bytes),
    ];
    for (file, bytes) in &files {
        file.write(bytes)?;
    }
    let mut written = Vec::new();
    for (file, _) in files {
        written.push(shown::path(&file.publish()?).to_string());
    }
    let unsolved = points.iter().filter(|point| point.unsolved > 0).count();
    if !args.quiet {
        let mut text = format!("{quantity} at {} values of {}\n", points.len(), range.described());
        if unsolved > 0 {
            let _ = writeln!(
                text,
                "{unsolved} of them have steps that were not solved: no derivatives"
            );
        }
        say(&(text + &format!("wrote {}\n", written.join(", "))))?;
    }
    Ok(if unsolved > 0 { Outcome::Unconverged } else { Outcome::Done })
}

fn points(args: &GradientArgs, task: &Task<'_>, range: Range) -> Result<Vec<Point>, Stop> {
    let Range { argument, component, from, to } = range;
    let own = task.own(&argument, component).ok_or_else(|| {
        let why = format!("{} has no number {component} in this scene", argument.name());
        Failure::Input(format!("--sweep: {why}"))
    })?;
    let last = (args.points - 1) as f64;
    let point = |k: usize| {
        let at = from + (to - from) * (k as f64 / last);
        let (scene, push) = task.shifted(&argument, component, at - own)?;
        let shifted = Task { scene: &scene, push, ..*task };
        let (value, found, rows) = shifted.derivatives(&[argument], args.differences)?;
        let row = &rows[component];
        let (derivative, difference) = (row.derivative, row.difference);
        let (margin, unsolved) = (found.margin.0, found.unsolved);
        Ok(Point { at, value, derivative, difference, margin, unsolved })
    };
    (0..args.points).map(point).collect()
}

/// sweep.csv.
fn table(points: &[Point]) -> String {
    let mut text = "at,value,derivative,difference,margin,unsolved\n".to_owned();
    for Point { at, value, derivative, difference, margin, unsolved } in points {
        let difference = difference.map_or(String::new(), |difference| difference.to_string());
        let margin = if margin.is_finite() { margin.to_string() } else { String::new() };
        let _ = writeln!(text, "{at},{value},{derivative},{difference},{margin},{unsolved}");
    }
    text
}
