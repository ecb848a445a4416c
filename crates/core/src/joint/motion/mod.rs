//! Coordinates of a joint, and their change in a step.

mod judged;

pub(crate) use judged::{JointMotion, JointWork};

use super::gimbal::{self, nearest};
use super::{Axis, AxisStart, Drive, Joint, JointAxis, JointFrame, Turn, TurnKind};
use crate::kinematics::StepMap;
use crate::mechanics::quaternion::{conjugated, product, rotation, rotation_vector};
use crate::mechanics::{State, Wrench, largest};
use nalgebra::{Matrix3, Vector3, Vector4};

/// Force of a joint over a step, and its counted angles.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct JointForce {
    /// Force on A at its anchor (N), along the axes of B's frame at the start of the step. B
    /// receives the opposite force.
    pub force: Vector3<f64>,
    /// Torque on A about the joint's angular axes at the start of the step (N m). For locked, hinge
    /// and driven rotations these are the axes of A's frame, turned back by half of the error of
    /// the locked axes. B receives the opposite torque.
    pub torque: Vector3<f64>,
    /// The [angles](Joint::turns) at k+1 (rad). Hinge, gimbal, universal and twist angles include
    /// full turns. 0 for free rotation.
    pub angles: Vector3<f64>,
}

impl JointForce {
    /// Zero force at `angles` (rad).
    pub fn none(angles: Vector3<f64>) -> Self {
        Self { force: Vector3::zeros(), torque: Vector3::zeros(), angles }
    }
}

/// Coordinates (J1) of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinates {
    /// Position l (m).
    pub place: Vector3<f64>,
    /// Rotation Q (w, x, y, z).
    pub turn: Vector4<f64>,
}

/// Residual of a joint's laws (m/s).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct JointResidual {
    /// Error of locked axes: |l⁺|/h, and ℓ times the angle over h.
    pub locked: f64,
    /// Error of the force laws of free axes.
    pub drive: f64,
}

/// Rates of the axes of a joint before a step.
#[derive(Debug, Clone, Copy, Default)]
struct AxisRates {
    /// Rates of the position (m/s).
    along: Vector3<f64>,
    /// Rates of the rotation (rad/s).
    about: Vector3<f64>,
    /// Fall along the linear axes that the velocities lack (m/s).
    fall: Vector3<f64>,
}

impl Joint {
    /// Frames of both sides in the world at `states`.
    fn placed(&self, states: &[State]) -> Option<[JointFrame; 2]> {
        let [a, b] = &self.frames;
        let b = match self.other {
            Some(other) => b.placed(states.get(other)?),
            None => *b,
        };
        Some([a.placed(states.get(self.body)?), b])
    }

    /// Coordinates (J1) at `states`. `None` if a body has no state.
    pub fn coordinates(&self, states: &[State]) -> Option<Coordinates> {
        let [a, b] = self.placed(states)?;
        Some(between(&a, &b))
    }

    /// Angles about the angular axes (rad), nearest to `near`:
    ///
    /// | rotation | angles |
    /// |---|---|
    /// | locked axes | error |
    /// | hinge | θ = 2 atan2(Q_z, Q_w) + 2πn about z |
    /// | gimbal, universal | angles of (J13) |
    /// | ball with cone | swing, 0, twist |
    /// | free or driven | rotation vector of at most half a turn |
    pub fn turns(&self, at: &Coordinates, near: &Vector3<f64>) -> Vector3<f64> {
        let turning = self.turning();
        let off = || aside(turning, &at.turn) * 2.0;
        let about_z = || nearest(2.0 * libm::atan2(at.turn[3], at.turn[0]), near[2]);
        let angles = || gimbal::angles(&at.turn, near, &self.middle());
        match turning {
            TurnKind::Free | TurnKind::Driven => rotation_vector(&at.turn),
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

    /// Angles to count turns from: [`Joint::turns`], or 0 for free rotation.
    pub fn counted(&self, at: &Coordinates, near: &Vector3<f64>) -> Vector3<f64> {
        match self.turning() {
            TurnKind::Free => Vector3::zeros(),
            _ => self.turns(at, near),
        }
    }

    /// Mean rates of all axes from `at` to `after` in `time_step` (s): of the position (m/s), and
    /// of the [angles](Joint::turns) (rad/s). `near` is near the angles at `at`.
    pub fn rates(
        &self,
        at: &Coordinates,
        after: &Coordinates,
        near: &Vector3<f64>,
        time_step: f64,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let turned = match self.turning() {
            TurnKind::Free | TurnKind::Driven => {
                rotation_vector(&product(&conjugated(&at.turn), &after.turn))
            }
            _ => {
                let start = self.turns(at, near);
                self.turns(after, &start) - start
            }
        };
        ((after.place - at.place) / time_step, turned / time_step)
    }

    /// Largest errors of the locked axes at `states`: of l (m) and of the angles (rad). `None` if a
    /// body has no state.
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

    /// Largest errors of the locked axes and largest excesses over limits (m and rad). `None` if a
    /// body has no state.
    pub(crate) fn misfit(&self, states: &[State]) -> Option<(f64, f64)> {
        let (place, turn) = self.error(states)?;
        let at = self.coordinates(states)?;
        let beyond = self.beyond_limits(states, &self.counted(&at, &Vector3::zeros()))?;
        Some((place.max(beyond.0), turn.max(beyond.1)))
    }

    /// Largest excesses over the limits at the joint angles `angles` (rad): position (m) and angle
    /// (rad). `None` if a body has no state.
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

    /// States of the linear and the angular axes at the start of a step from
    /// `states`, with the coordinates `at` and the `angles` (rad). Rates are computed only if
    /// an axis needs them.
    pub(crate) fn starts(
        &self,
        states: &[State],
        at: &Coordinates,
        angles: &Vector3<f64>,
        map: &StepMap,
    ) -> [[AxisStart; 3]; 2] {
        if self.needs_rates() {
            self.starts_with_rates(states, at, angles, map)
        } else {
            self.starts_at(at, angles, &Default::default())
        }
    }

    /// Same as [`Joint::starts`], with rates for all axes. Derivatives with respect to an armature
    /// need them.
    pub(crate) fn starts_with_rates(
        &self,
        states: &[State],
        at: &Coordinates,
        angles: &Vector3<f64>,
        map: &StepMap,
    ) -> [[AxisStart; 3]; 2] {
        let rates = self.coasted(states, &map.over(-map.time_step)).map(|before| {
            let turned = self.turned(&before, &self.counted(&before, angles), at, angles);
            let along = (at.place - before.place) / map.time_step;
            AxisRates { along, about: turned / map.time_step, fall: self.fall_along(states) }
        });
        self.starts_at(at, angles, &rates.unwrap_or_default())
    }

    /// Velocity by the missing fall along the linear axes (m/s).
    fn fall_along(&self, states: &[State]) -> Vector3<f64> {
        if self.fall == Vector3::zeros() {
            return self.fall;
        }
        let frame = self.placed(states).map(|[_, b]| rotation(&b.attitude));
        frame.map_or(Vector3::zeros(), |frame| frame.tr_mul(&self.fall))
    }

    /// Change of each angular axis from `at` to `end` (rad), given their [angles](Joint::counted).
    /// For driven free rotation it is twice the imaginary part of Q* ⊗ Q⁺ (J18).
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

    /// Axis states at known rates.
    fn starts_at(
        &self,
        at: &Coordinates,
        angles: &Vector3<f64>,
        rates: &AxisRates,
    ) -> [[AxisStart; 3]; 2] {
        let parts =
            [(&at.place, &rates.along, rates.fall), (angles, &rates.about, Vector3::zeros())];
        let axis = |part: usize, k: usize| {
            let (coordinates, rates, fall) = &parts[part];
            AxisStart {
                coordinate: coordinates[k],
                rate: rates[k],
                arrival: rates[k] + fall[k],
                rebound_rate: self.rebound_rates[part],
                fall: self.falls[part],
                inverse_inertia: self.inverse_inertias[part][k],
                is_middle: self.is_middle,
                push: self.push[part][k],
                kick: self.kick,
            }
        };
        [0, 1].map(|part| std::array::from_fn(|k| axis(part, k)))
    }

    /// Coordinates after both bodies coasted with their velocities over the step `map`.
    pub(crate) fn coasted(&self, states: &[State], map: &StepMap) -> Option<Coordinates> {
        let placed = |body: usize, frame: &JointFrame| {
            states.get(body).map(|state| frame.placed(&map.coasted(state)))
        };
        let b = match self.other {
            Some(other) => placed(other, &self.frames[1])?,
            None => self.frames[1],
        };
        Some(between(&placed(self.body, &self.frames[0])?, &b))
    }

    /// Wrenches on A and on B of a force (N) or torque (N m) of `size` along a free axis, in a step
    /// from `states`: the effect of a drive. The wrench on the world is zero. `None` if a body has
    /// no state.
    pub fn wrenches(&self, states: &[State], axis: JointAxis, size: f64) -> Option<[Wrench; 2]> {
        let at = self.coordinates(states)?;
        let mut force = JointForce::none(self.counted(&at, &Vector3::zeros()));
        let (of, k) = match axis {
            JointAxis::Linear(k) => (&mut force.force, k),
            JointAxis::Angular(k) => (&mut force.torque, k),
        };
        *of.get_mut(k)? = size;
        let frames = self.placed(states)?;
        let state = states.get(self.body)?;
        // Drives act along the directions at the start.
        let torque_map = self.turning_map(states, &at, &force.angles, &StepMap::STILL);
        let acting = self.acting_at(&frames, &torque_map, state, &force);
        let other = match self.other {
            Some(other) => acting.on(states.get(other)?, -1.0),
            None => Wrench::zero(),
        };
        Some([acting.on(states.get(self.body)?, 1.0), other])
    }

    /// Load of `force` on A, given both world frames, the [torque map](Joint::turning_map) and the
    /// state of A.
    fn acting_at(
        &self,
        frames: &[JointFrame; 2],
        torque_map: &Matrix3<f64>,
        state: &State,
        force: &JointForce,
    ) -> AnchorLoad {
        // In the frame of A, then in the world frame.
        let about = torque_map * force.torque;
        AnchorLoad {
            anchor: frames[0].anchor,
            force: rotation(&frames[1].attitude) * force.force,
            torque: rotation(&state.attitude) * about,
        }
    }

    /// Map from torques about the angular axes to the torque on A (frame of A), in a step of
    /// `time_step` (s) from `states` with the coordinates `at` and the `angles` (rad).
    fn turning_map(
        &self,
        states: &[State],
        at: &Coordinates,
        angles: &Vector3<f64>,
        map: &StepMap,
    ) -> Matrix3<f64> {
        if self.turning() == TurnKind::Free {
            return Matrix3::zeros();
        }
        let spin = |body: usize| states.get(body).map(|state| &state.spin);
        let turn = Turn::new(self, at, angles, map, 1.0);
        let turn = match spin(self.body) {
            Some(own) => turn.with_stop(own, self.other.and_then(spin)),
            None => turn,
        };
        turn.torque_map()
    }
}

/// Force (N) and torque (N m) at an anchor (m), world frame.
struct AnchorLoad {
    anchor: Vector3<f64>,
    force: Vector3<f64>,
    torque: Vector3<f64>,
}

impl AnchorLoad {
    /// Wrench on a body at `state`, times `sign`.
    fn on(&self, state: &State, sign: f64) -> Wrench {
        let torque = ((self.anchor - state.position).cross(&self.force) + self.torque) * sign;
        Wrench { force: self.force * sign, torque: rotation(&state.attitude).tr_mul(&torque) }
    }
}

/// Coordinates (J1) of the world frames of A and B.
fn between(a: &JointFrame, b: &JointFrame) -> Coordinates {
    let place = rotation(&b.attitude).tr_mul(&(a.anchor - b.anchor));
    Coordinates { place, turn: product(&conjugated(&b.attitude), &a.attitude) }
}

/// Reference rotation R: the rotation about z for a hinge, Q for driven free rotation, ±1
/// otherwise.
pub(super) fn twist(turning: TurnKind, turn: &Vector4<f64>) -> Vector4<f64> {
    let about = Vector4::new(turn[0], 0.0, 0.0, turn[3]);
    match turning {
        TurnKind::Hinge | TurnKind::Ball if about.norm() > 0.0 => about.normalize(),
        TurnKind::Driven => *turn,
        _ => Vector4::new(if turn[0] < 0.0 { -1.0 } else { 1.0 }, 0.0, 0.0, 0.0),
    }
}

/// Angle between the z axes, σ = 2 atan2(√(x² + y²), √(w² + z²)).
pub(super) fn swing(turn: &Vector4<f64>) -> f64 {
    2.0 * libm::atan2(libm::hypot(turn[1], turn[2]), libm::hypot(turn[0], turn[3]))
}

/// Half the gradient of σ with respect to (w, x, y, z). At σ = 0 the direction of x is used.
pub(super) fn swinging(turn: &Vector4<f64>) -> Vector4<f64> {
    let (aside, along) = (libm::hypot(turn[1], turn[2]), libm::hypot(turn[0], turn[3]));
    let (x, y) = if aside > 0.0 { (turn[1] / aside, turn[2] / aside) } else { (1.0, 0.0) };
    let size = aside * aside + along * along;
    let back = if along > 0.0 { -aside / (along * size) } else { 0.0 };
    Vector4::new(turn[0] * back, x * along / size, y * along / size, turn[3] * back)
}

/// Product xy + wz: half the cosine of the angle between x of A's frame and y of B's.
pub(super) fn crossing(turn: &Vector4<f64>) -> f64 {
    turn[1] * turn[2] + turn[0] * turn[3]
}

/// Imaginary part of R* ⊗ Q: half the angles about locked axes.
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
