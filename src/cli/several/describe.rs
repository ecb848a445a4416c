//! The summary of a run of several bodies, for people.

use super::job::Job;
use crate::cli::describe::{certificates, contact_steps};
use crate::cli::run::{End, Run};
use crate::cli::run_file::heading;
use std::fmt::Write as _;

pub fn describe(job: &Job, run: &Run, largest_overlap: Option<(u64, f64)>) -> String {
    let summary = &run.summary;
    let h = job.world.time_step();
    let simulated = summary.steps() as f64 * h;
    let seed = if job.drawn { format!("seed {}, ", job.seed) } else { String::new() };
    let mut text = format!(
        "{}, {seed}{} rows, h = {h} s: {simulated:.3} s of motion\n",
        heading(&job.name, &job.changed),
        summary.steps() + 1
    );
    match run.end {
        End::Complete => {}
        End::Interrupted => {
            let _ = writeln!(text, "  interrupted  {} rows were asked for", job.rows);
        }
        End::Stopped => {
            let _ = writeln!(
                text,
                "  stopped      step k = {} was not solved; {} rows were asked for",
                summary.steps(),
                job.rows
            );
        }
    }
    let _ = writeln!(
        text,
        "  bodies       {}, and {} fixed pieces\n  solver       {}{}\n  steps        {} ({} in contact, \
         {} in free flight)",
        job.model.bodies.len(),
        job.model.fixed.len(),
        job.contact.solver_name(),
        if job.usual_solver { ", the default for several bodies" } else { "" },
        summary.steps(),
        summary.contact_steps(),
        summary.free
    );
    if summary.contact_steps() > 0 {
        text += &contact_steps(job.contact.solver_name(), summary);
    }
    text += &certificates(summary);
    if let Some((index, overlap)) = largest_overlap {
        let _ = match overlap {
            0.0 => writeln!(text, "  overlap      none"),
            _ => writeln!(text, "  overlap      largest {overlap:.1e} m after step k = {index}"),
        };
    }
    let seconds = run.elapsed.as_secs_f64();
    let _ = write!(text, "  time         {seconds:.3} s stepping");
    if seconds > 0.0 {
        let _ = write!(text, ", {:.2} × real time", simulated / seconds);
    }
    text + "\n"
}
