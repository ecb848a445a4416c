//! `tumble check`: validates a scene, takes its first steps in memory and reports what they show.

use super::args::CheckArgs;
use super::describe;
use super::outcome::{Failure, Outcome};
use super::output;
use super::results::{RunOutcome, RunResults};
use super::run::advance;
use super::scene::{self, Scene};
use std::fmt::Write as _;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::contact::Candidates;
use tumble_core::simulation::StepRecord;
use tumble_model::shown;

/// Number of steps that are tried. Stiff joints are recognised in two consecutive steps, and bodies
/// that start slightly apart touch after a few.
const TRIED: u64 = 10;

/// Turn of a body in a step (rad) above which the motion is inaccurate (docs/concepts/time-step.md).
const LARGEST_TURN: f64 = 0.3;

/// Depth of an overlap that is not worth a line, as a fraction of the world's reach.
const NEGLIGIBLE: f64 = 1e-9;

/// Checks the scene and prints a report.
pub fn run(args: &CheckArgs) -> Result<Outcome, Failure> {
    let scene = scene::from_args(&args.setup)?;
    let results = first_steps(&scene)?;
    let mut text = format!("{} is valid\n", shown::line(&scene.name));
    text += &content(&scene);
    text += &overlaps(&scene);
    text += &solved(&scene, &results);
    text += &time_step(&scene, &results);
    for note in scene.notes() {
        let _ = writeln!(text, "  note         {}", shown::line(&note));
    }
    output::say(&text)?;
    let is_solved = results.end == RunOutcome::Complete && results.summary.unsolved() == 0;
    Ok(if is_solved { Outcome::Done } else { Outcome::Unconverged })
}

/// Results of the first steps.
fn first_steps(scene: &Scene) -> Result<RunResults, Failure> {
    let never = Arc::new(AtomicBool::new(false));
    let mut simulation = scene.simulation(&never)?;
    let (mut results, mut world) = (RunResults::new(scene), scene.world.clone());
    let mut record = StepRecord::new();
    for _ in 1..scene.rows.min(TRIED + 1) {
        results.end = advance(scene, &mut simulation, &never, &mut record)?;
        if results.end != RunOutcome::Complete {
            break;
        }
        results.add(scene, &mut world, &record);
    }
    results.set_time_error(&simulation);
    Ok(results)
}

/// Size of the scene.
fn content(scene: &Scene) -> String {
    let bodies = scene.world.bodies();
    let mass: f64 = bodies.iter().map(tumble_core::mechanics::RigidBody::mass).sum();
    let mut text = format!("  bodies       {}, {} kg in all\n", bodies.len(), shown::rounded(mass));
    for (kind, count) in [
        ("fixed pieces", scene.fixed.len()),
        ("joints", scene.joints.len()),
        ("gears", scene.world.gears().len()),
    ] {
        if count > 0 {
            let _ = writeln!(text, "  {kind:<12} {count}");
        }
    }
    let (h, steps) = (scene.world.time_step(), scene.rows - 1);
    let _ = writeln!(
        text,
        "  run          {steps} steps of {} s: {:.3} s of motion, solver {}",
        shown::number(h),
        steps as f64 * h,
        scene.solver()
    );
    text
}

/// Overlaps at the start, the deepest by name.
fn overlaps(scene: &Scene) -> String {
    let world = scene.world_at(scene.start_index);
    let mut found = Candidates::new().overlaps_at_start(&world, &scene.starts);
    found.retain(|overlap| overlap.depth > NEGLIGIBLE * world.reach());
    match found.first() {
        None => "  overlaps     none\n".to_owned(),
        Some(deepest) => format!(
            "  overlaps     {}, the deepest {:.1e} m between {} and {}; the first step separates \
             them\n",
            found.len(),
            deepest.depth,
            shown::line(scene.partner(deepest.between.0)),
            shown::line(scene.partner(deepest.between.1)),
        ),
    }
}

/// Convergence of the first steps.
fn solved(scene: &Scene, results: &RunResults) -> String {
    let summary = &results.summary;
    let mut text = format!(
        "  first steps  {} tried, {} in contact, {} not solved\n",
        summary.steps(),
        summary.touching,
        summary.unsolved()
    );
    if results.end == RunOutcome::Stopped {
        text += "               a run stops at the next one\n";
    }
    let requested = scene.contact.as_ref().and_then(|contact| contact.residual());
    text + &describe::certificates(summary, requested)
}

/// Advice about the time step, from the motion at the start and the first steps.
fn time_step(scene: &Scene, results: &RunResults) -> String {
    let h = scene.world.time_step();
    let fastest = scene.starts.iter().map(|state| state.spin.norm()).fold(0.0, f64::max);
    let mut text = String::new();
    if fastest * h > LARGEST_TURN {
        let _ = writeln!(
            text,
            "    a body turns by {:.2} rad in a step; use at most {:.1e} s",
            fastest * h,
            LARGEST_TURN / fastest
        );
    }
    if results.summary.wild > 0 {
        let _ = writeln!(
            text,
            "    {} of the first steps are solved, but unphysical; use a smaller time step",
            results.summary.wild
        );
        text += &describe::first_unphysical(scene, &results.summary);
    }
    text += &describe::too_stiff(scene, results);
    if !text.is_empty() {
        return format!("  time step    too long\n{text}");
    }
    let touched = if results.summary.touching > 0 { "" } else { ", but nothing touches yet" };
    format!("  time step    no objection{touched}\n{}", describe::time_error(scene, results))
}
