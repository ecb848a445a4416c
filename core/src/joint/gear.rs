//! Gears: a coordinate of one joint that follows one of another.

use super::{Joint, JointAxis, JointForce};
use crate::error::{Error, in_range};
use crate::mechanics::{RigidBody, State};
use crate::world::World;
use nalgebra::Vector3;

/// An axis of a joint of the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GearAxis {
    /// The index of the joint.
    pub joint: usize,
    /// Which of its axes, one that is free and whose turns are counted.
    pub axis: JointAxis,
}

impl GearAxis {
    /// q where the bodies are at `states`, that nearest to the turns `near` of the joint, m or rad.
    ///
    /// # Panics
    /// If there is no such joint or axis.
    #[must_use]
    pub fn coordinate(&self, joints: &[Joint], states: &[State], near: &Vector3<f64>) -> f64 {
        let of = &joints[self.joint];
        of.coordinates(states).map_or(f64::NAN, |at| match self.axis {
            JointAxis::Linear(k) => at.place[k],
            JointAxis::Angular(k) => of.counted(&at, near)[k],
        })
    }
}

/// A gear, a rack, a screw or a mimic joint: two coordinates (m, or rad with all turns) of which, at the
/// end of every step,
///
/// ```text
/// q₁ = r q₂ + q₀                                                           (J15)
/// ```
///
/// by a force on the first and −r times that on the second. What drives either acts besides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gear {
    axes: [GearAxis; 2],
    ratio: f64,
    offset: f64,
}

/// How far a gear may be off at the start, m or rad of the first coordinate.
pub const GEAR_AT_THE_START: f64 = 1e-6;

impl Gear {
    /// The coordinate `first` is `ratio` times `second` and `offset`, in the unit of the first one.
    #[must_use]
    pub fn new(first: GearAxis, second: GearAxis, ratio: f64, offset: f64) -> Self {
        Self { axes: [first, second], ratio, offset }
    }

    /// The axes of the first and the second coordinate.
    #[must_use]
    pub fn axes(&self) -> &[GearAxis; 2] {
        &self.axes
    }

    /// r.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.ratio
    }

    /// q₀, m or rad.
    #[must_use]
    pub fn offset(&self) -> f64 {
        self.offset
    }

    /// The gear, checked against the joints of its world.
    pub(crate) fn checked(self, joints: &[Joint]) -> Result<Self, Error> {
        let unsupported = |what| {
            let why = "it ties two free axes of joints whose coordinates are counted: slides, and turns of hinges, \
                       universal joints and gimbals, and twists of ball joints";
            Error::Unsupported { what, why }
        };
        for GearAxis { joint, axis } in self.axes {
            let allowed = "an index of a joint";
            let count = Error::Count { field: "joint of a gear", count: joint, allowed };
            let of = joints.get(joint).ok_or(count)?;
            let [along, about] = of.bears();
            let bears = match axis {
                JointAxis::Linear(k) => along.get(k).copied().filter(|_| of.holds_place()),
                JointAxis::Angular(k) => about.get(k).copied(),
            };
            if bears != Some(true) {
                return Err(unsupported("a gear on an axis that has no coordinate of its own"));
            }
        }
        if self.axes[0] == self.axes[1] {
            return Err(unsupported("a gear of an axis with itself"));
        }
        in_range("ratio of a gear", self.ratio, -1e6, 1e6, "-1e6 to 1e6")?;
        in_range("offset of a gear", self.offset, -1e6, 1e6, "-1e6 to 1e6")?;
        Ok(self)
    }

    /// The same where of the joints those stay that are marked; `None` where one of its own does not.
    pub(crate) fn keeping(&self, stays: &[bool]) -> Option<Self> {
        let kept = |at: GearAxis| {
            let number = stays[..at.joint].iter().filter(|stays| **stays).count();
            stays[at.joint].then_some(GearAxis { joint: number, ..at })
        };
        Some(Self { axes: [kept(self.axes[0])?, kept(self.axes[1])?], ..*self })
    }

    /// The same in units of `length` (m).
    pub(crate) fn in_units(&self, length: f64) -> Self {
        let [first, second] = self.axes.map(|at| match at.axis {
            JointAxis::Linear(_) => length,
            JointAxis::Angular(_) => 1.0,
        });
        Self { ratio: self.ratio * second / first, offset: self.offset / first, ..*self }
    }

    /// q₁ − r q₂ − q₀, m or rad.
    pub(crate) fn missed(&self, coordinates: [f64; 2]) -> f64 {
        coordinates[0] - self.ratio * coordinates[1] - self.offset
    }

    /// How far it is off where the bodies are at `states` and the joints near the `angles`, m or rad of the first
    /// coordinate.
    #[must_use]
    pub fn error(&self, joints: &[Joint], states: &[State], angles: &[Vector3<f64>]) -> f64 {
        let at = |of: GearAxis| {
            let near = angles.get(of.joint).copied().unwrap_or_default();
            of.coordinate(joints, states, &near)
        };
        self.missed(self.axes.map(at))
    }

    /// How far a step of `world` to the states `next`, after which its joints have the forces and angles `of_joints`, is from
    /// (J15), m/s; NaN where a joint has no force.
    #[must_use]
    pub fn residual(&self, world: &World, next: &[State], of_joints: &[JointForce]) -> f64 {
        let angles: [_; 2] = self.axes.map(|at| of_joints.get(at.joint).map(|of| of.angles));
        let [Some(first), Some(second)] = angles else { return f64::NAN };
        let missed = self.missed([
            self.axes[0].coordinate(world.joints(), next, &first),
            self.axes[1].coordinate(world.joints(), next, &second),
        ]);
        self.length(world.joints(), world.bodies()) * missed.abs() / world.time_step()
    }

    /// What makes a speed of its first coordinate's: the [length](Joint::length) of the first joint for a turn, 1 for a
    /// slide.
    #[must_use]
    pub fn length(&self, joints: &[Joint], bodies: &[RigidBody]) -> f64 {
        let GearAxis { joint, axis } = self.axes[0];
        match axis {
            JointAxis::Linear(_) => 1.0,
            JointAxis::Angular(_) => joints[joint].length(bodies),
        }
    }

    /// What a `force` of it (N or N m, along the first coordinate) is of each of its joints, which have the
    /// forces `of_joints`: the joint's index and the force on it.
    pub(crate) fn loads(&self, force: f64, of_joints: &[JointForce]) -> [(usize, JointForce); 2] {
        let load = |GearAxis { joint, axis }: GearAxis, size: f64| {
            let mut load = JointForce::none(of_joints[joint].angles);
            match axis {
                JointAxis::Linear(k) => load.force[k] = size,
                JointAxis::Angular(k) => load.torque[k] = size,
            }
            (joint, load)
        };
        [load(self.axes[0], force), load(self.axes[1], -self.ratio * force)]
    }
}

/// See [`World::angles_near`].
pub(crate) fn angles_near(
    (joints, gears): (&[Joint], &[Gear]),
    states: &[State],
    near: &[Vector3<f64>],
) -> Vec<Vector3<f64>> {
    let counted = |joint: usize, near: Vector3<f64>| {
        let at = joints[joint].coordinates(states);
        at.map_or(Vector3::zeros(), |at| joints[joint].counted(&at, &near))
    };
    let near = |joint: usize| near.get(joint).copied().unwrap_or_default();
    let mut angles: Vec<_> = (0..joints.len()).map(|joint| counted(joint, near(joint))).collect();
    for gear in gears {
        let off = gear.error(joints, states, &angles);
        let turns = match gear.axes {
            [GearAxis { joint, axis: JointAxis::Angular(k) }, _] => Some((joint, k, -off)),
            [_, GearAxis { joint, axis: JointAxis::Angular(k) }] if gear.ratio != 0.0 => {
                Some((joint, k, off / gear.ratio))
            }
            _ => None,
        };
        if let Some((joint, k, turned)) = turns.filter(|(.., turned)| turned.is_finite()) {
            let mut near = angles[joint];
            near[k] += turned;
            angles[joint] = counted(joint, near);
        }
    }
    angles
}
