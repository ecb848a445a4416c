//! Text summary of a run.

use super::results::{RunOutcome, RunResults};
use super::scene::Scene;
use anstyle::{AnsiColor, Style};
use std::fmt::Write as _;
use tumble_core::contact::Partner;
use tumble_core::simulation::summary::{FailedStep, RunSummary};
use tumble_core::simulation::unphysical::LARGEST_TURN;
use tumble_core::simulation::{EnergyGain, InfeasibleGap, UnphysicalCause};
use tumble_core::step::StepStatus;
use tumble_model::shown;
use tumble_scene::joints_summary::StiffJoint;
use tumble_scene::run_file::heading;
use tumble_scene::solver_choice::SolverChoice;

/// Text summary of a run.
pub fn describe(scene: &Scene, run: &RunResults) -> String {
    let summary = &run.summary;
    let h = scene.world.time_step();
    let simulated = summary.steps() as f64 * h;
    let seed = scene.drawn_seed().map_or(String::new(), |seed| format!("seed {seed}, "));
    let mut text = format!(
        "{}, {seed}{} rows, h = {} s: {simulated:.3} s of motion\n",
        heading(&scene.name, &scene.changed),
        summary.steps() + 1,
        shown::number(h)
    );
    text += &ending(scene, run);
    text += &bodies_and_solver(scene);
    text += &steps(summary);
    if summary.contact_steps() > 0 {
        text += &solved_steps(scene, summary);
    }
    let requested = scene.contact.as_ref().and_then(SolverChoice::residual);
    text += &certificates(summary, requested);
    if let Some((index, overlap)) = run.overlap {
        let _ = match overlap {
            0.0 => writeln!(text, "  overlap      none"),
            _ => writeln!(text, "  overlap      largest {overlap:.1e} m after step k = {index}"),
        };
    }
    if let Some(parting) = run.parting {
        let name = &scene.bodies[parting.body];
        let distance = parting.distance;
        let _ = writeln!(text, "  start        {name} moved by {distance:.1e} m out of an overlap");
    }
    text += &misplaced(summary);
    text += &largest_gain(scene, summary);
    if let Some(joints) = &run.joints {
        let _ = writeln!(text, "  joints       {}, {joints}", scene.joints.len());
        text += &too_stiff(scene, run);
    }
    text += &time_error(scene, run);
    let seconds = run.elapsed.as_secs_f64();
    let _ = write!(text, "  time         {seconds:.3} s stepping");
    if seconds > 0.0 {
        let _ = write!(text, ", {:.2} × real time", simulated / seconds);
    }
    text + "\n"
}

/// Estimated error by the time step.
pub fn time_error(scene: &Scene, run: &RunResults) -> String {
    let mut text = match run.time_error {
        Some((body, error)) if error > 0.0 => {
            let name = &scene.bodies[body];
            format!("  time step    adds about {error:.1e} m to the position of {name}\n")
        }
        _ => String::new(),
    };
    if run.summary.intervals > run.summary.steps() {
        let _ = writeln!(text, "  intervals    {} of all steps", run.summary.intervals);
    }
    if run.summary.coarse > 0 {
        let _ = writeln!(text, "    in {} steps, intervals are less accurate", run.summary.coarse);
    }
    if run.summary.ambiguous > 0 {
        let _ = writeln!(
            text,
            "    in {} steps, impacts are closer than the error: their order may differ",
            run.summary.ambiguous
        );
    }
    text
}

/// Numbers of steps: with a contact force, solved without one, and in free flight.
fn steps(summary: &RunSummary) -> String {
    let mut text = format!("  steps        {} ({} in contact", summary.steps(), summary.touching);
    let others = summary.contact_steps().saturating_sub(summary.touching);
    if others > 0 {
        let _ = write!(text, ", {others} solved without a contact force");
    }
    let _ = writeln!(text, ", {} in free flight)", summary.free);
    text
}

/// Number of bodies and the solver.
fn bodies_and_solver(scene: &Scene) -> String {
    let program = scene.contact.as_ref().and_then(SolverChoice::program);
    format!(
        "  bodies       {}, and {} fixed pieces\n  solver       {}{}\n",
        scene.bodies.len(),
        scene.fixed.len(),
        scene.solver(),
        program.map(|program| format!(": {program}")).unwrap_or_default()
    )
}

/// Reason why a run ended early.
fn ending(scene: &Scene, run: &RunResults) -> String {
    let rows = scene.rows;
    match run.end {
        RunOutcome::Complete => String::new(),
        RunOutcome::Interrupted => format!("  interrupted  {rows} rows were requested\n"),
        RunOutcome::Stopped => format!(
            "  stopped      step k = {} was not solved; {rows} rows were requested\n",
            run.summary.steps()
        ),
    }
}

/// Solver statistics of the steps with contacts or joints.
fn solved_steps(scene: &Scene, summary: &RunSummary) -> String {
    let mut text = format!(
        "  {:<12} {} iterations, {:.1} per solved step\n  converged    {}",
        scene.solver(),
        summary.iterations,
        summary.iterations as f64 / summary.contact_steps() as f64,
        summary.converged
    );
    for (status, count) in [
        (StepStatus::Retried, summary.retried),
        (StepStatus::Fallback, summary.fallback),
        (StepStatus::Substepped, summary.substepped),
        (StepStatus::Wild, summary.wild),
    ] {
        if count > 0 {
            let _ = write!(text, ", {status} {count}");
        }
    }
    let style = match summary.failed {
        0 => Style::new(),
        _ => AnsiColor::Red.on_default().bold(),
    };
    let _ = writeln!(text, "\n  failed       {style}{}{style:#}", summary.failed);
    if summary.substepped > 0 {
        text += "    substepped steps were solved in 2 to 64 shorter steps each\n";
    }
    if summary.wild > 0 {
        text += "    wild steps are solved, but unphysical; use a smaller time step\n";
        text += &first_unphysical(scene, summary);
    }
    if summary.tempered > 0 {
        let _ = writeln!(
            text,
            "  restitution  reduced in {} steps, where in full it would have created energy",
            summary.tempered
        );
    }
    for failure in &summary.first_failures {
        let message = reason(scene, failure);
        let _ = writeln!(
            text,
            "    k = {:<6}   {message}, residual {:.1e} m/s ({})",
            failure.index, failure.residual, failure.part
        );
    }
    if summary.failed > summary.first_failures.len() as u64 {
        text += "    …            see the column `status`\n";
    }
    text
}

/// Joints that are too stiff for the time step, with a sufficient step.
pub fn too_stiff(scene: &Scene, run: &RunResults) -> String {
    /// Number of joints listed by name; more are only counted.
    const MOST_NAMED: usize = 4;
    /// Largest value of the flag, and shortest time step of a world, s.
    const MOST_SUBSTEPS: f64 = 1000.0;
    const LEAST_TIME_STEP: f64 = 1e-6;
    let h = scene.world.time_step();
    // If the step is already divided, the flag would refer to another step.
    let is_divided = scene.changed.iter().any(|name| name == "substeps");
    let mut joints = run.stiff_joints.joints(h);
    joints.sort_by(|a, b| b.stiffness.total_cmp(&a.stiffness));
    if joints.is_empty() {
        return String::new();
    }
    let mut text = "    too stiff for h in two consecutive steps (h ω above 2), so that the bodies they \
                    hold may vibrate;\n    use the listed time step (--substeps takes shorter steps \
                    and writes as many rows)\n"
        .to_owned();
    for StiffJoint { joint, stiffness, time_step_s } in joints.iter().take(MOST_NAMED) {
        let name = scene.joints.get(*joint).map_or("", |name| name);
        let _ = write!(
            text,
            "    {:<12} h ω {stiffness:.1}: at most {time_step_s:.1e} s",
            shown::line(name)
        );
        let substeps = (h / time_step_s).ceil();
        if !is_divided && substeps <= MOST_SUBSTEPS && h >= substeps * LEAST_TIME_STEP {
            let _ = write!(text, ", --substeps {substeps:.0}");
        }
        text.push('\n');
    }
    if joints.len() > MOST_NAMED {
        let _ =
            writeln!(text, "    …            {} in all, see taut_joints in run.json", joints.len());
    }
    text
}

/// Reason why a step has no solution, with the bodies, as far as known.
fn reason(scene: &Scene, failure: &FailedStep) -> String {
    if let Some(squeeze) = &failure.infeasible_gap {
        return format!("no solution exists{}", squeezed(scene, squeeze));
    }
    if let Some(cause) = &failure.unphysical {
        // Errors of the start that stay, because their removal makes energy.
        let overlap = failure.residual * scene.world.time_step();
        let why = if failure.part == "penetration" {
            format!("the removal of an overlap of {overlap:.1e} m makes energy")
        } else {
            "its solution makes energy".to_owned()
        };
        return format!("{why}: {}", unphysical(scene, cause));
    }
    if let Some(message) = &failure.message {
        return message.as_ref().to_owned();
    }
    let name = |body: &usize| scene.bodies.get(*body).map_or(String::new(), |of| shown::line(of));
    let names: Vec<_> = failure.unsolved.iter().map(name).collect();
    if names.is_empty() {
        "no solution was found".to_owned()
    } else {
        format!("no solution was found for {}", names.join(", "))
    }
}

/// First unphysical step with the test that it exceeds.
pub fn first_unphysical(scene: &Scene, summary: &RunSummary) -> String {
    let Some((index, cause)) = &summary.first_wild else { return String::new() };
    let why = unphysical(scene, cause);
    format!("    k = {index:<6}   {why}\n")
}

/// Test that an unphysical step exceeds.
fn unphysical(scene: &Scene, cause: &UnphysicalCause) -> String {
    let name = |body: usize| object(scene, Partner::Body(body));
    match *cause {
        UnphysicalCause::Turn { body, angle } => {
            format!("{} turns by {angle:.2} rad, more than {LARGEST_TURN} rad", name(body))
        }
        UnphysicalCause::Gain { body, energy } => {
            format!("{} and what it touches gain {energy:.1e} J", name(body))
        }
        UnphysicalCause::Missed { between } => {
            let [one, other] = between.map(|of| object(scene, of));
            format!("{one} may have passed through {other}")
        }
        UnphysicalCause::Misplaced { between, error } => {
            let [one, other] = between.map(|of| object(scene, of));
            format!("a contact of {one} with {other} acts {error:.1e} m from where they touch")
        }
        _ => String::new(),
    }
}

/// Steps with contacts that are not where the pieces touch (eq. 18g).
fn misplaced(summary: &RunSummary) -> String {
    let Some((index, error)) = summary.largest_placement else { return String::new() };
    format!(
        "  misplaced    contacts of {} steps are not where the pieces touch, by {error:.1e} m at \
         k = {index}\n",
        summary.misplaced
    )
}

/// Largest energy that bodies make beyond the balance in a step.
pub fn largest_gain(scene: &Scene, summary: &RunSummary) -> String {
    let Some((index, EnergyGain { body, energy })) = summary.largest_gain else {
        return String::new();
    };
    let name = object(scene, Partner::Body(body));
    format!("  energy gain  largest {energy:.1e} J at k = {index} ({name} and what it touches)\n")
}

/// Bodies or pieces that leave too little space for a body.
fn squeezed(scene: &Scene, squeeze: &InfeasibleGap) -> String {
    let names: Vec<_> = squeeze.between.iter().map(|partner| object(scene, *partner)).collect();
    format!(": {} have {:.1e} m too little room", names.join(", "), squeeze.lacking)
}

/// Name of an object.
fn object(scene: &Scene, of: Partner) -> String {
    let name = match of {
        Partner::Ground => return "the ground".to_owned(),
        Partner::Fixed(index) => scene.fixed.get(index),
        Partner::Body(index) => scene.bodies.get(index),
    };
    name.map_or_else(|| "the body".to_owned(), |name| shown::line(name))
}

/// Largest and median residual, and the requested one.
pub fn certificates(summary: &RunSummary, requested: Option<f64>) -> String {
    let Some((index, residual, part)) = &summary.worst else {
        return String::new();
    };
    let median = summary
        .median_residual()
        .map_or(String::new(), |median| format!("median {median:.1e} m/s outside free flight, "));
    let requested =
        requested.map_or(String::new(), |requested| format!(", {requested:e} m/s requested"));
    format!(
        "  residual     {median}largest {residual:.1e} m/s at k = {index} ({part}){requested}\n"
    )
}
