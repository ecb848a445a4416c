//! The derivative of a whole run: of a number that its states decide, by the state that it started from, by
//! what acted on it in every step, and by the constants of the world.
//!
//! The run goes forward once and is then gone through backwards, with products of the transposed
//! derivative of each step ([`StepDerivative::pull`]): one pass, however many arguments there are.
//! What the backward pass needs of a step is made again from states that were saved on the way, as many
//! as a [budget](Checkpoints) of memory allows; where it does not hold a stretch of steps at a time, stretches are
//! divided again. What was run is the same to the last bit with derivatives and without.

mod backward;

use super::{Saved, Simulation};
use crate::derivative::StateChange;
use crate::error::Error;
use crate::mechanics::{State, Wrench};
use crate::solver::native::{Smoothing, StepDerivative};
use crate::world::Constant;
use backward::{Backward, Taken};

/// How much the backward pass may keep at a time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Checkpoints {
    /// Derivatives of steps, at least one.
    pub steps: usize,
    /// Saved simulations, at least two.
    pub saved: usize,
}

impl Default for Checkpoints {
    /// 300 of each: with one body some megabytes, and one more run for up to 90 000 steps.
    fn default() -> Self {
        Self { steps: 300, saved: 300 }
    }
}

/// Derivatives of a number by the states after so many steps.
pub type ByStates<'f> = dyn FnMut(u64, &[State]) -> Option<Vec<StateChange>> + 'f;

/// A run to be differentiated.
pub struct Run<'f> {
    /// How many steps.
    pub steps: u64,
    /// Before each step: sets what acts in it, as a program does from step to step. It is called again for the same
    /// step, with the simulation in the same state, and must do the same.
    pub before: &'f mut dyn FnMut(&mut Simulation<'_>) -> Result<(), Error>,
    /// Of the states after so many steps (0 are those at the start), the derivatives of the number by them;
    /// nothing where it does not depend on them.
    pub by_states: &'f mut ByStates<'f>,
    /// The constants to differentiate by.
    pub constants: &'f [Constant],
    /// What may be kept.
    pub checkpoints: Checkpoints,
    /// With it the derivatives of the steps are [smoothed](StepDerivative::smoothed): the run is the exact one,
    /// and what is found no derivative of it but a direction where the exact one has none.
    pub smoothing: Option<Smoothing>,
}

/// The derivatives of a number by what a run started from.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RunGradient {
    /// By the states at the start.
    pub states: Vec<StateChange>,
    /// By the wrenches of every step, one list a step.
    pub wrenches: Vec<Vec<Wrench>>,
    /// By the constants that were asked for, in their order.
    pub constants: Vec<Vec<f64>>,
    /// The smallest [margin](StepDerivative::margin) of a step, m/s, and its index.
    pub margin: (f64, u64),
    /// The same of [features](StepDerivative::feature_margin).
    pub feature_margin: (f64, u64),
    /// Steps that failed or are wild: nothing that follows is a derivative of the equations.
    pub unsolved: u64,
    /// Steps in which contacts pressed whose features are [not known](StepDerivative::unknown) as functions of the
    /// poses.
    pub unknown: u64,
    /// Steps in which shares of forces were [kept](StepDerivative::keeps_shares).
    pub kept: u64,
    /// Steps that took a [part](super::StepRecord::restitution_share) of their restitution, which is taken for a constant.
    pub limited: u64,
}

impl RunGradient {
    /// Notes what is to be said of a step.
    fn note(&mut self, step: &Taken, derivative: &StepDerivative) {
        let smaller = |most: &mut (f64, u64), margin: f64| {
            if margin < most.0 {
                *most = (margin, step.index);
            }
        };
        smaller(&mut self.margin, derivative.margin());
        smaller(&mut self.feature_margin, derivative.feature_margin());
        self.unsolved += u64::from(!step.is_solved);
        self.unknown += u64::from(derivative.unknown() > 0);
        self.kept += u64::from(derivative.keeps_shares());
        self.limited += u64::from(step.is_limited);
    }
}

impl Simulation<'_> {
    /// Runs `run` from where the simulation is and finds the derivatives of the number that it decides. The simulation
    /// is left at the end of the run; after an error where it was.
    ///
    /// # Errors
    /// A step that cannot be posed, is interrupted, or [has no derivative](Simulation::linearise); what `run` itself
    /// refuses; derivatives by other states than one a body.
    pub fn gradient(&mut self, run: &mut Run<'_>) -> Result<RunGradient, Error> {
        let start = self.save();
        let found = self.differentiated(run, &start);
        if found.is_err() {
            self.restore(&start)?;
        }
        found
    }

    /// The derivatives of a run from `start`, where the simulation is.
    fn differentiated(&mut self, run: &mut Run<'_>, start: &Saved) -> Result<RunGradient, Error> {
        for constant in run.constants.iter().filter(|c| c.is_of_shapes()) {
            // What cannot vary has no derivative.
            self.world().with_constants(&[(*constant, &constant.of(self.world()))])?;
        }
        let mut backward = Backward::begin(run, self.index(), self.world())?;
        backward.go(self, run, 0, run.steps, start)?;
        backward.end(self, run, start)
    }
}
