//! What the joints of a run came to.

use serde::{Deserialize, Serialize};
use std::fmt;
use tumble_core::joint::{Gear, JointForce};
use tumble_core::mechanics::State;
use tumble_core::simulation::Stiffness;
use tumble_core::world::World;

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
    /// h ω, see [`StepRecord::stiffness`](tumble_core::simulation::StepRecord::stiffness).
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

    /// Adds the residual of a gear: of its tie, or of its law.
    pub fn add_gear(&mut self, gear: &Gear, residual: f64) {
        match gear.drive() {
            None => self.add_residual(residual, 0.0),
            Some(_) => self.add_residual(0.0, residual),
        }
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

/// The h ω above which what a joint holds taut shakes itself to pieces, if it stays above.
pub const STIFFEST: f64 = 2.0;
/// What a time step that would do has of this.
const MARGIN: f64 = 0.95;

/// Which joints were too stiff for the time step, in two steps one after the other: an impact may be for one.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Taut {
    /// h ω of each joint in the last step; none where no joint was too stiff in it.
    before: Vec<f64>,
    /// The largest that each joint had in two steps running.
    lasting: Vec<f64>,
}

/// A joint that was too stiff for the time step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TautJoint {
    /// Its index.
    pub joint: usize,
    /// h ω in two steps running.
    pub stiffness: f64,
    /// The time step at which it would have been less than 2, s.
    pub time_step_s: f64,
}

impl Taut {
    /// Adds a step of `world` from `states` with these forces of joints and gears, in which the stiffest joint has `stiffness`.
    pub fn add(
        &mut self,
        world: &World,
        states: &[State],
        joints: &[JointForce],
        gears: &[f64],
        stiffness: f64,
    ) {
        if stiffness <= STIFFEST {
            self.before.clear();
            return;
        }
        let now = Stiffness::default().of_each_joint(world, states, joints, gears);
        self.lasting.resize(now.len(), 0.0);
        let both = self.before.iter().zip(&now).map(|(before, now)| before.min(*now));
        self.lasting.iter_mut().zip(both).for_each(|(most, both)| *most = most.max(both));
        self.before = now;
    }

    /// The joints that were too stiff for steps of `h` (s).
    #[must_use]
    pub fn joints(&self, h: f64) -> Vec<TautJoint> {
        let lasting = self.lasting.iter().enumerate();
        let of = |(joint, stiffness): (usize, &f64)| {
            let time_step_s = MARGIN * STIFFEST * h / stiffness;
            TautJoint { joint, stiffness: *stiffness, time_step_s }
        };
        lasting.filter(|(_, most)| **most > STIFFEST).map(of).collect()
    }
}
