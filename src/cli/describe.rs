//! The summary of a run, for people.

use super::run::{End, Run};
use super::run_file::heading;
use super::scene::{OutputFormat, Scene};
use super::shown;
use std::fmt::Write as _;
use tumble::scenario::solver_choice::SolverChoice;
use tumble::simulation::summary::RunSummary;
use tumble::step::StepStatus;

/// The summary for people.
pub fn describe(scene: &Scene, run: &Run) -> String {
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
    let overlap = match &scene.format {
        OutputFormat::Trajectory => None,
        OutputFormat::Tables(_) => {
            text += &cast(scene);
            run.overlap
        }
    };
    let _ = writeln!(
        text,
        "  steps        {} ({} in contact, {} in free flight)",
        summary.steps(),
        summary.contact_steps(),
        summary.free
    );
    if summary.contact_steps() > 0 {
        text += &contact_steps(scene.solver(), summary);
    }
    let asked = scene.contact.as_ref().and_then(SolverChoice::residual);
    text += &certificates(summary, asked);
    if let Some((index, overlap)) = overlap {
        let _ = match overlap {
            0.0 => writeln!(text, "  overlap      none"),
            _ => writeln!(text, "  overlap      largest {overlap:.1e} m after step k = {index}"),
        };
    }
    if let Some(joints) = &run.joints {
        let _ = writeln!(text, "  joints       {}, {joints}", scene.joints.len());
    }
    let seconds = run.elapsed.as_secs_f64();
    let _ = write!(text, "  time         {seconds:.3} s stepping");
    if seconds > 0.0 {
        let _ = write!(text, ", {:.2} × real time", simulated / seconds);
    }
    text + "\n"
}

/// Which bodies there are, and who solves their contacts.
fn cast(scene: &Scene) -> String {
    format!(
        "  bodies       {}, and {} fixed pieces\n  solver       {}{}\n",
        scene.bodies.len(),
        scene.fixed.len(),
        scene.solver(),
        if scene.usual_solver { ", the default for several bodies" } else { "" }
    )
}

/// Why a run is shorter than it was to be.
fn ending(scene: &Scene, run: &Run) -> String {
    let rows = scene.rows;
    match run.end {
        End::Complete => String::new(),
        End::Interrupted => format!("  interrupted  {rows} rows were asked for\n"),
        End::Stopped => format!(
            "  stopped      step k = {} was not solved; {rows} rows were asked for\n",
            run.summary.steps()
        ),
    }
}

/// What the solver made of the contact steps.
fn contact_steps(solver: &str, summary: &RunSummary) -> String {
    let mut text = format!(
        "  {solver:<12} {} iterations, {:.1} a contact step\n  converged    {}",
        summary.iterations,
        summary.iterations as f64 / summary.contact_steps() as f64,
        summary.converged
    );
    for (status, count) in [
        (StepStatus::Retried, summary.retried),
        (StepStatus::Fallback, summary.fallback),
        (StepStatus::Wild, summary.wild),
    ] {
        if count > 0 {
            let _ = write!(text, ", {status} {count}");
        }
    }
    let _ = writeln!(text, "\n  failed       {}", summary.failed);
    if summary.wild > 0 {
        text += "    wild steps turn a body by more than 1 rad, make energy or let something pass:\n    \
                 solved, but no physics; take a smaller time step\n";
    }
    if summary.tempered > 0 {
        let _ = writeln!(
            text,
            "  restitution  taken in part in {} steps, whose impacts would have made energy",
            summary.tempered
        );
    }
    for failure in &summary.first_failures {
        let message = failure.message.as_deref().unwrap_or("not solved");
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

/// The residuals reached, and the one `asked` for.
fn certificates(summary: &RunSummary, asked: Option<f64>) -> String {
    let Some((index, residual, part)) = &summary.worst else {
        return String::new();
    };
    let median = summary
        .median_residual()
        .map_or(String::new(), |median| format!("median {median:.1e} m/s in contact, "));
    let asked = asked.map_or(String::new(), |asked| format!(", {asked:e} m/s asked for"));
    format!("  residual     {median}largest {residual:.1e} m/s at k = {index} ({part}){asked}\n")
}
