//! Where a joint is, and how it moves in a step.

mod judged;

pub(crate) use judged::JointMotion;

use super::gimbal::{self, nearest};
use super::{Axis, AxisStart, Drive, Joint, JointAxis, JointFrame, Turn, TurnKind};
use crate::mechanics::quaternion::{product, rotation};
use crate::mechanics::{State, Wrench, largest};
use nalgebra::{Matrix3, Vector3, Vector4};

/// The force of a joint over a step, and how often it has turned around.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct JointForce {
    /// Along the axes of B's frame at the step's start, N, on A at its anchor; the opposite one acts on B.
    pub force: Vector3<f64>,
    /// About the axes of A's frame turned back by half of the joint's turn, N m, on A; the opposite one acts on B.
    pub torque: Vector3<f64>,
    /// The [turns](Joint::turns) at k+1, rad, of a hinge, a gimbal, a universal joint and a twist with all the times that
    /// they went around; 0 of what turns freely.
    pub angles: Vector3<f64>,
}

impl JointForce {
    /// None, at `angles` (rad).
    #[must_use]
    pub fn none(angles: Vector3<f64>) -> Self {
        Self { force: Vector3::zeros(), torque: Vector3::zeros(), angles }
    }
}

/// Where a joint is: (J1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinates {
    /// l, m.
    pub place: Vector3<f64>,
    /// Q, (w, x, y, z).
    pub turn: Vector4<f64>,
}

/// How far a joint's impulse and motion are from its laws, m/s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointResidual {
    /// What is locked and has moved: |l⁺|/h, and ℓ times the angle over h.
    pub locked: f64,
    /// What is free and does not obey its drive.
    pub drive: f64,
}

/// q*.
pub(super) fn conjugated(q: &Vector4<f64>) -> Vector4<f64> {
    Vector4::new(q[0], -q[1], -q[2], -q[3])
}

impl Joint {
    /// The frames of both sides in the world, where the bodies are at `states`.
    fn placed(&self, states: &[State]) -> Option<[JointFrame; 2]> {
        let [a, b] = &self.frames;
        let b = match self.other {
            Some(other) => b.placed(states.get(other)?),
            None => *b,
        };
        Some([a.placed(states.get(self.body)?), b])
    }

    /// Where it is (J1). `None` where a body has no state.
    #[must_use]
    pub fn coordinates(&self, states: &[State]) -> Option<Coordinates> {
        let [a, b] = self.placed(states)?;
        Some(between(&a, &b))
    }

    /// The turns about the axes, rad: of what is locked, what it is off by; of a hinge its angle about z; of a
    /// gimbal and a universal joint the angles (J13); of a ball joint with a cone its swing, 0, and its twist; of what
    /// turns in any way, the turn as a vector, of up to half a turn. Angles are those nearest to `near`: of a hinge
    /// θ = 2 atan2(Q_z, Q_w) + 2πn.
    #[must_use]
    pub fn turns(&self, at: &Coordinates, near: &Vector3<f64>) -> Vector3<f64> {
        let turning = self.turning();
        let off = || aside(turning, &at.turn) * 2.0;
        let about_z = || nearest(2.0 * libm::atan2(at.turn[3], at.turn[0]), near[2]);
        let angles = || gimbal::angles(&at.turn, near, &self.middle());
        match turning {
            TurnKind::Free | TurnKind::Driven => vector_of(&at.turn),
            TurnKind::Locked => off(),
            TurnKind::Hinge => {
                let off = off();
                Vector3::new(off[0], off[1], about_z())
            }
            TurnKind::Ball => Vector3::new(swing(&at.turn), 0.0, about_z()),
            TurnKind::Gimbal => angles(),
            TurnKind::Universal => {
                let angles = angles();
                Vector3::new(angles[0], angles[1], off()[2])
            }
        }
    }

    /// The same to count on from: 0 of what turns freely, which counts nothing.
    #[must_use]
    pub fn counted(&self, at: &Coordinates, near: &Vector3<f64>) -> Vector3<f64> {
        match self.turning() {
            TurnKind::Free => Vector3::zeros(),
            _ => self.turns(at, near),
        }
    }

    /// The mean rates of all axes from `at` to `after` in `time_step` (s): of the place, m/s, and of the
    /// [turns](Joint::turns), rad/s, where `near` is near those at `at`.
    #[must_use]
    pub fn rates(
        &self,
        at: &Coordinates,
        after: &Coordinates,
        near: &Vector3<f64>,
        time_step: f64,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let turned = match self.turning() {
            TurnKind::Free | TurnKind::Driven => {
                vector_of(&(product(&conjugated(&at.turn), &after.turn)))
            }
            _ => {
                let start = self.turns(at, near);
                self.turns(after, &start) - start
            }
        };
        ((after.place - at.place) / time_step, turned / time_step)
    }

    /// How far it is from where its locked axes want it, m and rad: the largest of l, and of the
    /// angles about what is locked. `None` where a body has no state.
    #[must_use]
    pub fn error(&self, states: &[State]) -> Option<(f64, f64)> {
        let at = self.coordinates(states)?;
        let locked = |axis: &&Axis| **axis == Axis::Locked;
        let linear = self.linear.iter().zip(&at.place).filter(|(axis, _)| locked(axis));
        let place = linear.map(|(_, l)| l.abs()).fold(0.0, f64::max);
        let turn = match self.turning() {
            TurnKind::Free | TurnKind::Driven | TurnKind::Ball | TurnKind::Gimbal => 0.0,
            turning => {
                let aside = aside(turning, &at.turn);
                let angular = self.angular.iter().zip(&aside).filter(|(axis, _)| locked(axis));
                angular.map(|(_, e)| 2.0 * e.abs()).fold(0.0, f64::max)
            }
        };
        Some((place, turn))
    }

    /// How far it is from where its locked axes want it and beyond its limits, m and rad. `None` where a body has no
    /// state.
    pub(crate) fn misfit(&self, states: &[State]) -> Option<(f64, f64)> {
        let (place, turn) = self.error(states)?;
        let at = self.coordinates(states)?;
        let beyond = self.beyond_limits(states, &self.counted(&at, &Vector3::zeros()))?;
        Some((place.max(beyond.0), turn.max(beyond.1)))
    }

    /// How far it is beyond its limits where its angles are `angles` (rad), m and rad. `None` where a body has no state.
    #[must_use]
    pub fn beyond_limits(&self, states: &[State], angles: &Vector3<f64>) -> Option<(f64, f64)> {
        let at = self.coordinates(states)?;
        let (mut place, mut turn) = (0.0_f64, 0.0_f64);
        let beyond = |axis: &Axis, x: f64| match axis {
            Axis::Free(Drive { limits: Some([low, high]), .. }) => (low - x).max(x - high).max(0.0),
            _ => 0.0,
        };
        for (axis, x) in self.linear.iter().zip(&at.place) {
            place = place.max(beyond(axis, *x));
        }
        for (axis, angle) in self.angular.iter().zip(angles) {
            turn = turn.max(beyond(axis, *angle));
        }
        Some((place, turn))
    }

    /// Its axes at the start of a step of `time_step` (s) from `states`, where it is at `at` and at the `angles`
    /// (rad): those of the place and those of the turn.
    pub(crate) fn starts(
        &self,
        states: &[State],
        at: &Coordinates,
        angles: &Vector3<f64>,
        time_step: f64,
    ) -> [[AxisStart; 3]; 2] {
        match self.linear.iter().chain(&self.angular).any(Axis::has_armature) {
            true => self.starts_with_rates(states, at, angles, time_step),
            false => self.starts_at(at, angles, &Vector3::zeros(), &Vector3::zeros()),
        }
    }

    /// The same with the rates at which they come also where no armature asks for them: a change of one does.
    pub(crate) fn starts_with_rates(
        &self,
        states: &[State],
        at: &Coordinates,
        angles: &Vector3<f64>,
        time_step: f64,
    ) -> [[AxisStart; 3]; 2] {
        let rates = self.coasted(states, -time_step).map(|before| {
            let turned = self.turned(&before, &self.counted(&before, angles), at, angles);
            ((at.place - before.place) / time_step, turned / time_step)
        });
        let (rates, turning) = rates.unwrap_or_default();
        self.starts_at(at, angles, &rates, &turning)
    }

    /// How far each axis of its turn goes from where it is at `at` to `end`, both with their [angles](Joint::counted), rad:
    /// of what turns in any way under drives 2 (Q* ⊗ Q⁺)'s imaginary part (J18).
    fn turned(
        &self,
        at: &Coordinates,
        angles: &Vector3<f64>,
        end: &Coordinates,
        after: &Vector3<f64>,
    ) -> Vector3<f64> {
        if self.turning() != TurnKind::Driven {
            return after - angles;
        }
        let turn = product(&conjugated(&at.turn), &end.turn);
        turn.fixed_rows::<3>(1) * (2.0_f64).copysign(turn[0])
    }

    /// The same where the rates at which it comes are known, of the place (m/s) and of the turn (rad/s).
    fn starts_at(
        &self,
        at: &Coordinates,
        angles: &Vector3<f64>,
        rates: &Vector3<f64>,
        turns: &Vector3<f64>,
    ) -> [[AxisStart; 3]; 2] {
        let along =
            |k: usize| AxisStart { coordinate: at.place[k], rate: rates[k], push: self.push[0][k] };
        let about =
            |k: usize| AxisStart { coordinate: angles[k], rate: turns[k], push: self.push[1][k] };
        [std::array::from_fn(along), std::array::from_fn(about)]
    }

    /// Where it is when both bodies have moved on with their velocities for `time` (s).
    pub(crate) fn coasted(&self, states: &[State], time: f64) -> Option<Coordinates> {
        let placed = |body: usize, frame: &JointFrame| {
            states.get(body).map(|state| frame.placed(&state.coasted(time)))
        };
        let b = match self.other {
            Some(other) => placed(other, &self.frames[1])?,
            None => self.frames[1],
        };
        Some(between(&placed(self.body, &self.frames[0])?, &b))
    }

    /// What a force along a free axis of its place (N), or a torque about one of its turn (N m), of `size` puts on A and on B in
    /// a step from `states`: what a drive puts there besides what the axis does by itself. Nothing on the world. `None`
    /// where a body has no state.
    #[must_use]
    pub fn wrenches(&self, states: &[State], axis: JointAxis, size: f64) -> Option<[Wrench; 2]> {
        let at = self.coordinates(states)?;
        let mut force = JointForce::none(self.counted(&at, &Vector3::zeros()));
        let (of, k) = match axis {
            JointAxis::Linear(k) => (&mut force.force, k),
            JointAxis::Angular(k) => (&mut force.torque, k),
        };
        *of.get_mut(k)? = size;
        let acting = self.acting(states, &force)?;
        let other = match self.other {
            Some(other) => acting.on(states.get(other)?, -1.0),
            None => Wrench::zero(),
        };
        Some([acting.on(states.get(self.body)?, 1.0), other])
    }

    /// What `force` puts on A at its anchor.
    fn acting(&self, states: &[State], force: &JointForce) -> Option<AnchorLoad> {
        let frames = self.placed(states)?;
        let at = between(&frames[0], &frames[1]);
        let torque_map = self.turning_map(&at, &force.angles);
        Some(self.acting_at(&frames, &torque_map, states.get(self.body)?, force))
    }

    /// The same where its frames in the world are known, the [map](Joint::turning_map) of its torques, and the state of A.
    fn acting_at(
        &self,
        frames: &[JointFrame; 2],
        torque_map: &Matrix3<f64>,
        state: &State,
        force: &JointForce,
    ) -> AnchorLoad {
        // About the axes of A, and in the world's.
        let about = torque_map * force.torque;
        AnchorLoad {
            anchor: frames[0].anchor,
            force: rotation(&frames[1].attitude) * force.force,
            torque: rotation(&state.attitude) * about,
        }
    }

    /// The torque on A, in its frame, of torques about the axes of its turn where it is at `at` and at the `angles` (rad).
    fn turning_map(&self, at: &Coordinates, angles: &Vector3<f64>) -> Matrix3<f64> {
        match self.turning() {
            TurnKind::Free => Matrix3::zeros(),
            _ => Turn::new(self, at, angles, 1.0, 1.0).torque_map(),
        }
    }
}

/// A force (N) and a torque (N m) at an anchor (m), all in the world's frame.
struct AnchorLoad {
    anchor: Vector3<f64>,
    force: Vector3<f64>,
    torque: Vector3<f64>,
}

impl AnchorLoad {
    /// Its wrench, times `sign`, on a body at `state`.
    fn on(&self, state: &State, sign: f64) -> Wrench {
        let torque = ((self.anchor - state.position).cross(&self.force) + self.torque) * sign;
        Wrench { force: self.force * sign, torque: rotation(&state.attitude).tr_mul(&torque) }
    }
}

/// (J1) of the frames of A and B in the world.
fn between(a: &JointFrame, b: &JointFrame) -> Coordinates {
    let place = rotation(&b.attitude).tr_mul(&(a.anchor - b.anchor));
    Coordinates { place, turn: product(&conjugated(&b.attitude), &a.attitude) }
}

/// The axis of a turn (w, x, y, z), times its angle of up to π, rad.
pub(super) fn vector_of(turn: &Vector4<f64>) -> Vector3<f64> {
    let along = turn.fixed_rows::<3>(1).into_owned();
    let (sine, sign) = (along.norm(), if turn[0] < 0.0 { -1.0 } else { 1.0 });
    if sine == 0.0 {
        return Vector3::zeros();
    }
    along * (sign * 2.0 * libm::atan2(sine, turn[0].abs()) / sine)
}

/// R: of a hinge the part of the turn Q about z, of what turns in any way under drives Q, of what cannot turn ±1.
pub(super) fn twist(turning: TurnKind, turn: &Vector4<f64>) -> Vector4<f64> {
    let about = Vector4::new(turn[0], 0.0, 0.0, turn[3]);
    match turning {
        TurnKind::Hinge | TurnKind::Ball if about.norm() > 0.0 => about.normalize(),
        TurnKind::Driven => *turn,
        _ => Vector4::new(if turn[0] < 0.0 { -1.0 } else { 1.0 }, 0.0, 0.0, 0.0),
    }
}

/// σ = 2 atan2(√(x² + y²), √(w² + z²)): the angle between the z axes.
pub(super) fn swing(turn: &Vector4<f64>) -> f64 {
    2.0 * libm::atan2(turn[1].hypot(turn[2]), turn[0].hypot(turn[3]))
}

/// ½ ∂σ/∂(w, x, y, z); where the z axes are one, that in the direction of x.
pub(super) fn swinging(turn: &Vector4<f64>) -> Vector4<f64> {
    let (aside, along) = (turn[1].hypot(turn[2]), turn[0].hypot(turn[3]));
    let (x, y) = if aside > 0.0 { (turn[1] / aside, turn[2] / aside) } else { (1.0, 0.0) };
    let size = aside * aside + along * along;
    let back = if along > 0.0 { -aside / (along * size) } else { 0.0 };
    Vector4::new(turn[0] * back, x * along / size, y * along / size, turn[3] * back)
}

/// xy + wz: half of the cosine of the angle between x of A's frame and y of B's.
pub(super) fn crossing(turn: &Vector4<f64>) -> f64 {
    turn[1] * turn[2] + turn[0] * turn[3]
}

/// The imaginary part of R* ⊗ Q: what is turned about what is locked, half of the angle.
fn aside(turning: TurnKind, turn: &Vector4<f64>) -> Vector3<f64> {
    let [w, x, y, z] = turn.data.0[0];
    let size = (w * w + z * z).sqrt();
    match turning {
        TurnKind::Universal => return Vector3::new(0.0, 0.0, crossing(turn)),
        // R = (w, 0, 0, z)/√(w² + z²).
        TurnKind::Hinge | TurnKind::Ball if size > 0.0 => {
            return Vector3::new((w * x + z * y) / size, (w * y - z * x) / size, 0.0);
        }
        _ => {}
    }
    let rest = product(&conjugated(&twist(turning, turn)), turn);
    rest.fixed_rows::<3>(1).into_owned()
}
