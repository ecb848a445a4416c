//! Time of a run from which it can continue.

use super::accuracy::Pace;
use super::interval::Interval;
use super::leapfrog::Instants;
use crate::contact::Memory;
use crate::joint::JointForce;
use crate::mechanics::State;
use crate::step::StepSolution;
use crate::world::{Integrator, World};
use std::mem::{swap, take};

/// A time of a run, from which it can continue. Two runs of one world that continue from equal
/// moments with equal inputs are equal to the last bit. Solutions and the search are boxed, because each
/// interval exchanges them.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Moment {
    /// Index k of the next step.
    pub index: u64,
    /// Solution that ended here: the states from which the next interval starts, and the forces
    /// before. [`Step::previous`](crate::step::Step::previous) of the next problem.
    pub now: Box<StepSolution>,
    /// Solutions that ended one and two intervals before; `None` after a start or a step that was not solved
    /// at once.
    pub before: Option<Box<StepSolution>>,
    pub long_before: Option<Box<StepSolution>>,
    /// States with velocities of the instant, with [`Integrator::Leapfrog`](crate::world::Integrator::Leapfrog).
    pub instants: Option<Instants>,
    /// Lengths of intervals, with an accuracy or located impacts.
    pub pace: Pace,
    /// State of the contact search.
    pub search: Box<Memory>,
}

impl Moment {
    /// Start of a run of `world` at `states`. Only contact steps have velocities of the instant.
    pub fn at(world: &World, states: &[State], has_contacts: bool) -> Self {
        let angles = world.angles_near(states, &[]).into_iter();
        let joints = angles.map(JointForce::none).collect();
        let gears = vec![0.0; world.gears().len()];
        let is_leapfrog = has_contacts && world.integrator() == Integrator::Leapfrog;
        Self {
            now: Box::new(StepSolution { joints, gears, ..StepSolution::free(states) }),
            instants: is_leapfrog.then(|| Instants::at(states)),
            ..Self::default()
        }
    }

    /// States X, one per body, with the velocities of the instant.
    pub fn states(&self) -> &[State] {
        self.instants.as_ref().map_or(&self.now.states, |instants| &instants.states)
    }

    /// Moves on to the end of an interval with this solution. `solution` receives the oldest one,
    /// whose memory can be used again.
    pub fn move_on(&mut self, solution: &mut Box<StepSolution>) {
        swap(&mut self.now, solution);
        let Some(before) = &mut self.before else {
            self.before = Some(take(solution));
            return;
        };
        swap(before, solution);
        match &mut self.long_before {
            Some(long_before) => swap(long_before, solution),
            none => *none = Some(take(solution)),
        }
    }

    /// Returns to the start of `taken`, the last interval. The contact search stays. Without the
    /// solution before, nothing changes, and the result is false.
    pub fn move_back(&mut self, taken: &Interval) -> bool {
        let Some(before) = self.before.take() else { return false };
        self.now = before;
        self.before = self.long_before.take();
        if let Some(instants) = &mut self.instants {
            instants.take_back(&taken.instants);
        }
        true
    }

    /// All solutions that the next interval uses.
    pub fn solutions_mut(&mut self) -> impl Iterator<Item = &mut Box<StepSolution>> {
        let before = self.before.iter_mut().chain(&mut self.long_before);
        std::iter::once(&mut self.now).chain(before)
    }

    /// Forgets the solutions before, after an interval of another length.
    pub fn forget_past(&mut self) {
        (self.before, self.long_before) = (None, None);
    }
}
