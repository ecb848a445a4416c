//! The summary of a run, for people.

use super::job::Job;
use super::run_file::heading;
use super::simulate::{End, Run};
use std::fmt::Write as _;
use tumble::solver::StepStatus;

/// The summary for people.
pub fn describe(job: &Job, run: &Run) -> String {
    let Run { end, summary, elapsed } = run;
    let mut text = String::new();
    let h = job.model.time_step();
    let rows = summary.steps() + 1;
    let simulated = summary.steps() as f64 * h;
    let seed = if job.drawn { format!("seed {}, ", job.seed) } else { String::new() };
    let _ = writeln!(
        text,
        "{}, {seed}{rows} rows, h = {h} s: {simulated:.3} s of motion",
        heading(&job.name)
    );
    match end {
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
        "  steps        {} ({} in contact, {} in free flight)",
        summary.steps(),
        summary.contact_steps(),
        summary.free
    );
    if summary.contact_steps() > 0 {
        let _ = writeln!(
            text,
            "  {:<12} {} iterations, {:.1} a contact step",
            job.solver_name(),
            summary.iterations,
            summary.iterations as f64 / summary.contact_steps() as f64
        );
        let mut counts = format!("{}", summary.converged);
        for (status, count) in
            [(StepStatus::Retried, summary.retried), (StepStatus::Fallback, summary.fallback)]
        {
            if count > 0 {
                let _ = write!(counts, ", {status} {count}");
            }
        }
        let _ = writeln!(text, "  converged    {counts}");
        let _ = writeln!(text, "  failed       {}", summary.failed);
        for failure in &summary.first_failures {
            let status = failure.ipopt_status.map_or("no status", |status| status.name());
            let _ = writeln!(
                text,
                "    k = {:<6}   {status}, certificate {:.1e} m/s ({})",
                failure.index, failure.certificate, failure.part
            );
        }
        if summary.failed > summary.first_failures.len() as u64 {
            let _ = writeln!(text, "    …            see the column `status`");
        }
    }
    if let Some((index, certificate, part)) = summary.worst {
        let median = summary
            .median_certificate()
            .map_or(String::new(), |median| format!("median {median:.1e} m/s in contact, "));
        let _ = writeln!(
            text,
            "  certificate  {median}largest {certificate:.1e} m/s at k = {index} ({part})"
        );
    }
    let seconds = elapsed.as_secs_f64();
    let _ = write!(text, "  time         {seconds:.3} s stepping");
    if seconds > 0.0 {
        let _ = write!(text, ", {:.2} × real time", simulated / seconds);
    }
    text.push('\n');
    text
}
