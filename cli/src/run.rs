//! A run: its steps and results.

use super::checkpoint::CheckpointWriter;
use super::continued::ContinuedNotes;
use super::exported::Exported;
use super::outcome::Failure;
use super::output::progress_bar;
use super::pages::RecordBuffers;
use super::scene::Scene;
use super::writer::{RowsSoFar, RunWriter};
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};
use tumble_core::error::Error;
use tumble_core::simulation::summary::RunSummary;
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_core::step::{StepSolution, StepStatus};
use tumble_core::world::World;
use tumble_scene::choices::OnFailure;
use tumble_scene::joints_summary::{JointsSummary, Taut};
use tumble_scene::run_file::RunEnd;

/// Number of steps of one body between checks of the clock. More bodies have fewer steps, so that
/// the records have a constant size.
const CHUNK: usize = 64;

/// End of a run.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum RunOutcome {
    Complete,
    /// Interrupted by Ctrl-C.
    Interrupted,
    /// Stopped by a failed step under `--on-failure stop`.
    Stopped,
}

impl RunOutcome {
    /// Name in run.json.
    pub fn name(self) -> &'static str {
        match self {
            Self::Complete => "complete",
            Self::Interrupted => "interrupted",
            Self::Stopped => "stopped",
        }
    }
}

/// Results of a run so far.
pub struct RunResults {
    pub end: RunOutcome,
    pub summary: RunSummary,
    /// Time of the stepping alone.
    pub elapsed: Duration,
    /// Step and size (m) of the largest overlap; `None` without steps.
    pub overlap: Option<(u64, f64)>,
    /// Largest errors of joints; `None` without joints.
    pub joints: Option<JointsSummary>,
    /// Joints that are too stiff for the time step.
    pub taut: Taut,
}

impl RunResults {
    /// Creates the results of a run of `scene` before its first step.
    pub fn new(scene: &Scene) -> Self {
        let (summary, elapsed) = (RunSummary::default(), Duration::ZERO);
        let taut = Taut::default();
        let joints = (!scene.joints.is_empty()).then(JointsSummary::default);
        Self { end: RunOutcome::Complete, summary, elapsed, overlap: None, joints, taut }
    }

    /// Adds a step of `scene`. `world` is its world; prescribed motions are moved to the step's end.
    pub fn add(&mut self, scene: &Scene, world: &mut World, record: &StepRecord) {
        self.summary.add(record);
        if self.overlap.is_none_or(|(_, largest)| record.overlap > largest) {
            self.overlap = Some((record.index, record.overlap));
        }
        if let Some(joints) = &mut self.joints {
            world.follow(&scene.courses, (record.index + 1) as f64 * world.time_step());
            joints.add_errors(world, &record.solution.states);
            joints.add_residual(record.certificate.joint, record.certificate.joint_law);
            joints.add_stiffness(record.stiffness);
            let StepSolution { joints, gears, .. } = &record.solution;
            self.taut.add(world, &record.states, joints, gears, record.stiffness);
        }
    }

    /// Results for run.json.
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

/// Outputs of a run.
pub struct RunOutputs<'a> {
    /// Tables.
    pub writer: &'a mut RunWriter,
    /// Contact problems, each in its own file.
    pub exported: Option<&'a mut Exported>,
    /// Periodic checkpoints, from which the run can continue.
    pub checkpoints: Option<&'a CheckpointWriter<'a>>,
}

/// Runs the simulation of `scene` from its current step to its last row, and writes the `outputs`.
/// Another thread writes while the next steps are computed. The results extend those in `run`.
pub fn run(
    scene: &Scene,
    simulation: &mut Simulation<'_>,
    mut run: RunResults,
    interrupt: &AtomicBool,
    outputs: RunOutputs<'_>,
    quiet: bool,
) -> Result<RunResults, Failure> {
    // World with its prescribed motions at the end of a step.
    let mut world = scene.world.clone();
    let RunOutputs { writer, mut exported, checkpoints } = outputs;
    let mut last_checkpoint = Instant::now();
    let taken = simulation.index().saturating_sub(scene.start_index);
    let mut left = (scene.rows - 1).saturating_sub(taken);
    let bar = progress_bar(left, "steps", quiet);
    thread::scope(|scope| {
        let (mut pages, writing) =
            RecordBuffers::new(scope, writer, checkpoints, (CHUNK / scene.bodies.len()).max(1));
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
                run.add(scene, &mut world, record);
                if let Some(exported) = &mut exported {
                    exported.write(&scene.world, record)?;
                }
            }
            bar.inc(page.count as u64);
            left -= page.count as u64;
            if checkpoints.is_some_and(|to| last_checkpoint.elapsed() >= to.every) {
                page.checkpoint =
                    Some((simulation.save(), ContinuedNotes::of(&run, RowsSoFar::default())));
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

/// Takes one step, unless the run ends before it.
pub fn advance(
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
