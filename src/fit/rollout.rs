//! A simulated toss beside a recorded one.

use super::error::FitError;
use super::loss::TossScore;
use super::model::Model;
use super::parameter::ParameterValues;
use super::protocol::{Protocol, turn_between};
use super::recording::Toss;
use crate::error::Error;
use crate::mechanics::State;
use crate::simulation::{Simulation, StepRecord};
use crate::step::StepStatus;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Simulates one toss from its start to the end of its recording. `each` sees the simulated states, one a body,
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
    each: impl FnMut(&[State]),
) -> Result<TossScore, FitError> {
    rollout_from(&protocol.starts(toss), model, protocol, values, toss, interrupt, each)
}

/// The same from other `starts`, one a body.
///
/// # Errors
/// As [`rollout`].
pub fn rollout_from(
    starts: &[State],
    model: &Model,
    protocol: &Protocol,
    values: &ParameterValues,
    toss: &Toss,
    interrupt: &Arc<AtomicBool>,
    mut each: impl FnMut(&[State]),
) -> Result<TossScore, FitError> {
    follow(starts, (model, protocol, values), toss, interrupt, &mut |seen| {
        if let Seen::Frame(_, states) = seen {
            each(states);
        }
        Ok(())
    })
}

/// What is seen of a toss.
pub(super) enum Seen<'a> {
    /// A step that was taken.
    Step(&'a Simulation<'static>, &'a StepRecord),
    /// A recorded frame, and the simulated one, a state a body.
    Frame(&'a [State], &'a [State]),
}

/// Simulates a toss from `starts`, and shows every step and every frame.
pub(super) fn follow(
    starts: &[State],
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
    model.check(toss)?;
    let time_step = 1.0 / (toss.rate * protocol.substeps as f64);
    let times = (toss.begin, time_step);
    let mut simulation = model.simulation(values, times, starts).map_err(refused)?;
    simulation.interrupt_by(Arc::clone(interrupt));
    let mut record = StepRecord::new();
    let first = protocol.start_frame(toss);
    let mut score =
        TossScore { position: 0.0, rotation: 0.0, end: 0.0, steps: 0, failed: 0, residual: 0.0 };
    for k in first..toss.count() {
        for _ in 0..if k > first { protocol.substeps } else { 0 } {
            simulation.step(&mut record).map_err(refused)?;
            score.steps += 1;
            score.failed += u32::from(record.report.status == StepStatus::Failed);
            score.residual = score.residual.max(record.certificate.residual());
            each(Seen::Step(&simulation, &record)).map_err(refused)?;
        }
        let (recorded, states) = (toss.frame(k), simulation.states());
        score.end = 0.0;
        for (recorded, state) in recorded.iter().zip(states) {
            let turn = turn_between(&recorded.attitude, &state.attitude).norm();
            score.position += (state.position - recorded.position).norm();
            score.rotation += turn;
            score.end = score.end.max(turn);
        }
        each(Seen::Frame(recorded, states)).map_err(refused)?;
    }
    let compared = (toss.bodies * (toss.count() - first)) as f64;
    score.position /= compared * protocol.length;
    score.rotation /= compared;
    Ok(score)
}
