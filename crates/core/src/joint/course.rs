//! What drives joints over time: forces along their axes, and the way of what a body is held by.

use super::JointFrame;
use crate::error::{Error, all_in_range, in_range};
use crate::mechanics::{Polyline, State, way::Way};
use nalgebra::{Vector3, Vector4};

/// Forces along the axes of a joint's place and torques about those of its turn over time, besides those of its
/// drives, for [`Simulation::set_joint_load`](crate::simulation::Simulation::set_joint_load).
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct JointLoad {
    /// N, along x, y and z of B's frame, on A.
    pub force: Polyline,
    /// N m, about the axes of the turn, on A.
    pub torque: Polyline,
}

impl JointLoad {
    /// The means over `from`…`to` (s).
    pub(crate) fn mean(&self, from: f64, to: f64) -> [Vector3<f64>; 2] {
        [self.force.mean(from, to), self.torque.mean(from, to)]
    }

    /// Whether it is one that [`Polyline::new`] makes.
    #[cfg(feature = "save")]
    pub(crate) fn is_possible(&self) -> bool {
        let line = |line: &Polyline| Polyline::new(line.knots().to_vec()).is_ok();
        line(&self.force) && line(&self.torque)
    }

    /// Which of the axes it acts on at some time: those of the place, and those of the turn.
    pub(crate) fn acts(&self) -> [[bool; 3]; 2] {
        [&self.force, &self.torque].map(|line| {
            let acts = |k: usize| line.knots().iter().any(|(_, value)| value[k] != 0.0);
            std::array::from_fn(acts)
        })
    }
}

/// How the frame in the world moves that holds a body in all its axes, for
/// [`Simulation::set_course`](crate::simulation::Simulation::set_course).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum Course {
    /// It is there at the end of the next step, and stays.
    To(JointFrame),
    /// It moves on from where it is.
    Steady {
        /// Of its anchor, m/s, world.
        velocity: Vector3<f64>,
        /// rad/s, world.
        spin: Vector3<f64>,
    },
    /// It is where these say at the end of every step.
    Through(Knots),
}

/// A frame over time: between two knots its anchor goes straight and it turns evenly about one axis, the shorter
/// way; before the first it stays, and after the last, too, unless it [goes on](Knots::going_on) from there.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Knots {
    knots: Vec<(f64, JointFrame)>,
    /// After the last knot: of the anchor, m/s, world.
    velocity: Vector3<f64>,
    /// rad/s, world.
    spin: Vector3<f64>,
}

/// More knots than this are taken for a mistake.
const MOST_KNOTS: usize = 1_000_000;

impl Knots {
    /// Those of the times t (s) and the frames there (world).
    ///
    /// # Errors
    /// None, or more than a million; times that do not rise or are beyond ±1e6 s; a frame out of range.
    pub fn new(knots: Vec<(f64, JointFrame)>) -> Result<Self, Error> {
        if knots.is_empty() || knots.len() > MOST_KNOTS {
            let field = "knots of a course";
            return Err(Error::Count { field, count: knots.len(), allowed: "1 to 1000000" });
        }
        let mut latest = -1e6_f64;
        let checked = knots.into_iter().enumerate().map(|(index, (time, frame))| {
            let first = if index == 0 { latest } else { latest.next_up() };
            let allowed = "-1e6 to 1e6, after the knot before it";
            latest = in_range("time of a course (s)", time, first, 1e6, allowed)?;
            Ok((time, frame.checked()?))
        });
        let knots = checked.collect::<Result<_, Error>>()?;
        Ok(Self { knots, velocity: Vector3::zeros(), spin: Vector3::zeros() })
    }

    /// The same, which go on after the last knot at a steady `velocity` of the anchor (m/s, world) and `spin`
    /// (rad/s, world): with one knot, a turntable.
    ///
    /// # Errors
    /// A component beyond ±1e5.
    pub fn going_on(self, velocity: Vector3<f64>, spin: Vector3<f64>) -> Result<Self, Error> {
        check_velocities(&velocity, &spin)?;
        Ok(Self { velocity, spin, ..self })
    }

    /// The frame at `time` (s).
    #[must_use]
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
    /// The frame at the part `share` of the way to `other`.
    fn towards(&self, other: &Self, share: f64) -> Self {
        let state = |frame: &Self| State {
            position: frame.anchor,
            attitude: frame.attitude,
            velocity: Vector3::zeros(),
            spin: Vector3::zeros(),
        };
        let (anchor, attitude) = Way::between(&state(self), &state(other)).placed(share);
        Self { anchor, attitude: attitude.normalize() }
    }

    /// The frame after `time` (s) at these velocities (m/s, rad/s; world).
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
    all_in_range("velocity of a course (m/s)", velocity, -1e5, 1e5, "-1e5 to 1e5")?;
    all_in_range("spin of a course (rad/s)", spin, -1e5, 1e5, "-1e5 to 1e5")
}

impl Course {
    /// The course, checked.
    pub(crate) fn checked(self) -> Result<Self, Error> {
        match &self {
            Self::To(frame) => return Ok(Self::To(frame.checked()?)),
            Self::Steady { velocity, spin } => check_velocities(velocity, spin)?,
            Self::Through(_) => {}
        }
        Ok(self)
    }

    /// Where the frame is at the end of a step of `time_step` (s) that ends at `end` (s) and begins with
    /// the frame at `now`.
    pub(crate) fn end(&self, now: &JointFrame, end: f64, time_step: f64) -> JointFrame {
        match self {
            Self::To(frame) => *frame,
            Self::Steady { velocity, spin } => now.after(velocity, spin, time_step),
            Self::Through(knots) => knots.at(end),
        }
    }
}
