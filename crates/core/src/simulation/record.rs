//! What a step leaves behind: all that is written to a file or shown.

use super::Squeeze;
use crate::contact::{Certificate, Contact};
use crate::mechanics::{State, Wrench};
use crate::step::{StepReport, StepSolution, StepStatus};
use crate::world::without;

/// One step k → k+1 of a simulation. Lists go over the bodies of the world.
#[derive(Debug, Clone, PartialEq)]
pub struct StepRecord {
    /// k.
    pub index: u64,
    /// X at step k.
    pub states: Vec<State>,
    /// What acted on the bodies from outside, without gravity.
    pub wrenches: Vec<Wrench>,
    /// The contacts that were considered: the candidates.
    pub contacts: Vec<Contact>,
    /// The states at k+1, and the force of every contact.
    pub solution: StepSolution,
    /// How the step ended.
    pub report: StepReport,
    /// How exact the step is.
    pub certificate: Certificate,
    /// How deep pieces overlap at k+1, m: the deepest of all pairs, from the shapes alone. Planes
    /// are kept for a step, so that it is of second order in the turn of a step.
    pub overlap: f64,
    /// The smallest part of the coefficients of restitution that an island took: 1, but where the
    /// whole would make energy ([`bounce`](super::bounce)).
    pub restitution_share: f64,
    /// h ω, ω (rad/s) being at least the fastest vibration across what joints hold taut: with more than 2 in one step
    /// after another a taut chain shakes itself to pieces, which no certificate shows; an impact may have more
    /// for a step. 0 without joints.
    pub stiffness: f64,
    /// Of a failed step, what leaves too little room for what, if that is why.
    pub squeeze: Option<Squeeze>,
    /// Of a step that the native solver did not solve as one, the bodies of the islands without a solution.
    pub unsolved: Vec<usize>,
}

impl Default for StepRecord {
    fn default() -> Self {
        Self::new()
    }
}

impl StepRecord {
    /// An empty record, to be filled by [`Simulation::step`](super::Simulation::step).
    #[must_use]
    pub fn new() -> Self {
        Self {
            index: 0,
            states: Vec::new(),
            wrenches: Vec::new(),
            contacts: Vec::new(),
            solution: StepSolution::default(),
            report: StepReport::without_problem(StepStatus::End),
            certificate: Certificate::default(),
            overlap: 0.0,
            restitution_share: 1.0,
            stiffness: 0.0,
            squeeze: None,
            unsolved: Vec::new(),
        }
    }

    /// Makes this what it is without the body `index`, which was taken out after the step, and without its contacts:
    /// bodies after it move up by one. Of the joints of the step and of its gears those stay that `joints` and `gears` say true of.
    pub fn leave_out(&mut self, index: usize, joints: &[bool], gears: &[bool]) {
        if index < self.states.len() {
            self.states.remove(index);
            self.wrenches.remove(index);
        }
        let renumbered = |contact: &Contact| {
            let key = contact.key.renumbered(|body| without(body, index))?;
            Some(Contact { key, ..*contact })
        };
        self.contacts = self.contacts.iter().filter_map(renumbered).collect();
        self.solution.leave_out(index, joints, gears);
    }

    /// X at step k of the first body.
    ///
    /// # Panics
    /// If the record is empty.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.states[0]
    }

    /// X at step k+1 of the first body.
    ///
    /// # Panics
    /// If the record is empty.
    #[must_use]
    pub fn next(&self) -> &State {
        &self.solution.states[0]
    }
}
