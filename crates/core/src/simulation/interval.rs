//! Record of an interval: one solved problem of a step.

use super::leapfrog::{AddedError, Converted};
use super::moment::Moment;
use super::{EnergyBalance, EnergyGain, InfeasibleGap, UnphysicalCause, energy};
use crate::contact::certificate::Claim;
use crate::contact::{Certificate, Contact};
use crate::mechanics::{State, Wrench};
use crate::step::{StepReport, StepSolution, StepStatus};
use crate::world::{Changeable, Span, World, without};
use std::borrow::Cow;

/// An interval of a step: one problem and its solution. Lists have one entry per body.
#[derive(Debug, Clone, PartialEq)]
pub struct Interval {
    /// Part of the step that it covers; `None` for a whole step without an accuracy or located impacts.
    pub span: Option<Span>,
    /// States from which the interval starts. With
    /// [`Integrator::Leapfrog`](crate::world::Integrator::Leapfrog) their velocities are those of the
    /// middle of the interval before.
    pub states: Vec<State>,
    /// States at its start with the velocities of the instant; empty if `states` has them.
    pub instants: Vec<State>,
    /// Bodies whose velocities of the instant at its end are extrapolated (eq. 37); empty without
    /// such velocities.
    pub extrapolated: Vec<bool>,
    /// External wrenches on the bodies, without gravity.
    pub wrenches: Vec<Wrench>,
    /// Candidate contacts.
    pub contacts: Vec<Contact>,
    /// States at its end and all forces.
    pub solution: StepSolution,
    /// Report of the solver.
    pub report: StepReport,
    /// Certificate of accuracy.
    pub certificate: Certificate,
    /// Deepest overlap of two pieces at its end (m), from their geometry. Contact planes are fixed
    /// during an interval, so it is of second order in the rotation.
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
    /// Largest energy beyond the balance (32) that an island makes, if beyond rounding. In a step with
    /// located impacts it is the rise of the energy of the instant beyond loads and drives, if larger.
    pub gain: Option<EnergyGain>,
    /// Growth of the estimated errors (40).
    pub(crate) errors: AddedError,
    /// True if the error is larger than the accuracy allows.
    pub is_coarse: bool,
    /// Data of a part of a step; `None` for a whole step without an accuracy or located impacts.
    pub(super) part: Option<Box<PartOfStep>>,
}

/// Data of an interval that is a part of a step.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct PartOfStep {
    /// Energies at its start and end as the rows of a run count them (J), if these are not (35).
    pub energies: [Option<f64>; 2],
    /// States at its end with the velocities of the instant.
    pub ends: Vec<State>,
    /// Conversions of velocities before it; empty in a step that was not solved at once.
    pub converted: Vec<Converted>,
    /// Parts of the world that change, at its end.
    pub changeable: Changeable,
}

impl PartOfStep {
    /// Part after these conversions.
    pub fn after(converted: Vec<Converted>) -> Self {
        Self { converted, ..Self::default() }
    }

    /// Part of the record of a state without a step.
    pub fn at_the_end(world: &World, moment: &Moment) -> Self {
        let energies = [Some(energy::at_instant(world, moment.states())), None];
        Self { energies, changeable: world.changeable(), ..Self::default() }
    }
}

impl Default for Interval {
    fn default() -> Self {
        Self {
            span: None,
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
            errors: AddedError::default(),
            is_coarse: false,
            part: None,
        }
    }
}

impl Interval {
    /// A whole step from `states` with the solution of its `contacts`.
    #[must_use]
    pub fn new(states: Vec<State>, contacts: Vec<Contact>, solution: StepSolution) -> Self {
        Self { states, contacts, solution, ..Self::default() }
    }

    /// Length (s) in `world`.
    #[must_use]
    pub fn length(&self, world: &World) -> f64 {
        self.span.map_or(world.whole_step(), |span| span.length)
    }

    /// States at its start with the velocities of the instant.
    #[must_use]
    pub fn instant_states(&self) -> &[State] {
        if self.instants.is_empty() { &self.states } else { &self.instants }
    }

    /// States at its end with the velocities of the instant (eq. 37).
    #[must_use]
    pub fn end_states(&self) -> Vec<State> {
        if let Some(part) = self.part.as_ref().filter(|part| !part.ends.is_empty()) {
            return part.ends.clone();
        }
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

    /// Growth of the estimated error (40) of the body with the largest one (m).
    #[must_use]
    pub fn error(&self) -> f64 {
        self.errors.smooth.max(self.errors.abrupt)
    }

    /// True if impacts of a body follow each other so closely that they may come in the other order
    /// in the exact motion.
    #[must_use]
    pub fn is_ambiguous(&self) -> bool {
        self.errors.is_ambiguous
    }

    /// The `world` of the run as this interval was taken in it. Prescribed motions of a step of one
    /// interval must be at its end.
    #[must_use]
    pub fn world<'w>(&self, world: &'w World) -> Cow<'w, World> {
        let Some(part) = &self.part else { return Cow::Borrowed(world) };
        let mut world = world.clone();
        world.set_span(self.span);
        world.set_changeable(&part.changeable);
        Cow::Owned(world)
    }

    /// Energy at its start as the rows of a run count it (J). `world` is its [world](Self::world).
    #[must_use]
    pub fn energy(&self, world: &World) -> f64 {
        let counted = self.part.as_ref().and_then(|part| part.energies[0]);
        counted.unwrap_or_else(|| energy::total(world, &self.states))
    }

    /// Terms of the energy balance (36) (J) in its [world](Self::world). They sum up to the
    /// difference of [energies](Self::energy), also where lengths of intervals change.
    #[must_use]
    pub fn balance(&self, world: &World) -> EnergyBalance {
        let mut balance = EnergyBalance::new(world, &self.claim(), self.solution.loads());
        if let Some(part) = &self.part {
            let ends = [(&self.states, -1.0), (&self.solution.states, 1.0)];
            for (counted, (states, sign)) in part.energies.into_iter().zip(ends) {
                if let Some(counted) = counted {
                    balance.discretisation += sign * (counted - energy::total(world, states));
                }
            }
        }
        balance
    }

    /// States, wrenches, contacts and forces, to be certified.
    #[must_use]
    pub fn claim(&self) -> Claim<'_> {
        let Self { states, wrenches, contacts, solution, .. } = self;
        let (next, joints, gears) = (&solution.states, &solution.joints, &solution.gears);
        Claim { states, next, wrenches, contacts, joints, gears }
    }

    /// Removes the body `index` and its contacts.
    pub(super) fn leave_out(&mut self, index: usize, joints: &[bool], gears: &[bool]) {
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
        self.part = None;
    }
}
