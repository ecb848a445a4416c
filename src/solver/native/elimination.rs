//! The 6 × 6 system that is left when every contact has been eliminated.

use super::equations::{StepEquations, Velocity};
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// One contact solved for its impulse: δp̂ = offset + gain · δu with δu = δv + slope δω.
#[derive(Debug, Clone, Copy)]
pub(super) struct Elimination {
    offset: Vector3<f64>,
    gain: Gain,
    slope: Matrix3<f64>,
}

/// What an impulse gains by a change of its point's motion.
#[derive(Debug, Clone, Copy)]
enum Gain {
    /// An open contact: nothing.
    Zero,
    /// A sticking one: −k E.
    Spring(f64),
    Full(Matrix3<f64>),
}

/// The linearised equations of motion with the contacts added one by one (N8):
///
/// ```text
/// ⎡ E − Σ D        − Σ D J          ⎤ ⎡δv⎤   ⎡ −r_v + Σ d          ⎤
/// ⎣ − Σ G D    M(ω) − Σ G D J       ⎦ ⎣δω⎦ = ⎣ −r_ω + Σ G d        ⎦
/// ```
///
/// with G = [c]× Aᵀ, J = ∂u/∂ω, and (d, D) the offset and gain of a contact.
pub(super) struct MotionSystem {
    linear_linear: Matrix3<f64>,
    linear_angular: Matrix3<f64>,
    angular_linear: Matrix3<f64>,
    angular_angular: Matrix3<f64>,
    linear: Vector3<f64>,
    angular: Vector3<f64>,
}

impl MotionSystem {
    /// The system without contacts at a point of the iteration.
    pub(super) fn new(
        equations: &StepEquations,
        velocity: &Velocity,
        impulses: &[Vector3<f64>],
    ) -> Self {
        let (linear, angular) = equations.motion_residual(velocity, impulses);
        Self {
            linear_linear: Matrix3::identity(),
            linear_angular: Matrix3::zeros(),
            angular_linear: Matrix3::zeros(),
            angular_angular: equations.angular_slope(&velocity.spin),
            linear: -linear,
            angular: -angular,
        }
    }

    /// Adds a contact with its torque map G.
    #[inline]
    pub(super) fn add(&mut self, torque_map: &Matrix3<f64>, contact: &Elimination) {
        self.linear += contact.offset;
        self.angular += torque_map * contact.offset;
        match &contact.gain {
            Gain::Zero => {}
            Gain::Spring(stiffness) => {
                let by_spin = contact.slope * -stiffness;
                for k in 0..3 {
                    self.linear_linear[(k, k)] += stiffness;
                }
                self.linear_angular -= by_spin;
                self.angular_linear += torque_map * *stiffness;
                self.angular_angular -= torque_map * by_spin;
            }
            Gain::Full(gain) => {
                let by_spin = gain * contact.slope;
                self.linear_linear -= gain;
                self.linear_angular -= by_spin;
                self.angular_linear -= torque_map * gain;
                self.angular_angular -= torque_map * by_spin;
            }
        }
    }

    /// (δv, δω), `None` where the matrix is singular.
    pub(super) fn solve(&self) -> Option<Velocity> {
        let mut matrix = Matrix6::zeros();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.linear_linear);
        matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&self.linear_angular);
        matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&self.angular_linear);
        matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.angular_angular);
        let mut rhs = Vector6::zeros();
        rhs.fixed_rows_mut::<3>(0).copy_from(&self.linear);
        rhs.fixed_rows_mut::<3>(3).copy_from(&self.angular);
        let solvable = matrix.lu().solve_mut(&mut rhs) && rhs.iter().all(|x| x.is_finite());
        solvable.then(|| Velocity {
            linear: rhs.fixed_rows::<3>(0).into(),
            spin: rhs.fixed_rows::<3>(3).into(),
        })
    }
}

impl Elimination {
    /// p̂ = 0.
    pub(super) fn open(impulse: &Vector3<f64>) -> Self {
        Self { offset: -impulse, gain: Gain::Zero, slope: Matrix3::zeros() }
    }

    /// A spring of `stiffness` in all directions.
    pub(super) fn stick(offset: Vector3<f64>, stiffness: f64, slope: Matrix3<f64>) -> Self {
        Self { offset, gain: Gain::Spring(stiffness), slope }
    }

    /// Any gain.
    pub(super) fn full(offset: Vector3<f64>, gain: Matrix3<f64>, slope: Matrix3<f64>) -> Self {
        Self { offset, gain: Gain::Full(gain), slope }
    }

    /// δp̂ for a change of the velocities.
    #[inline]
    pub(super) fn impulse_step(&self, change: &Velocity) -> Vector3<f64> {
        match &self.gain {
            Gain::Zero => self.offset,
            Gain::Spring(stiffness) => self.offset - self.point_step(change) * *stiffness,
            Gain::Full(gain) => self.offset + gain * self.point_step(change),
        }
    }

    /// δu for a change of the velocities.
    pub(super) fn point_step(&self, change: &Velocity) -> Vector3<f64> {
        change.linear + self.slope * change.spin
    }
}
