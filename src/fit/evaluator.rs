//! Many tosses simulated with values to try, on the threads of the caller's pool.

use super::error::FitError;
use super::loss::{Loss, TossScore};
use super::model::Model;
use super::parameter::{Parameter, ParameterValues};
use super::protocol::Protocol;
use super::recording::Toss;
use super::rollout::rollout;
use super::slopes::{TossSlopes, slopes};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

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
        parameters: &[Parameter],
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
