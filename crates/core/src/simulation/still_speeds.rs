//! Speeds below which a motion stands still.

use nalgebra::Vector3;

/// Speeds (m/s or rad/s) below which a motion stands still.
#[derive(Debug, Clone, Copy)]
pub(super) struct StillSpeeds {
    /// Speed at the start of a step, to which its velocities are known.
    pub before: f64,
    /// Speed in a step.
    pub now: f64,
}

impl StillSpeeds {
    /// Speeds that move a point at this distance (m) from an axis as fast.
    pub fn about(self, reach: f64) -> Self {
        Self { before: self.before / reach, now: self.now / reach }
    }

    /// True if a motion ends or turns back from `before` to `now`, or at the `end` of the step. Without one, it would
    /// do so in half of another step: `kick` is the time of the change, in lengths of the interval.
    pub fn ends(
        self,
        before: &Vector3<f64>,
        now: &Vector3<f64>,
        end: Option<Vector3<f64>>,
        kick: f64,
    ) -> bool {
        let along = now.dot(before);
        let turns_soon = || match end {
            Some(end) => now.dot(&end) < 0.0,
            None => (1.0 + 2.0 * kick) * now.norm_squared() < along,
        };
        before.norm() > self.before && (now.norm() <= self.now || along < 0.0 || turns_soon())
    }
}
