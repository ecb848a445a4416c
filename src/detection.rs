//! Which contact points may carry a force in a step: the flags α, which a
//! [`StepSolver`](crate::solver::StepSolver) gets.

use crate::model::ContactModel;
use crate::state::State;

/// A contact point at or below this height (m) at step k is flagged.
pub const CONTACT_BAND: f64 = 0.005;

/// The rule by which contact points are flagged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Detection {
    /// The tutorial's rule: z_k ≤ 5 mm. A fast point can jump the band in one step; it
    /// then meets z⁺ ≥ 0 with its force clamped to zero, which has no solution.
    Height,
    /// The same, or the height after a free flight step is ≤ 0.
    #[default]
    Predictive,
}

impl Detection {
    /// Sets `active`, one flag a contact point, for a step from `state` whose free flight
    /// would end in `free`, both in the ground's frame.
    /// Returns whether the step needs a contact problem: whether any point is flagged,
    /// or free flight would take an unflagged one below the ground.
    pub fn flag(
        self,
        model: &ContactModel,
        state: &State,
        free: &State,
        active: &mut [bool],
    ) -> bool {
        let mut needs_contact = false;
        let now = model.contact_heights(state);
        let then = model.contact_heights(free);
        for ((flag, now), then) in active.iter_mut().zip(now).zip(then) {
            *flag = now <= CONTACT_BAND || (self == Self::Predictive && then <= 0.0);
            needs_contact |= *flag || then < 0.0;
        }
        needs_contact
    }

    /// The word of the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Height => "height",
            Self::Predictive => "predictive",
        }
    }
}
