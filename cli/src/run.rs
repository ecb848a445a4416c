//! A run: its steps one after another, and what they came to.

use super::checkpoint::CheckpointWriter;
use super::continued::ContinuedNotes;
use super::exported::Exported;
use super::outcome::Failure;
use super::output::progress_bar;
use super::pages::Pages;
use super::scene::Scene;
use super::writer::RunWriter;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use tumble_core::error::Error;
use tumble_core::simulation::summary::RunSummary;
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_core::step::{StepSolution, StepStatus};
use tumble_scene::choices::OnFailure;
use tumble_scene::joints_summary::{JointsSummary, Taut};
use tumble_scene::run_file::RunEnd;

/// Steps of one body between two looks at the clock, so that looking costs nothing; of more bodies
/// there are fewer, whose records take no more memory.
const CHUNK: usize = 64;

/// How far a run came.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum RunOutcome {
    Complete,
    /// Ctrl-C.
    Interrupted,
    /// A failed step under `--on-failure stop`.
    Stopped,
}

impl RunOutcome {
    /// The word of run.json.
    pub fn name(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::Interrupted => "interrupted",
            Self::Stopped => "stopped",
        }
    }
}

/// What a run came to.
pub struct RunPlan {
    pub end: RunOutcome,
    pub summary: RunSummary,
    /// Of the stepping alone.
    pub elapsed: Duration,
    /// The largest overlap, m, and after which step it was; `None` without steps.
    pub overlap: Option<(u64, f64)>,
    /// What joints came to; `None` without them.
    pub joints: Option<JointsSummary>,
    /// The joints that were too stiff for the time step.
    pub taut: Taut,
}

impl RunPlan {
    /// One of `scene` that has not begun.
    pub fn new(scene: &Scene) -> Self {
        let (summary, elapsed) = (RunSummary::default(), Duration::ZERO);
        let taut = Taut::default();
        let joints = (!scene.joints.is_empty()).then(JointsSummary::default);
        Self { end: RunOutcome::Complete, summary, elapsed, overlap: None, joints, taut }
    }

    /// What run.json says of it.
    pub fn ended(&self) -> RunEnd<'_> {
        RunEnd {
            outcome: self.end.name(),
            summary: &self.summary,
            seconds: self.elapsed.as_secs_f64(),
            largest_overlap: self.overlap.map_or(0.0, |(_, overlap)| overlap),
            joints: self.joints,
            taut: &self.taut,
        }
    }
}

/// Where the steps of a run go.
pub struct RunOutputs<'a> {
    /// To the tables,
    pub writer: &'a mut RunWriter,
    /// as contact problems to files of their own,
    pub exported: Option<&'a mut Exported>,
    /// and now and then as what the run can be continued from.
    pub checkpoints: Option<&'a CheckpointWriter<'a>>,
}

/// Runs the simulation of `scene` on to its last row and writes every row from where it is, on a thread of its own
/// while the next steps are taken, and what else the `outputs` are. What `run` came to before is
/// in what it returns.
pub fn run(
    scene: &Scene,
    simulation: &mut Simulation<'_>,
    mut run: RunPlan,
    interrupt: &AtomicBool,
    outputs: RunOutputs<'_>,
    quiet: bool,
) -> Result<RunPlan, Failure> {
    // As it is where a step ends.
    let mut world = scene.world.clone();
    let RunOutputs { writer, mut exported, checkpoints } = outputs;
    let mut last_checkpoint = Instant::now();
    let taken = simulation.index().saturating_sub(scene.start_index);
    let mut left = (scene.rows - 1).saturating_sub(taken);
    let bar = progress_bar(left, "steps", quiet);
    thread::scope(|scope| {
        let (mut pages, writing) =
            Pages::new(scope, writer, checkpoints, (CHUNK / scene.bodies.len()).max(1));
        while left > 0 && run.end == RunOutcome::Complete {
            let Some(mut page) = pages.empty() else { break };
            let wanted = page.records.len();
            let wanted = usize::try_from(left).map_or(wanted, |left| left.min(wanted));
            let clock = Instant::now();
            while page.count < wanted && run.end == RunOutcome::Complete {
                run.end = advance(scene, simulation, interrupt, &mut page.records[page.count])?;
                page.count += usize::from(run.end == RunOutcome::Complete);
            }
            run.elapsed += clock.elapsed();
            for record in page.filled() {
                run.summary.add(record);
                if run.overlap.is_none_or(|(_, largest)| record.overlap > largest) {
                    run.overlap = Some((record.index, record.overlap));
                }
                if let Some(exported) = &mut exported {
                    exported.write(&scene.world, record)?;
                }
                if let Some(joints) = &mut run.joints {
                    world.follow(&scene.courses, (record.index + 1) as f64 * world.time_step());
                    joints.add_errors(&world, &record.solution.states);
                    joints.add_residual(record.certificate.joint, record.certificate.joint_law);
                    joints.add_stiffness(record.stiffness);
                    let StepSolution { joints, gears, .. } = &record.solution;
                    run.taut.add(&world, &record.states, joints, gears, record.stiffness);
                }
            }
            bar.inc(page.count as u64);
            left -= page.count as u64;
            if checkpoints.is_some_and(|to| last_checkpoint.elapsed() >= to.every) {
                page.checkpoint = Some((simulation.save(), ContinuedNotes::of(&run, Vec::new())));
                last_checkpoint = Instant::now();
            }
            pages.write(page);
        }
        if let Some(mut page) = pages.empty() {
            simulation.end(&mut page.records[0]);
            page.count = 1;
            pages.write(page);
        }
        drop(pages);
        writing.join().unwrap_or_else(|panic| resume_unwind(panic))
    })?;
    bar.finish_and_clear();
    Ok(run)
}

/// One step, unless the run ends before it.
fn advance(
    scene: &Scene,
    simulation: &mut Simulation<'_>,
    interrupt: &AtomicBool,
    record: &mut StepRecord,
) -> Result<RunOutcome, Failure> {
    if interrupt.load(Ordering::Relaxed) {
        return Ok(RunOutcome::Interrupted);
    }
    match simulation.step(record) {
        Ok(()) => {}
        Err(Error::Interrupted) => return Ok(RunOutcome::Interrupted),
        Err(error) => return Err(error.into()),
    }
    let stops = matches!(&scene.contact, Some(contact) if contact.on_failure == OnFailure::Stop);
    if stops && record.report.status == StepStatus::Failed {
        simulation.take_back(record);
        return Ok(RunOutcome::Stopped);
    }
    Ok(RunOutcome::Complete)
}
