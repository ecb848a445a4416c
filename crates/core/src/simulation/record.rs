//! Record of a step: everything that is written to a file or displayed.

use super::{EnergyGain, InfeasibleGap, SubstepsSummary, UnphysicalCause};
use crate::contact::{Certificate, Contact};
use crate::mechanics::{State, Wrench};
use crate::step::{StepReport, StepSolution, StepStatus};
use crate::world::without;

/// Record of one step k → k+1. Lists have one entry per body.
#[derive(Debug, Clone, PartialEq)]
pub struct StepRecord {
    /// Index k.
    pub index: u64,
    /// States from which the step starts: X at step k. With
    /// [`Integrator::Leapfrog`](crate::world::Integrator::Leapfrog) their velocities are those of the
    /// middle of the step before.
    pub states: Vec<State>,
    /// States X at step k with the velocities of the instant; empty if `states` has them.
    pub instants: Vec<State>,
    /// Bodies whose velocities of the instant at k+1 are extrapolated (eq. 37); empty without such
    /// velocities.
    pub extrapolated: Vec<bool>,
    /// External wrenches on the bodies, without gravity.
    pub wrenches: Vec<Wrench>,
    /// Candidate contacts.
    pub contacts: Vec<Contact>,
    /// States at k+1 and all forces.
    pub solution: StepSolution,
    /// Report of the solver.
    pub report: StepReport,
    /// Certificate of accuracy.
    pub certificate: Certificate,
    /// Deepest overlap of two pieces at k+1 (m), from their geometry. Contact planes are fixed
    /// during a step, so it is of second order in the rotation per step.
    pub overlap: f64,
    /// Largest error of the placement of a loaded contact between two pieces (eq. 18g) (m); 0 if all
    /// are where the pieces touch. It is no part of the certificate's residual.
    pub placement: f64,
    /// Smallest share of the coefficients of restitution that an island applied. It is 1 unless the
    /// full restitution would add energy ([`bounce`](super::bounce)).
    pub restitution_share: f64,
    /// Stability number h ω; 0 without joints. ω (rad/s) bounds the fastest transverse vibration of
    /// taut joints from below. A taut chain becomes unstable if it stays above 2 for several steps,
    /// which no certificate shows. An impact can exceed 2 for a single step.
    pub stiffness: f64,
    /// Cause of a failed step, if two bodies leave too little room for a third one.
    pub infeasible_gap: Option<InfeasibleGap>,
    /// Cause of a step with [`StepStatus::Wild`], or of a failed step whose solution makes energy.
    pub unphysical: Option<UnphysicalCause>,
    /// Largest energy beyond the balance (32) that an island makes in the step as taken, if beyond
    /// rounding.
    pub gain: Option<EnergyGain>,
    /// Substeps of the step, if it has any.
    pub substeps: SubstepsSummary,
    /// Bodies of islands that the native solver did not solve in one step without making energy.
    pub unsolved: Vec<usize>,
}

impl Default for StepRecord {
    fn default() -> Self {
        Self::new()
    }
}

impl StepRecord {
    /// Creates an empty record for [`Simulation::step`](super::Simulation::step).
    #[must_use]
    pub fn new() -> Self {
        Self {
            index: 0,
            states: Vec::new(),
            instants: Vec::new(),
            extrapolated: Vec::new(),
            wrenches: Vec::new(),
            contacts: Vec::new(),
            solution: StepSolution::default(),
            report: StepReport::without_problem(StepStatus::End),
            certificate: Certificate::default(),
            overlap: 0.0,
            placement: 0.0,
            restitution_share: 1.0,
            stiffness: 0.0,
            infeasible_gap: None,
            unphysical: None,
            gain: None,
            substeps: SubstepsSummary::default(),
            unsolved: Vec::new(),
        }
    }

    /// Removes the body `index` and its contacts, after its removal from the simulation. Bodies
    /// after it move up by one. Joints and gears stay where their flag in `joints` and `gears` is
    /// true.
    pub fn leave_out(&mut self, index: usize, joints: &[bool], gears: &[bool]) {
        if index < self.states.len() {
            self.states.remove(index);
            self.wrenches.remove(index);
        }
        if index < self.instants.len() {
            self.instants.remove(index);
        }
        if index < self.extrapolated.len() {
            self.extrapolated.remove(index);
        }
        let renumbered = |contact: &Contact| {
            let key = contact.key.renumbered(|body| without(body, index))?;
            Some(Contact { key, ..*contact })
        };
        self.contacts = self.contacts.iter().filter_map(renumbered).collect();
        self.solution.leave_out(index, joints, gears);
    }

    /// States X at step k with the velocities of the instant.
    #[must_use]
    pub fn instant_states(&self) -> &[State] {
        if self.instants.is_empty() { &self.states } else { &self.instants }
    }

    /// States X at step k+1 with the velocities of the instant (eq. 37).
    #[must_use]
    pub fn end_states(&self) -> Vec<State> {
        let ends = self.states.iter().zip(&self.solution.states).enumerate();
        let end = |(body, (state, next)): (usize, (&State, &State))| {
            if self.extrapolated.get(body) == Some(&true) {
                next.extrapolated(state)
            } else {
                *next
            }
        };
        ends.map(end).collect()
    }

    /// State X of the first body at step k.
    ///
    /// # Panics
    /// If the record is empty.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.states[0]
    }

    /// State X of the first body at step k+1.
    ///
    /// # Panics
    /// If the record is empty.
    #[must_use]
    pub fn next(&self) -> &State {
        &self.solution.states[0]
    }
}
