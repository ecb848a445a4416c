//! Summary of the joints of a run.

use crate::output::tables::IntervalRows;
use serde::{Deserialize, Serialize};
use std::fmt;
use tumble_core::joint::JointForce;
use tumble_core::mechanics::State;
use tumble_core::simulation::Stiffness;
use tumble_core::world::World;

/// Maxima over all steps and joints.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct JointsSummary {
    /// Position error of a joint after a step (m).
    pub largest_error_m: f64,
    /// Angle error of a joint after a step (rad).
    pub largest_error_rad: f64,
    /// Residual of locked axes (m/s).
    pub largest_residual_m_s: f64,
    /// Residual of driven axes (m/s).
    pub largest_law_residual_m_s: f64,
    /// Stiffness number h ω, see
    /// [`Interval::stiffness`](tumble_core::simulation::Interval::stiffness).
    pub largest_stiffness: f64,
}

/// Maximum of both; NaN if one is NaN.
fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

impl JointsSummary {
    /// Adds the errors of the joints of `world` at `states`, the end of a step.
    pub fn add_errors(&mut self, world: &World, states: &[State]) {
        for joint in world.joints() {
            let (place, turn) = joint.error(states).unwrap_or((f64::NAN, f64::NAN));
            self.largest_error_m = larger(self.largest_error_m, place);
            self.largest_error_rad = larger(self.largest_error_rad, turn);
        }
    }

    /// Adds residuals of locked and driven axes (m/s).
    pub fn add_residual(&mut self, locked: f64, drive: f64) {
        self.largest_residual_m_s = larger(self.largest_residual_m_s, locked);
        self.largest_law_residual_m_s = larger(self.largest_law_residual_m_s, drive);
    }

    /// Adds the stiffness and the residuals of a step of `world`. The residual of a gear is that of
    /// its constraint, or of its drive.
    pub fn add_rows(&mut self, world: &World, step: &IntervalRows) {
        self.add_stiffness(step.row.stiffness);
        for joint in &step.joints {
            self.add_residual(joint.residual.locked, joint.residual.drive);
        }
        for (row, gear) in step.gears.iter().zip(world.gears()) {
            match gear.drive() {
                None => self.add_residual(row.residual, 0.0),
                Some(_) => self.add_residual(0.0, row.residual),
            }
        }
    }

    /// Adds the stiffness number of a step.
    pub fn add_stiffness(&mut self, stiffness: f64) {
        self.largest_stiffness = larger(self.largest_stiffness, stiffness);
    }

    /// Values with the names of their fields.
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
            "off by at most {:.1e} m and {:.1e} rad; residual {:.1e} m/s, drives {:.1e} m/s; h ω \
             up to {:.1e}",
            self.largest_error_m,
            self.largest_error_rad,
            self.largest_residual_m_s,
            self.largest_law_residual_m_s,
            self.largest_stiffness
        )
    }
}

/// Limit of h ω. Above it the motion of a tensioned joint becomes unstable.
pub const STIFFEST: f64 = 2.0;
/// Ratio of h ω to the limit at the recommended time step.
const MARGIN: f64 = 0.95;

/// Detects joints that are too stiff in two consecutive steps. An impact can cause a single such
/// step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct StiffJointReport {
    /// Stiffness number h ω of each joint in the last step; empty if all were below the limit.
    before: Vec<f64>,
    /// Largest h ω that each joint had in two consecutive steps.
    lasting: Vec<f64>,
}

/// Joint that was too stiff for the time step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StiffJoint {
    /// Index of the joint.
    pub joint: usize,
    /// Largest h ω over two consecutive steps.
    pub stiffness: f64,
    /// Recommended time step (s), at which h ω would be below the limit.
    pub time_step_s: f64,
}

impl StiffJointReport {
    /// Adds a step of `world` from `states` with the forces of its joints and gears.
    ///
    /// `stiffness` is the largest h ω of the step.
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
        let now = Stiffness::default().per_joint(world, states, joints, gears);
        self.lasting.resize(now.len(), 0.0);
        let both = self.before.iter().zip(&now).map(|(before, now)| before.min(*now));
        self.lasting.iter_mut().zip(both).for_each(|(most, both)| *most = most.max(both));
        self.before = now;
    }

    /// Joints that were too stiff for steps of `h` (s).
    pub fn joints(&self, h: f64) -> Vec<StiffJoint> {
        let lasting = self.lasting.iter().enumerate();
        let of = |(joint, stiffness): (usize, &f64)| {
            let time_step_s = MARGIN * STIFFEST * h / stiffness;
            StiffJoint { joint, stiffness: *stiffness, time_step_s }
        };
        lasting.filter(|(_, most)| **most > STIFFEST).map(of).collect()
    }
}
