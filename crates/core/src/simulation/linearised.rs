//! The derivative of the last step.

use super::{Motion, Simulation, StepRecord};
use crate::error::Error;
use crate::mechanics::State;
use crate::solver::native::StepDerivative;
use crate::step::Step;

impl Simulation<'_> {
    /// Makes `derivative` that of the last step, which `record` describes: by its states, its wrenches, and the
    /// constants of the world. The simulation goes on as without it.
    ///
    /// # Errors
    /// A record of another step than the last one; [`StepDerivative::linearise`]; a body that floats, whose
    /// Runge–Kutta step has no derivative here.
    pub fn linearise(
        &self,
        record: &StepRecord,
        derivative: &mut StepDerivative,
    ) -> Result<(), Error> {
        let mut free = derivative.take_flights();
        let found = self.with_step(record, &mut free, |step| {
            derivative.linearise(step, &record.contacts, &record.solution)
        });
        derivative.keep_flights(free);
        found?
    }

    /// What `then` makes of the last step, which `record` describes; `free` is memory.
    pub(super) fn with_step<T>(
        &self,
        record: &StepRecord,
        free: &mut Vec<State>,
        then: impl FnOnce(&Step<'_>) -> T,
    ) -> Result<T, Error> {
        let refused = |why| Err(Error::Unsupported { what: "the derivative of this step", why });
        let bodies = self.world.bodies().len();
        if self.taken_back || record.index + 1 != self.index || record.states.len() != bodies {
            return refused(
                "it is that of the last step alone: ask right after it, with its record",
            );
        }
        if matches!(self.motion, Motion::Floating) {
            return refused("the Runge-Kutta method has none; use the contact step");
        }
        let (world, wrenches, states) = (&self.world, &self.scratch.wrenches, &record.states);
        let flights = states.iter().zip(wrenches).enumerate();
        free.clear();
        free.extend(flights.map(|(i, (state, wrench))| world.free_flight(i, state, wrench)));
        let step = Step {
            world,
            states,
            wrenches,
            free,
            previous: &record.solution,
            earlier: None,
            interrupt: self.interrupt.as_deref(),
        };
        Ok(then(&step))
    }
}
