//! Simulated tosses beside recorded ones.

use super::error::FitError;
use super::loss::Loss;
use super::model::{Constant, Model, ParameterValues};
use super::protocol::{Protocol, turn_between};
use super::recording::Toss;
use super::slopes::{TossSlopes, slopes};
use crate::error::Error;
use crate::mechanics::State;
use crate::simulation::{Motion, Simulation, StepRecord};
use crate::step::StepStatus;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// How far a simulated toss is from the recorded one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TossScore {
    /// The mean over frames of |Δr| / length.
    pub position: f64,
    /// The mean over frames of the angle between the attitudes, rad.
    pub rotation: f64,
    /// The angle at the last frame, rad: about 90° or 180° on another face.
    pub end: f64,
    /// Steps taken, and those of them that failed.
    pub steps: u32,
    /// Steps that did not converge.
    pub failed: u32,
    /// The largest residual of a step, m/s.
    pub residual: f64,
}

/// What an evaluation is of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Query<'a> {
    /// The values.
    pub values: &'a ParameterValues,
    /// Substeps of a frame.
    pub substeps: usize,
    /// Which tosses, by their place in the list.
    pub tosses: &'a [usize],
}

/// Remembers evaluations, so that a fit can be taken up again. A fit asks the same things in the
/// same order each time.
pub trait ScoreMemory: Send {
    /// The scores of a query that was made before, one a toss; others count as none.
    fn recall(&mut self, query: &Query<'_>) -> Option<Vec<TossScore>>;

    /// Keeps the scores of a query. An error ends the fit.
    ///
    /// # Errors
    /// What keeps it from being kept.
    fn keep(&mut self, query: &Query<'_>, scores: &[TossScore]) -> Result<(), FitError>;
}

/// Remembers nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Forgetful;

impl ScoreMemory for Forgetful {
    fn recall(&mut self, _: &Query<'_>) -> Option<Vec<TossScore>> {
        None
    }

    fn keep(&mut self, _: &Query<'_>, _: &[TossScore]) -> Result<(), FitError> {
        Ok(())
    }
}

/// Simulates tosses with values to try.
pub struct Evaluator<'a> {
    model: &'a Model,
    protocol: &'a Protocol,
    tosses: &'a [Toss],
    memory: &'a mut dyn ScoreMemory,
    interrupt: Arc<AtomicBool>,
    /// Steps that failed in all evaluations.
    pub failed: u64,
    /// Steps of all evaluations.
    pub steps: u64,
}

impl<'a> Evaluator<'a> {
    /// An evaluator of `tosses`; `interrupt` ends it within a step.
    pub fn new(
        model: &'a Model,
        protocol: &'a Protocol,
        tosses: &'a [Toss],
        memory: &'a mut dyn ScoreMemory,
        interrupt: Arc<AtomicBool>,
    ) -> Self {
        Self { model, protocol, tosses, memory, interrupt, failed: 0, steps: 0 }
    }

    /// What is fitted.
    #[must_use]
    pub fn model(&self) -> &'a Model {
        self.model
    }

    /// How.
    #[must_use]
    pub fn protocol(&self) -> &'a Protocol {
        self.protocol
    }

    /// The recordings.
    #[must_use]
    pub fn tosses(&self) -> &'a [Toss] {
        self.tosses
    }

    /// The scores of some tosses, in their order.
    ///
    /// # Errors
    /// No toss, or one that is not there; an interrupt; a toss that cannot be simulated; a memory
    /// that fails.
    pub fn evaluate(&mut self, query: &Query<'_>) -> Result<Vec<TossScore>, FitError> {
        let (asked, count) = (query.tosses, self.tosses.len());
        if let Some(missing) = asked.iter().find(|toss| **toss >= count) {
            let why = format!("toss {missing} is asked for; there are {count}, counted from 0");
            return Err(FitError::Request(why));
        }
        if asked.is_empty() {
            return Err(FitError::Request("no toss is asked for; one or more are needed".into()));
        }
        let recalled = self.memory.recall(query);
        let scores = match recalled.filter(|scores| scores.len() == asked.len()) {
            Some(scores) => scores,
            None => {
                let scores = self.simulate(query)?;
                self.memory.keep(query, &scores)?;
                scores
            }
        };
        self.failed += scores.iter().map(|score| u64::from(score.failed)).sum::<u64>();
        self.steps += scores.iter().map(|score| u64::from(score.steps)).sum::<u64>();
        Ok(scores)
    }

    /// How the losses of some tosses change with `parameters`, in their order. They are not remembered.
    ///
    /// # Errors
    /// As [`Evaluator::evaluate`]; a step that has no derivative.
    pub fn slopes(
        &mut self,
        query: &Query<'_>,
        parameters: &[Constant],
        loss: Loss,
    ) -> Result<Vec<TossSlopes>, FitError> {
        let protocol = Protocol { substeps: query.substeps, ..self.protocol.clone() };
        let (model, tosses, interrupt) = (self.model, self.tosses, &self.interrupt);
        let of = (query.values, parameters, loss);
        let one = |&index: &usize| slopes((model, &protocol), of, &tosses[index], interrupt);
        query.tosses.par_iter().map(one).collect()
    }

    fn simulate(&self, query: &Query<'_>) -> Result<Vec<TossScore>, FitError> {
        let protocol = Protocol { substeps: query.substeps, ..self.protocol.clone() };
        let (model, tosses, interrupt) = (self.model, self.tosses, &self.interrupt);
        let one = |&index: &usize| {
            rollout(model, &protocol, query.values, &tosses[index], interrupt, |_| {})
        };
        // Collected in the order of the tosses, whoever was first.
        query.tosses.par_iter().map(one).collect()
    }
}

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
