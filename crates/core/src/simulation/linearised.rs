//! Derivative of the last step.

use super::{Interval, Simulation, StepRecord, Undo};
use crate::error::Error;
use crate::mechanics::State;
use crate::solver::native::StepDerivative;
use crate::step::Step;
use crate::world::Impacts;

impl Simulation<'_> {
    /// Computes the derivative of the last step, described by `record`, into `derivative`. Its
    /// arguments are the states, the wrenches and the constants of the world. The simulation is
    /// unchanged.
    ///
    /// # Errors
    /// If `record` is not the last step, if [`StepDerivative::linearise`] fails, for
    /// [`Motion::Floating`](super::Motion::Floating), which has no derivative, or for a run with velocities of the instant
    /// ([`Simulation::use_middle_velocities`]).
    pub fn linearise(
        &self,
        record: &StepRecord,
        derivative: &mut StepDerivative,
    ) -> Result<(), Error> {
        let refused = |why| Err(Error::Unsupported { what: "the derivative of this step", why });
        let bodies = self.world.bodies().len();
        let is_last = record.index + 1 == self.moment.index;
        if matches!(self.undo, Undo::Impossible) || !is_last || record.states().len() != bodies {
            return refused(
                "only the last step has one; call this right after the step, with its record",
            );
        }
        if self.moment.instants.is_some() {
            return refused(
                "it is a function of middle velocities; call use_middle_velocities before the step",
            );
        }
        self.check_motion()?;
        if self.world.impacts() == Impacts::Located || record.is_divided() {
            return refused("a step in intervals has none; ask for the gradient of the run");
        }
        let mut free = derivative.take_flights();
        let taken = record.first();
        let step = self.recorded_interval(taken, &mut free);
        let found = derivative.linearise(&step, &taken.contacts, &taken.solution);
        derivative.keep_flights(free);
        found
    }

    /// Refuses the Runge–Kutta method.
    pub(super) fn check_motion(&self) -> Result<(), Error> {
        if self.workspace.has_contacts() {
            return Ok(());
        }
        let why = "the Runge-Kutta method has no derivative; use the contact step";
        Err(Error::Unsupported { what: "the derivative of this step", why })
    }

    /// Problem of the interval `taken`, in the present world. `free` receives its free flights.
    pub(super) fn recorded_interval<'s>(
        &'s self,
        taken: &'s Interval,
        free: &'s mut Vec<State>,
    ) -> Step<'s> {
        let Interval { states, wrenches, solution, .. } = taken;
        let world = &self.world;
        let flights = states.iter().zip(wrenches).enumerate();
        free.clear();
        free.extend(flights.map(|(i, (state, wrench))| world.free_flight(i, state, wrench)));
        let interrupt = self.inputs.interrupt.as_deref();
        Step { world, states, wrenches, free, previous: solution, earlier: None, interrupt }
    }
}
