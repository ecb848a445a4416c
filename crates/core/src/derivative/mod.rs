//! Differentials of a step's data: arguments and results of its derivatives.
//!
//! A [`StateChange`] has twelve numbers, because an attitude changes by a rotation vector.
//! `ContactTangent` differentiates the motion and the lever arms of a contact with respect to the
//! bodies at the start of the step, and `JointTangent` the rows of a joint.
//! [`StepDerivative`](crate::solver::native::StepDerivative) differentiates the step itself and
//! solves for the final velocities.
//!
//! Equation numbers G1, G2, … are those of `docs/gradients.md`.

mod contact;
mod joint;
mod placement;
mod side;
mod untracked;

pub(crate) use contact::{
    ContactTangent, PlacedFeatures, PredictedStep, RateSlopes, RowChange, RowSlopes,
};
pub(crate) use joint::{JointTangent, RowsTangent};
pub(crate) use side::SideChangeInput;
pub(crate) use untracked::nearest_untracked;

use crate::kinematics::StepMap;
use crate::mechanics::{State, quaternion};
use nalgebra::{Matrix3, Matrix6, SMatrix, Vector3, Vector4};

/// Differential of a body's state, or gradient with respect to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateChange {
    /// Position δr (m), world frame.
    pub position: Vector3<f64>,
    /// Rotation δθ (rad), **body** frame: A(q) becomes `A(q) (E + [δθ]×)`, and q becomes q + ½ L(q)
    /// H δθ.
    pub turn: Vector3<f64>,
    /// Velocity δv (m/s), world frame.
    pub velocity: Vector3<f64>,
    /// Spin δω (rad/s), **body** frame.
    pub spin: Vector3<f64>,
}

impl StateChange {
    /// Number of components.
    pub const LEN: usize = 12;

    /// Zero change.
    pub fn zero() -> Self {
        let zero = Vector3::zeros();
        Self { position: zero, turn: zero, velocity: zero, spin: zero }
    }

    /// Components in the order of the fields.
    pub fn to_array(&self) -> [f64; Self::LEN] {
        let mut numbers = [0.0; Self::LEN];
        let parts = [&self.position, &self.turn, &self.velocity, &self.spin];
        for (numbers, part) in numbers.chunks_exact_mut(3).zip(parts) {
            numbers.copy_from_slice(part.as_slice());
        }
        numbers
    }

    /// Creates a change from its components.
    pub fn from_array(numbers: &[f64; Self::LEN]) -> Self {
        let part = |k: usize| Vector3::from_column_slice(&numbers[3 * k..3 * k + 3]);
        Self { position: part(0), turn: part(1), velocity: part(2), spin: part(3) }
    }

    /// Scalar product of all components.
    pub fn dot(&self, other: &Self) -> f64 {
        self.position.dot(&other.position)
            + self.turn.dot(&other.turn)
            + self.velocity.dot(&other.velocity)
            + self.spin.dot(&other.spin)
    }

    /// This change times `factor`.
    #[cfg(feature = "save")]
    pub fn scaled(&self, factor: f64) -> Self {
        Self::zero().plus(factor, self)
    }

    /// The velocity and the spin of this change alone.
    #[cfg(feature = "save")]
    pub(crate) fn velocities(&self) -> Self {
        Self { velocity: self.velocity, spin: self.spin, ..Self::zero() }
    }

    /// Sum of this change and `factor` times `other`.
    pub fn plus(&self, factor: f64, other: &Self) -> Self {
        Self {
            position: self.position + other.position * factor,
            turn: self.turn + other.turn * factor,
            velocity: self.velocity + other.velocity * factor,
            spin: self.spin + other.spin * factor,
        }
    }

    /// Applies this change, of any size, to `state`. δθ is a rotation vector. A zero rotation keeps
    /// the attitude to the last bit.
    pub fn applied(&self, state: &State) -> State {
        let angle = self.turn.norm();
        let (sin, cos) = libm::sincos(0.5 * angle);
        let axis = if angle == 0.0 { self.turn } else { self.turn / angle };
        let turned = Vector4::new(cos, sin * axis[0], sin * axis[1], sin * axis[2]);
        State {
            position: state.position + self.position,
            attitude: if angle == 0.0 {
                state.attitude
            } else {
                (quaternion::left(&state.attitude) * turned).normalize()
            },
            velocity: state.velocity + self.velocity,
            spin: state.spin + self.spin,
        }
    }

    /// Change that turns `from` into `to`, with a rotation of at most half a turn; the inverse of
    /// [`StateChange::applied`].
    pub fn between(from: &State, to: &State) -> Self {
        let turn = quaternion::product(&quaternion::conjugated(&from.attitude), &to.attitude);
        Self {
            position: to.position - from.position,
            turn: quaternion::rotation_vector(&turn),
            velocity: to.velocity - from.velocity,
            spin: to.spin - from.spin,
        }
    }
}

/// Linear map from the start of a step to its end. With a = ½ h γ ω⁺ (8e), the Cayley map C of a and
/// W = ∂(γ ω)/∂ω⁺,
///
/// ```text
/// δr⁺ = δr + h δv⁺,   δθ⁺ = Cᵀ δθ + h T δω⁺,   T = (E − [a]×) W/(1 + a·a)                (G1)
/// ```
#[derive(Debug, Clone, Copy)]
pub(crate) struct EndMap {
    time_step: f64,
    /// Rotation Cᵀ.
    back: Matrix3<f64>,
    /// Matrix h T.
    turning: Matrix3<f64>,
    velocity: Vector3<f64>,
    /// Derivative of the rotation with respect to h (rad/s).
    rate: Vector3<f64>,
}

impl EndMap {
    /// Map of a step with these final velocities.
    pub(crate) fn new(velocity: &Vector3<f64>, spin: &Vector3<f64>, map: &StepMap) -> Self {
        let time_step = map.time_step;
        let stretch = map.stretch(spin);
        let a = spin * (0.5 * time_step * stretch.gamma);
        let shrink = 1.0 / (1.0 + a.norm_squared());
        let cross = a.cross_matrix();
        // C = E + 2 ([a]× + [a]×[a]×)/(1 + a·a); its transpose has −a.
        let back = Matrix3::identity() + (cross * cross - cross) * (2.0 * shrink);
        let turning = stretch.chained((Matrix3::identity() - cross) * (shrink * time_step), spin);
        Self { time_step, back, turning, velocity: *velocity, rate: spin * map.rate(spin) }
    }

    /// Rotation of the end (rad, body frame at the end) by the spin ω⁺.
    pub(crate) fn turning(&self) -> &Matrix3<f64> {
        &self.turning
    }

    /// Applies the map to differentials of the initial state, of V⁺ and of h.
    pub(crate) fn jvp(
        &self,
        start: &StateChange,
        linear: &Vector3<f64>,
        spin: &Vector3<f64>,
        time_step: f64,
    ) -> StateChange {
        StateChange {
            position: start.position + linear * self.time_step + self.velocity * time_step,
            turn: self.back * start.turn + self.turning * spin + self.rate * time_step,
            velocity: *linear,
            spin: *spin,
        }
    }

    /// Adds the contribution of the six columns `solved` of δV⁺ to six columns of δX⁺, from `first`
    /// on.
    pub(crate) fn add_velocities(
        &self,
        solved: &Matrix6<f64>,
        first: usize,
        end: &mut SMatrix<f64, 12, 12>,
    ) {
        let (linear, spin) = (solved.fixed_rows::<3>(0), solved.fixed_rows::<3>(3));
        let mut add = |row: usize, part: SMatrix<f64, 3, 6>| {
            let mut rows = end.fixed_view_mut::<3, 6>(row, first);
            rows += part;
        };
        add(0, linear * self.time_step);
        add(3, self.turning * spin);
        add(6, linear.into_owned());
        add(9, spin.into_owned());
    }

    /// Jacobian ∂X⁺/∂X at fixed V⁺.
    pub(crate) fn jacobian_wrt_state(&self) -> SMatrix<f64, 12, 12> {
        let mut columns = SMatrix::<f64, 12, 12>::zeros();
        columns.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
        columns.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.back);
        columns
    }

    /// Transposed map: converts gradients with respect to the final state to those with respect to
    /// the initial state, V⁺ and h.
    pub(crate) fn vjp(
        &self,
        end: &StateChange,
    ) -> (StateChange, (Vector3<f64>, Vector3<f64>), f64) {
        let start = StateChange {
            position: end.position,
            turn: self.back.tr_mul(&end.turn),
            ..StateChange::zero()
        };
        let linear = end.velocity + end.position * self.time_step;
        let spin = end.spin + self.turning.tr_mul(&end.turn);
        let time_step = end.position.dot(&self.velocity) + end.turn.dot(&self.rate);
        (start, (linear, spin), time_step)
    }
}

#[cfg(test)]
mod tests;
