//! Time-dependent joint inputs: forces along joint axes, and prescribed motions of world frames.

use super::JointFrame;
use crate::error::{Error, all_in_range, in_range};
use crate::mechanics::load::first_isolated;
use crate::mechanics::{Polyline, State, trajectory::Trajectory};
use nalgebra::{Vector3, Vector4};

/// Forces along the linear axes and torques about the angular axes of a joint over time, in
/// addition to its drives, for
/// [`Simulation::set_joint_load`](crate::simulation::Simulation::set_joint_load).
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct JointLoad {
    /// Force on A along x, y and z of B's frame (N).
    pub force: Polyline,
    /// Torque on A about the angular axes (N m).
    pub torque: Polyline,
}

impl JointLoad {
    /// Means over the times `from`…`to` (s).
    pub(crate) fn mean(&self, from: f64, to: f64) -> [Vector3<f64>; 2] {
        [self.force.mean(from, to), self.torque.mean(from, to)]
    }

    /// True if both polylines are valid for [`Polyline::new`].
    #[cfg(feature = "save")]
    pub(crate) fn is_possible(&self) -> bool {
        let line = |line: &Polyline| Polyline::new(line.knots().to_vec()).is_ok();
        line(&self.force) && line(&self.torque)
    }

    /// First isolated jump of a force within the times `within` (s); see [`first_isolated`].
    pub(crate) fn jump_in(&self, within: [f64; 2], apart: f64) -> Option<f64> {
        let lines = [&self.force, &self.torque].into_iter();
        lines.filter_map(|line| line.jump_in(within, apart)).reduce(f64::min)
    }

    /// Flags of the linear and the angular axes on which it acts at any time.
    pub(crate) fn acts(&self) -> [[bool; 3]; 2] {
        [&self.force, &self.torque].map(|line| {
            let acts = |k: usize| line.knots().iter().any(|(_, value)| value[k] != 0.0);
            std::array::from_fn(acts)
        })
    }
}

/// Prescribed motion of the world frame of a joint that locks a body in all axes, for
/// [`Simulation::set_course`](crate::simulation::Simulation::set_course).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum Course {
    /// Pose at the end of the next step, kept afterwards.
    To(JointFrame),
    /// Motion at constant velocity from the present pose.
    Steady {
        /// Velocity of the anchor (m/s), world frame.
        velocity: Vector3<f64>,
        /// Angular velocity (rad/s), world frame.
        spin: Vector3<f64>,
    },
    /// Trajectory evaluated at the end of every step.
    Through(Knots),
}

/// Trajectory of a frame. Between two knots, the anchor moves on a straight line, and the frame
/// rotates at a constant rate about one axis, by the smaller angle. The frame rests before the
/// first knot. After the last one it rests too, or [continues](Knots::going_on) at constant
/// velocity.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Knots {
    knots: Vec<(f64, JointFrame)>,
    /// Velocity of the anchor after the last knot (m/s), world frame.
    velocity: Vector3<f64>,
    /// Angular velocity after the last knot (rad/s), world frame.
    spin: Vector3<f64>,
}

/// Largest number of knots.
const MOST_KNOTS: usize = 1_000_000;

impl Knots {
    /// Creates a trajectory from times (s) and frames (world frame).
    ///
    /// # Errors
    /// If the number of knots is not 1 to 1 000 000, if times do not increase or are beyond ±1e6 s,
    /// or if a frame is out of range.
    pub fn new(knots: Vec<(f64, JointFrame)>) -> Result<Self, Error> {
        if knots.is_empty() || knots.len() > MOST_KNOTS {
            let field = "knots of a prescribed motion";
            return Err(Error::Count { field, count: knots.len(), allowed: "1 to 1000000" });
        }
        let mut latest = -1e6_f64;
        let checked = knots.into_iter().enumerate().map(|(index, (time, frame))| {
            let first = if index == 0 { latest } else { latest.next_up() };
            let allowed = "-1e6 to 1e6, later than the previous knot";
            latest = in_range("time of a prescribed motion (s)", time, first, 1e6, allowed)?;
            Ok((time, frame.checked()?))
        });
        let knots = checked.collect::<Result<_, Error>>()?;
        Ok(Self { knots, velocity: Vector3::zeros(), spin: Vector3::zeros() })
    }

    /// Returns this trajectory with a constant `velocity` of the anchor (m/s, world frame) and
    /// `spin` (rad/s, world frame) after the last knot. With a single knot it describes a
    /// turntable.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if a component is beyond ±1e5.
    pub fn going_on(self, velocity: Vector3<f64>, spin: Vector3<f64>) -> Result<Self, Error> {
        check_velocities(&velocity, &spin)?;
        Ok(Self { velocity, spin, ..self })
    }

    /// First isolated jump of the velocity within the times `within` (s); see [`first_isolated`].
    pub(crate) fn jump_in(&self, within: [f64; 2], apart: f64) -> Option<f64> {
        let first = self.knots.partition_point(|(knot, _)| *knot <= within[0] - apart);
        first_isolated(self.knots[first..].iter().map(|(knot, _)| *knot), within, apart)
    }

    /// Frame at `time` (s).
    pub fn at(&self, time: f64) -> JointFrame {
        let next = self.knots.partition_point(|(knot, _)| *knot <= time);
        let before = next.checked_sub(1).and_then(|last| self.knots.get(last));
        match (before, self.knots.get(next)) {
            (Some((from, a)), Some((to, b))) => a.towards(b, (time - from) / (to - from)),
            (Some((last, frame)), None) => frame.after(&self.velocity, &self.spin, time - last),
            (None, Some((_, frame))) => *frame,
            (None, None) => JointFrame::at(Vector3::zeros()),
        }
    }
}

impl JointFrame {
    /// Interpolates between this frame and `other` at the fraction `share`.
    fn towards(&self, other: &Self, share: f64) -> Self {
        let state =
            |frame: &Self| State { attitude: frame.attitude, ..State::at_rest(frame.anchor) };
        let (anchor, attitude) = Trajectory::between(&state(self), &state(other)).placed(share);
        Self { anchor, attitude: attitude.normalize() }
    }

    /// Frame after `time` (s) at constant velocities (m/s and rad/s, world frame).
    fn after(&self, velocity: &Vector3<f64>, spin: &Vector3<f64>, time: f64) -> Self {
        let anchor = self.anchor + velocity * time;
        let (angle, rate) = (spin.norm() * time, spin.norm());
        if rate == 0.0 {
            return Self { anchor, ..*self };
        }
        let (sine, cosine) = libm::sincos(0.5 * angle);
        let axis = spin * (sine / rate);
        let turn = Vector4::new(cosine, axis[0], axis[1], axis[2]);
        let attitude = crate::mechanics::quaternion::left(&turn) * self.attitude;
        Self { anchor, attitude: attitude.normalize() }
    }
}

fn check_velocities(velocity: &Vector3<f64>, spin: &Vector3<f64>) -> Result<(), Error> {
    all_in_range("velocity of a prescribed motion (m/s)", velocity, -1e5, 1e5, "-1e5 to 1e5")?;
    all_in_range("spin of a prescribed motion (rad/s)", spin, -1e5, 1e5, "-1e5 to 1e5")
}

impl Course {
    /// Checks the ranges of all numbers.
    pub(crate) fn checked(self) -> Result<Self, Error> {
        match &self {
            Self::To(frame) => return Ok(Self::To(frame.checked()?)),
            Self::Steady { velocity, spin } => check_velocities(velocity, spin)?,
            Self::Through(_) => {}
        }
        Ok(self)
    }

    /// Frame at the end of a step of `time_step` (s) that starts with the frame `now` and ends at
    /// the time `end` (s).
    pub(crate) fn end(&self, now: &JointFrame, end: f64, time_step: f64) -> JointFrame {
        match self {
            Self::To(frame) => *frame,
            Self::Steady { velocity, spin } => now.after(velocity, spin, time_step),
            Self::Through(knots) => knots.at(end),
        }
    }
}
