//! Controls of a problem: forces, torques, pushes, motors, starts and constants.

use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;
use tumble_core::derivative::StateChange;
use tumble_core::joint::JointAxis;
use tumble_core::mechanics::quaternion::rotation;
use tumble_core::mechanics::{State, Wrench};
use tumble_core::world::{Constant, World};

/// A control: components within bounds, piecewise constant over the steps.
#[derive(Debug, Clone, PartialEq)]
pub struct Control {
    /// Name in files and reports.
    pub name: String,
    /// Kind of the control.
    pub kind: ControlKind,
    /// Range of each [component](ControlKind::components). A component with equal ends is not a variable.
    pub bounds: Vec<[f64; 2]>,
    /// Number of pieces of the steps, equal in length up to a step; 1 for a start or a constant.
    pub knots: usize,
    /// Weight of the square of each component that [costs](ControlKind::costs), for each step.
    pub effort: f64,
}

/// Kind of a control.
#[derive(Debug, Clone, PartialEq)]
pub enum ControlKind {
    /// A force (x, y, z) at the centre of mass of a body, N, world.
    Force {
        /// Index of the body in the world.
        body: usize,
    },
    /// A torque (x, y, z) on a body, N m, world.
    Torque {
        /// Index of the body in the world.
        body: usize,
    },
    /// A push at a point of a body, in the body frame at the start of the step.
    Push(PushControl),
    /// A force along free axes of joints or a torque about them, N or N m. It acts in addition to
    /// the drives.
    ///
    /// Each axis has the same number. It acts on both bodies of a joint with opposite signs.
    Motor {
        /// Indices of joints and their axes, either all linear or all angular.
        axes: Vec<(usize, JointAxis)>,
    },
    /// A part of a body's initial state: x, y, z.
    Start {
        /// Index of the body in the world.
        body: usize,
        /// Part of the state.
        part: StartPart,
    },
    /// A constant of the world, as [one number](Constant::one_number).
    Constant(Constant),
}

/// A part of a state at the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum StartPart {
    /// Centre of mass, m, world.
    Position,
    /// Turn from the scene's attitude as a rotation vector, rad, body.
    Turn,
    /// Velocity, m/s, world.
    Velocity,
    /// Spin, rad/s, body.
    Spin,
}

impl StartPart {
    /// Value in `state`; a turn is relative to it.
    pub(super) fn value(self, state: &State) -> Vector3<f64> {
        match self {
            Self::Position => state.position,
            Self::Turn => Vector3::zeros(),
            Self::Velocity => state.velocity,
            Self::Spin => state.spin,
        }
    }
}

/// A push at a point of a body.
///
/// Its five components are the normal force into the body and two tangential forces (N), and two
/// offsets of the point along the tangents (m).
#[derive(Debug, Clone, PartialEq)]
pub struct PushControl {
    /// Index of the body in the world.
    pub body: usize,
    /// Point without an offset, m, body frame, relative to the centre of mass.
    pub point: Vector3<f64>,
    /// Inward normal and both tangents as columns. The columns are unit vectors in the body frame
    /// and right-handed.
    pub frame: Matrix3<f64>,
    /// Coefficient of friction μ of the pusher.
    ///
    /// With it the tangential components are shares, −1 to 1, of μ times the normal force. Bounds of ±1/√2 keep the sum of
    /// two variable shares within the round cone.
    pub friction: Option<f64>,
}

/// Frame of a force and a torque.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ControlFrame {
    /// World frame.
    World,
    /// Body frame at the start of the step.
    Body,
}

/// A force and a torque on a body as polynomials of the control's components, of third degree at most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Applied {
    /// Frame of both.
    pub axes: ControlFrame,
    /// Force, N.
    pub force: Vector3<f64>,
    /// Torque about the centre of mass, N m.
    pub torque: Vector3<f64>,
}

impl ControlKind {
    /// Names of the components.
    pub fn components(&self) -> &'static [&'static str] {
        match self {
            Self::Force { .. } | Self::Torque { .. } | Self::Start { .. } => &["x", "y", "z"],
            Self::Push(_) => &["normal", "tangential_1", "tangential_2", "offset_1", "offset_2"],
            Self::Motor { .. } => &["force"],
            Self::Constant(_) => &["value"],
        }
    }

    /// Unit of a component.
    pub fn unit(&self, component: usize) -> &'static str {
        match self {
            Self::Force { .. } => "N",
            Self::Torque { .. } => "N m",
            Self::Push(_) if component > 2 => "m",
            Self::Push(push) if component > 0 && push.friction.is_some() => "",
            Self::Push(_) => "N",
            Self::Motor { axes } => match axes.first() {
                Some((_, JointAxis::Linear(_))) => "N",
                _ => "N m",
            },
            Self::Start { part, .. } => match part {
                StartPart::Position => "m",
                StartPart::Turn => "rad",
                StartPart::Velocity => "m/s",
                StartPart::Spin => "rad/s",
            },
            Self::Constant(constant) => constant.unit(),
        }
    }

    /// Body of the control; `None` for a motor or a constant.
    pub fn body(&self) -> Option<usize> {
        match self {
            Self::Force { body } | Self::Torque { body } | Self::Start { body, .. } => Some(*body),
            Self::Push(push) => Some(push.body),
            Self::Motor { .. } | Self::Constant(_) => None,
        }
    }

    /// Bodies on which the control puts a wrench.
    pub(super) fn pushes(&self, world: &World) -> Vec<usize> {
        match self {
            Self::Motor { axes } => {
                let joints = axes.iter().filter_map(|(joint, _)| world.joints().get(*joint));
                let bodies = joints.flat_map(|joint| [Some(joint.body()), joint.other()]);
                bodies.flatten().collect()
            }
            Self::Start { .. } => Vec::new(),
            _ => self.body().into_iter().collect(),
        }
    }

    /// True if the control has one value for the whole run.
    pub fn is_of_the_run(&self) -> bool {
        matches!(self, Self::Start { .. } | Self::Constant(_))
    }

    /// True if a component has a cost of effort, as forces and torques have.
    pub fn costs(&self, component: usize) -> bool {
        match self {
            Self::Force { .. } | Self::Torque { .. } | Self::Motor { .. } => true,
            Self::Push(_) => component < 3,
            Self::Start { .. } | Self::Constant(_) => false,
        }
    }

    /// Force and torque of the components `numbers`; `None` if the control is not a force on one body.
    ///
    /// ```text
    /// force, torque:  u, world axes
    /// push:           f = u₁ n + u₂ t₁ + u₃ t₂,  τ = (p + u₄ t₁ + u₅ t₂) × f,  body axes
    ///                 with friction μ:  f = u₁ (n + μ u₂ t₁ + μ u₃ t₂)                  (P2)
    /// ```
    pub fn applied(&self, numbers: &[f64]) -> Option<Applied> {
        let zero = Vector3::zeros();
        match self {
            Self::Force { .. } => {
                let force = Vector3::from_column_slice(numbers);
                Some(Applied { axes: ControlFrame::World, force, torque: zero })
            }
            Self::Torque { .. } => {
                let torque = Vector3::from_column_slice(numbers);
                Some(Applied { axes: ControlFrame::World, force: zero, torque })
            }
            Self::Push(push) => {
                let force = push.force(numbers);
                let torque = push.place(numbers).cross(&force);
                Some(Applied { axes: ControlFrame::Body, force, torque })
            }
            Self::Motor { .. } | Self::Start { .. } | Self::Constant(_) => None,
        }
    }

    /// Derivatives of force and torque by each component.
    pub fn slopes(&self, numbers: &[f64]) -> Vec<Applied> {
        let (zero, unit) = (Vector3::zeros(), |k| Vector3::ith(k, 1.0));
        let world = |force, torque| Applied { axes: ControlFrame::World, force, torque };
        match self {
            Self::Force { .. } => (0..3).map(|k| world(unit(k), zero)).collect(),
            Self::Torque { .. } => (0..3).map(|k| world(zero, unit(k))).collect(),
            Self::Push(push) => {
                let (force, place) = (push.force(numbers), push.place(numbers));
                let slope = |k: usize| {
                    let by_force = push.force_slope(numbers, k);
                    let by_place = push.place_slope(k);
                    let torque = place.cross(&by_force) + by_place.cross(&force);
                    Applied { axes: ControlFrame::Body, force: by_force, torque }
                };
                (0..5).map(slope).collect()
            }
            Self::Motor { .. } | Self::Start { .. } | Self::Constant(_) => Vec::new(),
        }
    }

    /// Derivative of the initial state by component `k` of a start.
    pub fn start_slope(&self, numbers: &[f64], k: usize) -> Option<StateChange> {
        let Self::Start { part, .. } = self else { return None };
        let (zero, unit) = (StateChange::zero(), Vector3::ith(k, 1.0));
        Some(match part {
            StartPart::Position => StateChange { position: unit, ..zero },
            StartPart::Velocity => StateChange { velocity: unit, ..zero },
            StartPart::Spin => StateChange { spin: unit, ..zero },
            StartPart::Turn => {
                let jacobian = right_jacobian(&Vector3::from_column_slice(numbers));
                StateChange { turn: jacobian.column(k).into(), ..zero }
            }
        })
    }

    /// Initial state of the body with `numbers` instead of that part of `own`.
    pub fn started(&self, numbers: &[f64], own: &State) -> State {
        let Self::Start { part, .. } = self else { return *own };
        let vector = Vector3::from_column_slice(numbers);
        match part {
            StartPart::Position => State { position: vector, ..*own },
            StartPart::Velocity => State { velocity: vector, ..*own },
            StartPart::Spin => State { spin: vector, ..*own },
            StartPart::Turn => {
                let change = StateChange { turn: vector, ..StateChange::zero() };
                State { attitude: change.applied(own).attitude, ..*own }
            }
        }
    }
}

impl PushControl {
    /// Force, N, body frame.
    fn force(&self, numbers: &[f64]) -> Vector3<f64> {
        self.frame * self.components(numbers)
    }

    /// Force along the normal and both tangents, N.
    fn components(&self, numbers: &[f64]) -> Vector3<f64> {
        let [normal, first, second] = [0, 1, 2].map(|k| numbers[k]);
        match self.friction {
            None => Vector3::new(normal, first, second),
            Some(friction) => {
                Vector3::new(normal, friction * normal * first, friction * normal * second)
            }
        }
    }

    fn force_slope(&self, numbers: &[f64], k: usize) -> Vector3<f64> {
        let along = match (k, self.friction) {
            (3.., _) => Vector3::zeros(),
            (_, None) => Vector3::ith(k, 1.0),
            (0, Some(friction)) => Vector3::new(1.0, friction * numbers[1], friction * numbers[2]),
            (_, Some(friction)) => Vector3::ith(k, friction * numbers[0]),
        };
        self.frame * along
    }

    /// Point of the push, m, body frame.
    pub(super) fn place(&self, numbers: &[f64]) -> Vector3<f64> {
        self.point + self.frame.column(1) * numbers[3] + self.frame.column(2) * numbers[4]
    }

    fn place_slope(&self, k: usize) -> Vector3<f64> {
        match k {
            3 | 4 => self.frame.column(k - 2).into(),
            _ => Vector3::zeros(),
        }
    }
}

impl Applied {
    /// Wrench of a step that the body starts at `state`.
    ///
    /// ```text
    /// world axes:  F = f,    τ = Aᵀ t
    /// body axes:   F = A f,  τ = t
    /// ```
    pub fn wrench(&self, state: &State) -> Wrench {
        let turned = rotation(&state.attitude);
        match self.axes {
            ControlFrame::World => {
                Wrench { force: self.force, torque: turned.tr_mul(&self.torque) }
            }
            ControlFrame::Body => Wrench { force: turned * self.force, torque: self.torque },
        }
    }

    /// Derivatives of force and torque of the [wrench](Self::wrench) by a turn δθ of the body.
    ///
    /// ```text
    /// world axes:  ∂τ = [Aᵀ t]×
    /// body axes:   ∂F = −A [f]×
    /// ```
    pub fn by_turn(&self, state: &State) -> (Matrix3<f64>, Matrix3<f64>) {
        let turned = rotation(&state.attitude);
        match self.axes {
            ControlFrame::World => (Matrix3::zeros(), turned.tr_mul(&self.torque).cross_matrix()),
            ControlFrame::Body => (-(turned * self.force.cross_matrix()), Matrix3::zeros()),
        }
    }
}

/// Right Jacobian of the exponential map at the rotation vector θ:
///
/// ```text
/// E − (1 − cos |θ|)/|θ|² [θ]× + (|θ| − sin |θ|)/|θ|³ [θ]×²
/// ```
fn right_jacobian(theta: &Vector3<f64>) -> Matrix3<f64> {
    let angle = theta.norm();
    let cross = theta.cross_matrix();
    // Series for small angles, where the differences lose all digits.
    let (first, second) = if angle < 1e-2 {
        let square = angle * angle;
        (0.5 - square / 24.0, 1.0 / 6.0 - square / 120.0)
    } else {
        let (sin, cos) = libm::sincos(angle);
        let square = angle * angle;
        ((1.0 - cos) / square, (angle - sin) / (square * angle))
    };
    Matrix3::identity() - first * cross + second * cross * cross
}

#[cfg(test)]
#[path = "tests/control.rs"]
mod tests;
