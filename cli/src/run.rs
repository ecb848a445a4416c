//! The steps of a run.

use super::checkpoint::CheckpointWriter;
use super::exported::Exported;
use super::outcome::Failure;
use super::output::progress_bar;
use super::pages::RecordBuffers;
use super::results::{RunOutcome, RunResults};
use super::scene::Scene;
use super::writer::RunWriter;
use std::panic::resume_unwind;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Instant;
use tumble_core::error::Error;
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_core::step::StepStatus;
use tumble_scene::choices::OnFailure;

/// Number of steps of one body between checks of the clock. More bodies have fewer steps, so that
/// the records have a constant size.
const CHUNK: usize = 64;

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
            let requested = page.records.len();
            let requested = usize::try_from(left).map_or(requested, |left| left.min(requested));
            let clock = Instant::now();
            while page.count < requested && run.end == RunOutcome::Complete {
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
                page.checkpoint = Some((simulation.save(), run.clone()));
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
    run.set_time_error(simulation);
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
    if stops && record.status() == StepStatus::Failed {
        simulation.take_back(record);
        return Ok(RunOutcome::Stopped);
    }
    Ok(RunOutcome::Complete)
}
