//! What takes the steps of a simulation.

use crate::contact::Detection;
#[cfg(feature = "save")]
use crate::error::Error;
use crate::solver::native::NativeSolver;
use crate::step::StepSolver;
use crate::world::World;

/// What moves the bodies from one step to the next. Its solver must be made for the world of
/// the simulation.
pub enum Motion<'a> {
    /// The contact step, with a rule for the candidates and a solver.
    Contact {
        /// Which points may touch.
        detection: Detection,
        /// Who solves the step.
        solver: Box<dyn StepSolver + 'a>,
    },
    /// Fourth-order Runge–Kutta, no ground.
    Floating,
}

impl<'a> Motion<'a> {
    /// Contact by `solver`, with the usual rule for the candidates.
    #[must_use]
    pub fn contact(solver: impl StepSolver + 'a) -> Self {
        Self::Contact { detection: Detection::default(), solver: Box::new(solver) }
    }

    /// Contact by tumble's own solver, with the usual rule for the candidates.
    #[must_use]
    pub fn native(world: &World) -> Self {
        Self::contact(NativeSolver::new(world))
    }

    /// What its solver remembers.
    #[cfg(feature = "save")]
    pub(super) fn memory(&self) -> Vec<u8> {
        match self {
            Self::Contact { solver, .. } => solver.memory(),
            Self::Floating => Vec::new(),
        }
    }

    /// Has its solver go on from what it remembered in `world`.
    #[cfg(feature = "save")]
    pub(super) fn recall(&mut self, world: &World, memory: &[u8]) -> Result<(), Error> {
        match self {
            Self::Contact { solver, .. } => solver.recall(world, memory),
            Self::Floating => Ok(()),
        }
    }
}
