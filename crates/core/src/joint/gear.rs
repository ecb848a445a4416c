//! Gears: a coordinate of one joint that follows one of another, or a law on how far it is from that.

use super::{Axis, AxisStart, Drive, Joint, JointAxis, JointForce, TurnKind};
use crate::error::{Error, in_range};
use crate::mechanics::{RigidBody, State, Wrench};
use crate::world::{Constant, World};
use nalgebra::Vector3;

/// An axis of a joint of the world.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
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
/// by a force on the first and −r times that on the second. What drives either acts besides. With a
/// [drive](Gear::with_drive) nothing is locked: that acts on the sum
///
/// ```text
/// s = q₁ − r q₂ − q₀                                                        (J17)
/// ```
///
/// as it would on the coordinate of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Gear {
    pub(super) axes: [GearAxis; 2],
    pub(super) ratio: f64,
    pub(super) offset: f64,
    pub(super) law: Axis,
}

/// How far a gear may be off at the start, or beyond the limits of its drive, m or rad of the first coordinate.
pub const GEAR_AT_THE_START: f64 = 1e-6;

impl Gear {
    /// The coordinate `first` is `ratio` times `second` and `offset`, in the unit of the first one.
    #[must_use]
    pub fn new(first: GearAxis, second: GearAxis, ratio: f64, offset: f64) -> Self {
        Self { axes: [first, second], ratio, offset, law: Axis::Locked }
    }

    /// The same with `drive` on s (J17), in the units of the first coordinate, in place of what holds s at zero: limits,
    /// dry friction, a spring, a damper, a force, a motor. An armature of a sum is refused.
    #[must_use]
    pub fn with_drive(self, drive: Drive) -> Self {
        Self { law: Axis::Free(drive), ..self }
    }

    /// What acts on s, where that is not held at zero.
    #[must_use]
    pub fn drive(&self) -> Option<&Drive> {
        match &self.law {
            Axis::Locked => None,
            Axis::Free(drive) => Some(drive),
        }
    }

    /// Locked, or free under a drive.
    pub(crate) fn law(&self) -> &Axis {
        &self.law
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
                JointAxis::Angular(k) => {
                    about.get(k).copied().filter(|_| of.turning() != TurnKind::Driven)
                }
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
        self.check_law()?;
        Ok(self)
    }

    fn check_law(&self) -> Result<(), Error> {
        self.law.check()?;
        if self.law.has_armature() {
            let why = "give it to the joints, each what turns with it";
            return Err(Error::Unsupported { what: "an armature of a sum of coordinates", why });
        }
        Ok(())
    }

    /// Sets the drive of one that has a drive; what is refused leaves the one before.
    pub(crate) fn set_drive(&mut self, drive: Drive) -> Result<(), Error> {
        if self.law == Axis::Locked {
            let why = "a drive acts on a sum in place of what holds it";
            return Err(Error::Unsupported { what: "a drive of a gear that is held", why });
        }
        let set = self.with_drive(drive);
        set.check_law()?;
        *self = set;
        Ok(())
    }

    /// Sets r or q₀, for constants of the world to set.
    pub(crate) fn set(&mut self, constant: Constant, number: f64) {
        match constant {
            Constant::GearRatio => self.ratio = number,
            Constant::GearOffset => self.offset = number,
            _ => {}
        }
    }

    /// What of it no simulation changes: without its drive.
    #[cfg(feature = "save")]
    pub(crate) fn lasting(&self) -> Self {
        match self.law {
            Axis::Locked => *self,
            Axis::Free(_) => self.with_drive(Drive::NONE),
        }
    }

    /// The same where of the joints those stay that are marked; `None` where one of its own does not.
    pub(crate) fn keeping(&self, stays: &[bool]) -> Option<Self> {
        let kept = |at: GearAxis| {
            let number = stays[..at.joint].iter().filter(|stays| **stays).count();
            stays[at.joint].then_some(GearAxis { joint: number, ..at })
        };
        Some(Self { axes: [kept(self.axes[0])?, kept(self.axes[1])?], ..*self })
    }

    /// q₁ − r q₂ − q₀, m or rad.
    pub(crate) fn missed(&self, coordinates: [f64; 2]) -> f64 {
        coordinates[0] - self.ratio * coordinates[1] - self.offset
    }

    /// s (J17) where the bodies are at `states` and the joints near the `angles`, m or rad.
    #[must_use]
    pub fn coordinate(&self, joints: &[Joint], states: &[State], angles: &[Vector3<f64>]) -> f64 {
        let at = |of: GearAxis| {
            let near = angles.get(of.joint).copied().unwrap_or_default();
            of.coordinate(joints, states, &near)
        };
        self.missed(self.axes.map(at))
    }

    /// How far it is off where the bodies are at `states` and the joints near the `angles`, m or rad of the first
    /// coordinate: s, or what s is beyond the limits of its drive.
    #[must_use]
    pub fn error(&self, joints: &[Joint], states: &[State], angles: &[Vector3<f64>]) -> f64 {
        let sum = self.coordinate(joints, states, angles);
        match self.law {
            Axis::Locked => sum,
            Axis::Free(Drive { limits: Some([low, high]), .. }) => sum - sum.clamp(low, high),
            Axis::Free(_) if sum.is_nan() => sum,
            Axis::Free(_) => 0.0,
        }
    }

    /// How far a step of `world` between these states, in which its joints have the forces and angles `of_joints` and this the
    /// `force` (N or N m), is from (J15) or from the law of its drive, m/s, as a [joint's](Joint::residual); NaN where a
    /// joint has no force.
    #[must_use]
    pub fn residual(
        &self,
        world: &World,
        states: &[State],
        next: &[State],
        of_joints: &[JointForce],
        force: f64,
    ) -> f64 {
        let (joints, bodies, h) = (world.joints(), world.bodies(), world.time_step());
        let Some(angles) = self.angles(of_joints) else { return f64::NAN };
        let end = self.between(joints, next, &angles);
        let length = self.length(joints, bodies);
        if self.law == Axis::Locked {
            return length * end.abs() / h;
        }
        let start = self.between(joints, states, &angles);
        let Some(response) = self.response(world, states) else { return f64::NAN };
        // Impulses over the mass of the first body.
        let unit = bodies[joints[self.axes[0].joint].body()].mass();
        let graph = self.law.graph(&at_rest(start), h, length, unit);
        let rho = 1.0 / (length * length * unit * response);
        let (u, p) = (length * (end - start) / h, force * h / (unit * length));
        let missed = graph.residual(u, p, if rho.is_finite() { rho } else { 1.0 });
        if u.is_finite() && p.is_finite() { missed } else { f64::NAN }
    }

    /// The work of its drive in a step of `world` between these states, J, as a [joint's](Joint::work); 0 of what is held.
    pub(crate) fn work(
        &self,
        world: &World,
        states: &[State],
        next: &[State],
        of_joints: &[JointForce],
        force: f64,
    ) -> f64 {
        if self.law == Axis::Locked {
            return 0.0;
        }
        let Some(angles) = self.angles(of_joints) else { return f64::NAN };
        let before = |(at, near): (GearAxis, &Vector3<f64>)| {
            let joint = &world.joints()[at.joint];
            let coasted = joint.coasted(states, -world.time_step());
            coasted.map_or(f64::NAN, |of| match at.axis {
                JointAxis::Linear(k) => of.place[k],
                JointAxis::Angular(k) => joint.counted(&of, near)[k],
            })
        };
        let [first, second] = self.axes;
        let came = self.missed([before((first, &angles[0])), before((second, &angles[1]))]);
        0.5 * force * (self.between(world.joints(), next, &angles) - came)
    }

    /// s where the bodies are at `states`, and its joints near these angles.
    fn between(&self, joints: &[Joint], states: &[State], angles: &[Vector3<f64>; 2]) -> f64 {
        let [first, second] = self.axes;
        self.missed([
            first.coordinate(joints, states, &angles[0]),
            second.coordinate(joints, states, &angles[1]),
        ])
    }

    /// The angles of its joints at the end of a step.
    fn angles(&self, of_joints: &[JointForce]) -> Option<[Vector3<f64>; 2]> {
        let [first, second] = self.axes.map(|at| of_joints.get(at.joint).map(|of| of.angles));
        Some([first?, second?])
    }

    /// How fast s becomes by an impulse of 1 along it, with nothing but its bodies to move: Σ F²/m + τ·I⁻¹ τ, over 1 kg or
    /// 1 kg m². `None` where a body has no state.
    fn response(&self, world: &World, states: &[State]) -> Option<f64> {
        let mut sides: [Option<(usize, Wrench)>; 4] = [None; 4];
        for (at, size) in self.axes.iter().zip([1.0, -self.ratio]) {
            let joint = &world.joints()[at.joint];
            let wrenches = joint.wrenches(states, at.axis, size)?;
            for (body, wrench) in [Some(joint.body()), joint.other()].into_iter().zip(wrenches) {
                let Some(body) = body else { continue };
                let known = |side: &Option<(usize, Wrench)>| side.is_none_or(|of| of.0 == body);
                if let Some(side) = sides.iter_mut().find(|side| known(side)) {
                    let (_, sum) = side.get_or_insert((body, Wrench::zero()));
                    sum.force += wrench.force;
                    sum.torque += wrench.torque;
                }
            }
        }
        let moved = |(body, wrench): (usize, Wrench)| {
            let of = &world.bodies()[body];
            let turned = wrench.torque.dot(&(of.inertia_inverse() * wrench.torque));
            wrench.force.norm_squared() / of.mass() + turned
        };
        Some(sides.into_iter().flatten().map(moved).sum())
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

/// The start of a step from s, of which no armature asks how fast it comes.
pub(crate) fn at_rest(coordinate: f64) -> AxisStart {
    AxisStart { coordinate, ..AxisStart::default() }
}

/// See [`World::angles_near`].
pub(crate) fn angles_near(
    joints: &[Joint],
    gears: &[Gear],
    states: &[State],
    near: &[Vector3<f64>],
) -> Vec<Vector3<f64>> {
    let counted = |joint: usize, near: Vector3<f64>| {
        let at = joints[joint].coordinates(states);
        at.map_or(Vector3::zeros(), |at| joints[joint].counted(&at, &near))
    };
    let near = |joint: usize| near.get(joint).copied().unwrap_or_default();
    let mut angles: Vec<_> = (0..joints.len()).map(|joint| counted(joint, near(joint))).collect();
    for gear in gears.iter().filter(|gear| gear.law == Axis::Locked) {
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
