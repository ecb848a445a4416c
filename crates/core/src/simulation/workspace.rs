//! Memory that steps use again. What an interval leaves in it changes no later result.

use super::Motion;
use super::abrupt::AbruptChanges;
use super::bounce::Bounce;
use super::moment::Moment;
use super::rest::RestingBodies;
use super::stiffness::Stiffness;
use super::unphysical::EnergyCheck;
use crate::contact::certificate::Certifier;
use crate::contact::{Candidates, Memory};
use crate::mechanics::{State, Wrench};
use crate::step::StepSolution;
use crate::world::World;

/// The solver and the scratch memory of steps, and what is known of bodies at rest.
pub(super) struct Workspace<'a> {
    pub motion: Motion<'a>,
    /// External wrench on each body in the interval.
    pub wrenches: Vec<Wrench>,
    /// States after free flight.
    pub free: Vec<State>,
    pub candidates: Candidates,
    /// State of the contact search before an interval that may not be taken.
    pub rewind: Memory,
    pub bounce: Bounce,
    /// Solution of the interval.
    pub solution: Box<StepSolution>,
    pub certifier: Certifier,
    pub energy_check: EnergyCheck,
    pub stiffness: Stiffness,
    pub abrupt: AbruptChanges,
    pub rest: RestingBodies,
}

/// True for an interval of the usual length after others of this length.
pub(super) fn is_regular(world: &World) -> bool {
    world.span().is_none() && world.before().is_empty()
}

impl<'a> Workspace<'a> {
    pub fn new(motion: Motion<'a>) -> Self {
        Self {
            motion,
            wrenches: Vec::new(),
            free: Vec::new(),
            candidates: Candidates::new(),
            rewind: Memory::default(),
            bounce: Bounce::default(),
            solution: Box::default(),
            certifier: Certifier::new(),
            energy_check: EnergyCheck::default(),
            stiffness: Stiffness::default(),
            abrupt: AbruptChanges::default(),
            rest: RestingBodies::new(),
        }
    }

    /// Prepares for an interval that does not start where the last one ended.
    pub fn forget(&mut self) {
        self.rest.end();
        self.candidates.forget();
    }

    /// Notes the start of an interval for [`RestingBodies`].
    pub fn begin_rest(&mut self, moment: &Moment) {
        let Motion::Contact { solver, .. } = &mut self.motion else { return };
        let Moment { now, before, search, .. } = moment;
        self.rest.begin(now, before.as_deref(), search, solver.as_mut(), &self.wrenches);
    }

    /// Prepares to set the contacts of bodies at rest aside in an interval of `world` from `moment`. Returns true if
    /// they are.
    pub fn set_aside(&mut self, world: &World, moment: &Moment) -> bool {
        let is_usual = is_regular(world) && !moment.is_infeasible && moment.failures.is_empty();
        self.candidates.set_aside(if is_usual { self.rest.bodies() } else { &[] })
    }

    /// True if steps have contacts.
    pub fn has_contacts(&self) -> bool {
        matches!(self.motion, Motion::Contact { .. })
    }

    /// Calls `work` with the contact search of `moment`.
    pub fn search<T>(
        &mut self,
        world: &World,
        memory: &mut Box<Memory>,
        work: impl FnOnce(&mut Candidates) -> T,
    ) -> T {
        self.candidates.exchange_memory(world, memory);
        let result = work(&mut self.candidates);
        self.candidates.return_memory(memory);
        result
    }
}
