//! A simulated toss beside a recorded one.

use super::error::FitError;
use super::loss::TossScore;
use super::model::{Model, ParameterValues};
use super::protocol::{Protocol, turn_between};
use super::recording::Toss;
use crate::error::Error;
use crate::mechanics::State;
use crate::simulation::{Motion, Simulation, StepRecord};
use crate::step::StepStatus;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Simulates one toss from its start to the end of its recording. `each` sees the simulated state
/// at every frame from the start on.
///
/// # Errors
/// A toss without frames; an interrupt; a world or start that the library refuses.
pub fn rollout(
    model: &Model,
    protocol: &Protocol,
    values: &ParameterValues,
    toss: &Toss,
    interrupt: &Arc<AtomicBool>,
    each: impl FnMut(&State),
) -> Result<TossScore, FitError> {
    rollout_from(&protocol.start(toss), model, protocol, values, toss, interrupt, each)
}

/// The same from another `start`.
///
/// # Errors
/// As [`rollout`].
pub fn rollout_from(
    start: &State,
    model: &Model,
    protocol: &Protocol,
    values: &ParameterValues,
    toss: &Toss,
    interrupt: &Arc<AtomicBool>,
    mut each: impl FnMut(&State),
) -> Result<TossScore, FitError> {
    follow(start, (model, protocol, values), toss, interrupt, &mut |seen| {
        if let Seen::Frame(_, state) = seen {
            each(state);
        }
        Ok(())
    })
}

/// What is seen of a toss.
pub(super) enum Seen<'a> {
    /// A step that was taken.
    Step(&'a Simulation<'static>, &'a StepRecord),
    /// A recorded frame, and the simulated one.
    Frame(&'a State, &'a State),
}

/// Simulates a toss from `start`, and shows every step and every frame.
pub(super) fn follow(
    start: &State,
    (model, protocol, values): (&Model, &Protocol, &ParameterValues),
    toss: &Toss,
    interrupt: &Arc<AtomicBool>,
    each: &mut impl FnMut(Seen<'_>) -> Result<(), Error>,
) -> Result<TossScore, FitError> {
    let refused = |error: Error| match error {
        Error::Interrupted => FitError::Interrupted,
        error => FitError::Rollout { toss: toss.name.clone(), error },
    };
    if interrupt.load(Ordering::Relaxed) {
        return Err(FitError::Interrupted);
    }
    if toss.frames.is_empty() {
        let why = "has no frames; one or more are needed".to_owned();
        return Err(FitError::Toss { toss: toss.name.clone(), why });
    }
    let time_step = 1.0 / (toss.rate * protocol.substeps as f64);
    let world = model.world(values, time_step).map_err(refused)?;
    let motion = Motion::native(&world);
    let mut simulation = Simulation::new(world, [*start], motion).map_err(refused)?;
    simulation.interrupt_by(Arc::clone(interrupt));
    let mut record = StepRecord::new();
    let first = protocol.start_frame(toss);
    let mut score =
        TossScore { position: 0.0, rotation: 0.0, end: 0.0, steps: 0, failed: 0, residual: 0.0 };
    for (k, recorded) in toss.frames.iter().enumerate().skip(first) {
        for _ in 0..if k > first { protocol.substeps } else { 0 } {
            simulation.step(&mut record).map_err(refused)?;
            score.steps += 1;
            score.failed += u32::from(record.report.status == StepStatus::Failed);
            score.residual = score.residual.max(record.certificate.residual());
            each(Seen::Step(&simulation, &record)).map_err(refused)?;
        }
        let state = simulation.state();
        score.position += (state.position - recorded.position).norm();
        score.end = turn_between(&recorded.attitude, &state.attitude).norm();
        score.rotation += score.end;
        each(Seen::Frame(recorded, state)).map_err(refused)?;
    }
    let frames = (toss.frames.len() - first) as f64;
    score.position /= frames * protocol.length;
    score.rotation /= frames;
    Ok(score)
}
