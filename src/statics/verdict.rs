//! Verdicts: equilibrium, none, or undecided.

use super::certificate::{ForceState, Mechanism};
use super::conic::Goal;
use super::loads::LoadCase;
use super::structure::Structure;

/// Answer of statics.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// Forces balance all bodies: the structure can stand.
    Equilibrium(ForceState),
    /// No forces do: the structure must move.
    None(Mechanism),
    /// Neither certificate was found.
    Undecided,
}

impl Verdict {
    /// Name of the verdict.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Equilibrium(_) => "equilibrium",
            Self::None(_) => "none",
            Self::Undecided => "undecided",
        }
    }
}

impl Structure {
    /// Verdict under the loads of the scene.
    pub fn verdict(&self) -> Verdict {
        self.verdict_under(&self.loads)
    }

    /// Verdict under `loads`, which replace those of the scene.
    pub fn verdict_under(&self, loads: &LoadCase) -> Verdict {
        if loads.wrenches.len() != self.masses.len() {
            return Verdict::Undecided;
        }
        for goal in [Goal::LeastForces, Goal::LeastImbalance] {
            let Some(found) = self.solve(loads, &goal) else { continue };
            if self.check_forces(&found.forces, loads).holds {
                return Verdict::Equilibrium(found.forces);
            }
            if self.check_mechanism(&found.mechanism, loads).holds {
                return Verdict::None(self.scaled_to_one(found.mechanism));
            }
        }
        Verdict::Undecided
    }

    /// Mechanism scaled to a largest speed of 1 m/s.
    fn scaled_to_one(&self, mechanism: Mechanism) -> Mechanism {
        let speed = self.speed(&mechanism.velocities);
        mechanism.times(1.0 / speed)
    }
}
