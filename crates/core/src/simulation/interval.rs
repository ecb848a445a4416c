//! Record of an interval: one solved problem of a step.

use super::driving::{AxisDrive, exchange_drives};
use super::instants::AddedError;
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
    /// Length (s).
    pub length: f64,
    /// States from which the interval starts. With
    /// [`Integrator::Leapfrog`](crate::world::Integrator::Leapfrog) their velocities are those of the
    /// middle of the interval before.
    pub states: Vec<State>,
    /// States at its start with the velocities of the instant; empty if `states` has them.
    pub instants: Vec<State>,
    /// States at its end with the velocities of the instant; empty if `solution` has them.
    pub ends: Vec<State>,
    /// Bodies whose velocities of the instant at its end are extrapolated (eq. 37a); empty without
    /// such velocities.
    pub extrapolated: Vec<bool>,
    /// Lengths of the intervals to whose middles the velocities in `states` belong (s), 0 for bodies that
    /// start; empty if all are its own.
    pub before: Vec<f64>,
    /// Drives in it at axes whose drives changed at its start.
    pub drives: Vec<AxisDrive>,
    /// Wrenches on the bodies besides gravity. Those of bodies with another length
    /// [before](Self::before) have what gravity and the gyroscopic term lack (eq. 37).
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
    /// Certificate that a failed step has no solution.
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
    /// Parts of the world that change, at its end.
    pub changeable: Changeable,
}

impl PartOfStep {
    /// Part of the record of the `states` without a step.
    pub fn at_the_end(world: &World, states: &[State]) -> Self {
        let energies = [Some(energy::at_instant(world, states)), None];
        Self { energies, changeable: world.changeable() }
    }
}

/// Time κ over which forces on `body`, or between it and `other`, act, in lengths of their interval (eq. 37).
/// `before` has the lengths of the intervals before (s), and none where they are the present `length` (s).
pub fn kick(before: &[f64], length: f64, body: usize, other: Option<usize>) -> f64 {
    let before = |body: usize| before.get(body).copied().unwrap_or(length);
    let before = other.map_or(f64::INFINITY, before).min(before(body));
    if before == length { 1.0 } else { 0.5 * (1.0 + before / length) }
}

/// Times Σ κ h over which the forces on each of `bodies` act in a step (s). Its intervals are given by their
/// lengths before and own ones.
pub fn acting_times<'a>(
    bodies: usize,
    intervals: impl Iterator<Item = (&'a [f64], f64)>,
) -> Vec<f64> {
    let mut times = vec![0.0; bodies];
    for (before, length) in intervals {
        let all = times.iter_mut().enumerate();
        all.for_each(|(body, time)| *time += length * kick(before, length, body, None));
    }
    times
}

impl Default for Interval {
    fn default() -> Self {
        Self {
            span: None,
            length: 0.0,
            states: Vec::new(),
            instants: Vec::new(),
            ends: Vec::new(),
            extrapolated: Vec::new(),
            before: Vec::new(),
            drives: Vec::new(),
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
    pub fn new(states: Vec<State>, contacts: Vec<Contact>, solution: StepSolution) -> Self {
        Self { states, contacts, solution, ..Self::default() }
    }

    /// States at its start with the velocities of the instant.
    pub fn instant_states(&self) -> &[State] {
        if self.instants.is_empty() { &self.states } else { &self.instants }
    }

    /// States at its end with the velocities of the instant (eq. 37a).
    pub fn end_states(&self) -> &[State] {
        if self.ends.is_empty() { &self.solution.states } else { &self.ends }
    }

    /// Growth of the estimated error (40) of the body with the largest one (m).
    pub fn error(&self) -> f64 {
        self.errors.smooth.max(self.errors.abrupt)
    }

    /// True if impacts of a body follow each other so closely that they may come in the other order
    /// in the exact motion.
    pub fn is_ambiguous(&self) -> bool {
        self.errors.is_ambiguous
    }

    /// The `world` of the run as this interval was taken in it. Prescribed motions of a step of one
    /// interval must be at its end.
    pub fn world<'w>(&self, world: &'w World) -> Cow<'w, World> {
        if self.part.is_none() && self.before.is_empty() && self.drives.is_empty() {
            return Cow::Borrowed(world);
        }
        let mut world = world.clone();
        world.set_span(self.span);
        if let Some(part) = &self.part {
            world.set_changeable(&part.changeable);
        }
        if !self.before.is_empty() {
            world.set_before(self.before.iter().copied());
        }
        exchange_drives(&mut world, &mut self.drives.clone());
        Cow::Owned(world)
    }

    /// Energy at its start as the rows of a run count it (J). `world` is its [world](Self::world).
    pub fn energy(&self, world: &World) -> f64 {
        let counted = self.part.as_ref().and_then(|part| part.energies[0]);
        counted.unwrap_or_else(|| energy::at_start(world, &self.states))
    }

    /// Energy at its end as the rows of a run count it (J). `world` is its [world](Self::world).
    pub fn end_energy(&self, world: &World) -> f64 {
        let counted = self.part.as_ref().and_then(|part| part.energies[1]);
        counted.unwrap_or_else(|| energy::total(world, &self.solution.states))
    }

    /// Terms of the energy balance (36) (J) in its [world](Self::world). They sum up to the
    /// difference of [energies](Self::energy), also where lengths of intervals change.
    pub fn balance(&self, world: &World) -> EnergyBalance {
        let mut balance = EnergyBalance::new(world, &self.claim(), self.solution.loads());
        let [start, end] = [&self.states, &self.solution.states].map(|of| energy::total(world, of));
        balance.discretisation += start - self.energy(world) + self.end_energy(world) - end;
        balance
    }

    /// Time κ over which the forces of a contact of `body`, or between it and `other`, act, in lengths of the
    /// interval ([`World::kick`]). Forces of its solution are impulses divided by its length.
    pub fn kick(&self, body: usize, other: Option<usize>) -> f64 {
        kick(&self.before, self.length, body, other)
    }

    /// Flags of bodies with forces of contacts or with joints.
    pub(super) fn held_bodies(&self, world: &World) -> Vec<bool> {
        let mut held = vec![false; self.solution.states.len()];
        let forces = self.solution.contacts.iter().filter(|force| force.carries_force());
        forces.flat_map(|force| force.key.bodies()).for_each(|body| held[body] = true);
        let joints = world.joints().iter();
        joints
            .flat_map(|joint| [Some(joint.body()), joint.other()])
            .flatten()
            .for_each(|body| held[body] = true);
        held
    }

    /// States, wrenches, contacts and forces, to be certified.
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
        if index < self.ends.len() {
            self.ends.remove(index);
        }
        if index < self.before.len() {
            self.before.remove(index);
        }
        let renumbered = |contact: &Contact| {
            let key = contact.key.renumbered(|body| without(body, index))?;
            Some(Contact { key, ..*contact })
        };
        self.contacts = self.contacts.iter().filter_map(renumbered).collect();
        self.solution.leave_out(index, joints, gears);
        self.drives.clear();
        self.part = None;
    }
}
