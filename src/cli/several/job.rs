//! What a scenario file and flags amount to, and what their run.json says.

use super::run_file::{SeveralRun, refuse_large};
use crate::cli::args::SimulateArgs;
use crate::cli::contact;
use crate::cli::input;
use crate::cli::job::ONE_BODY;
use crate::cli::names::FileKind;
use crate::cli::outcome::{Failure, refuse_flags};
use crate::cli::run::Run;
use crate::cli::run_file::SummaryFile;
use crate::cli::settings::of_flags;
use std::path::Path;
use tumble::ipopt;
pub use tumble::scenario::several::job::Job;

/// The job that the arguments and the scenario `path`, whose text is `text`, amount to, checked.
pub fn new(args: &SimulateArgs, path: &Path, text: &str) -> Result<Job, Failure> {
    refuse_idle_flags(args)?;
    let flags = of_flags(args)?;
    let seed_given = flags.seed.is_some();
    let job = Job::of(flags, path, text, &input::bytes);
    let job = job.and_then(|job| refuse_large(&job.model).map(|()| job));
    let given = args.given();
    let mut job = job.map_err(|failure| failure.in_file(path, FileKind::Scenario, &given))?;
    refuse_flags(
        ONE_BODY,
        &[("--threads", args.threads.is_some() && job.model.bodies.len() == 1)],
    )?;
    if let Some(threads) = args.threads {
        job.contact.set_threads(threads)?;
    }
    let idle_seed = seed_given && !job.drawn;
    refuse_flags("a scene of which nothing is random", &[("--seed", idle_seed)])?;
    Ok(job)
}

pub fn run_file(job: &Job, run: &Run, largest_overlap: f64) -> SeveralRun {
    SeveralRun {
        outcome: run.end.name().to_owned(),
        tumble_version: env!("CARGO_PKG_VERSION").to_owned(),
        ipopt_version: ipopt::VERSION.to_owned(),
        scene: job.name.clone(),
        changed: job.changed.clone(),
        seed: job.seed,
        drawn: job.drawn,
        steps: job.rows,
        model: job.model.clone(),
        solver: contact::settings(&job.contact),
        summary: SummaryFile::of(&run.summary, job.contact.climbs(), run.elapsed.as_secs_f64()),
        largest_overlap_m: largest_overlap,
    }
}

/// Flags of one body's scenes.
fn refuse_idle_flags(args: &SimulateArgs) -> Result<(), Failure> {
    let physics = &args.physics;
    refuse_flags(
        "several bodies, which the scenario file describes",
        &[
            ("--mass", physics.mass.is_some()),
            ("--inertia", physics.inertia.is_some()),
            ("--box", physics.sides.is_some()),
            ("--plane", physics.plane.is_some()),
            ("--force", !physics.force.is_empty()),
            ("--torque", !physics.torque.is_empty()),
            ("--force-at", physics.force_at.is_some()),
            ("--position", args.position.is_some()),
            ("--height", args.height.is_some()),
            ("--attitude", args.attitude.is_some()),
            ("--velocity", args.velocity.is_some()),
            ("--spin", args.spin.is_some()),
            ("--frame", args.frame.is_some()),
        ],
    )
}
