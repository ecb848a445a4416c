//! What the joints of a run came to.

use crate::mechanics::State;
use crate::world::World;
use serde::{Deserialize, Serialize};
use std::fmt;

/// The largest of all steps and joints.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct JointsSummary {
    /// How far one was off after a step, m.
    pub largest_error_m: f64,
    /// The same of angles, rad.
    pub largest_error_rad: f64,
    /// Their part of the residual, m/s: of what is locked.
    pub largest_residual_m_s: f64,
    /// The same of what drives act on.
    pub largest_law_residual_m_s: f64,
    /// h ω, see [`StepRecord::stiffness`](crate::simulation::StepRecord::stiffness).
    pub largest_stiffness: f64,
}

/// The larger one; NaN where either is.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

impl JointsSummary {
    /// Adds how far the joints of `world` are off at `states`, where a step ended.
    pub fn add_errors(&mut self, world: &World, states: &[State]) {
        for joint in world.joints() {
            let (place, turn) = joint.error(states).unwrap_or((f64::NAN, f64::NAN));
            self.largest_error_m = larger(self.largest_error_m, place);
            self.largest_error_rad = larger(self.largest_error_rad, turn);
        }
    }

    /// Adds parts of a residual.
    pub fn add_residual(&mut self, locked: f64, drive: f64) {
        self.largest_residual_m_s = larger(self.largest_residual_m_s, locked);
        self.largest_law_residual_m_s = larger(self.largest_law_residual_m_s, drive);
    }

    /// Adds the stiffness of a step.
    pub fn add_stiffness(&mut self, stiffness: f64) {
        self.largest_stiffness = larger(self.largest_stiffness, stiffness);
    }

    /// Its numbers, by name.
    #[must_use]
    pub fn numbers(&self) -> [(&'static str, f64); 5] {
        [
            ("largest_error_m", self.largest_error_m),
            ("largest_error_rad", self.largest_error_rad),
            ("largest_residual_m_s", self.largest_residual_m_s),
            ("largest_law_residual_m_s", self.largest_law_residual_m_s),
            ("largest_stiffness", self.largest_stiffness),
        ]
    }
}

impl fmt::Display for JointsSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "off by at most {:.1e} m and {:.1e} rad; residual {:.1e} m/s, of drives {:.1e} m/s; h ω up to {:.1e}",
            self.largest_error_m,
            self.largest_error_rad,
            self.largest_residual_m_s,
            self.largest_law_residual_m_s,
            self.largest_stiffness
        )
    }
}
