//! Methods that advance a simulation.

use crate::contact::Detection;
#[cfg(feature = "save")]
use crate::error::Error;
use crate::solver::native::NativeSolver;
use crate::step::StepSolver;
use crate::world::World;

/// Method that advances the bodies by a step. Its solver must be made for the simulation's world.
pub enum Motion<'a> {
    /// Contact step with a detection rule and a solver.
    Contact {
        /// Rule for candidate contacts.
        detection: Detection,
        /// Solver of the step.
        solver: Box<dyn StepSolver + 'a>,
    },
    /// Fourth-order Runge–Kutta, without contacts.
    Floating,
}

impl<'a> Motion<'a> {
    /// Contact step with `solver` and the default detection rule.
    pub fn contact(solver: impl StepSolver + 'a) -> Self {
        Self::Contact { detection: Detection::default(), solver: Box::new(solver) }
    }

    /// Contact step with the native solver and the default detection rule.
    pub fn native(world: &World) -> Self {
        Self::contact(NativeSolver::new(world))
    }

    /// Serialised memory of the solver.
    #[cfg(feature = "save")]
    pub(super) fn memory(&self) -> Vec<u8> {
        match self {
            Self::Contact { solver, .. } => solver.memory(),
            Self::Floating => Vec::new(),
        }
    }

    /// Restores the solver in `world` from its serialised memory.
    #[cfg(feature = "save")]
    pub(super) fn recall(&mut self, world: &World, memory: &[u8]) -> Result<(), Error> {
        match self {
            Self::Contact { solver, .. } => solver.recall(world, memory),
            Self::Floating => Ok(()),
        }
    }
}
