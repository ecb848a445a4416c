//! A component of a contact's motion: its value, and its first and second derivatives with respect
//! to the poses.

use nalgebra::{Matrix3, Matrix3x4, Matrix4, Vector3, Vector4};
use tumble_core::mechanics::State;

/// Forms Q_x, Q_y, Q_z of a vector (eq. 3).
pub(crate) type Forms = [Matrix4<f64>; 3];

/// Pose of a body in the program: r⁺ and q⁺. q⁺ need not have unit length.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ProgramPose {
    pub(crate) position: Vector3<f64>,
    pub(crate) attitude: Vector4<f64>,
}

/// Poses of the bodies of a contact: A, and B unless it is fixed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PosePair {
    pub(crate) a: ProgramPose,
    pub(crate) b: Option<ProgramPose>,
}

impl ProgramPose {
    pub(crate) fn of(state: &State) -> Self {
        Self { position: state.position, attitude: state.attitude }
    }
}

/// Component g = m·s of a point c of A along a direction e of B, seen from B (eq. 24), and its
/// first derivatives.
///
/// ```text
/// m = A(q_B) e,   s = r_A + A(q_A) c − r_B,   g = m·s
/// ∂g/∂r_A = m = −∂g/∂r_B,   ∂g/∂q_A = J_Aᵀ m,   ∂g/∂q_B = J_Bᵀ s           (eq. D7)
/// ```
///
/// J_A has the rows (Q_k(c) q_A)ᵀ and J_B the rows (Q_k(e) q_B)ᵀ. Round features use eq. D12.
pub(crate) struct MotionComponent {
    pub(crate) value: f64,
    /// ∂g/∂r_A.
    pub(crate) by_position: Vector3<f64>,
    /// ∂g/∂q_A.
    pub(crate) by_a: Vector4<f64>,
    /// ∂g/∂q_B.
    pub(crate) by_b: Vector4<f64>,
}

/// Second derivatives of a [`MotionComponent`] (eq. D8, D13). Derivatives with respect to r_B are
/// the negative of those with respect to r_A.
#[derive(Default)]
pub(crate) struct Curvature {
    /// ∂²g/∂q_A².
    pub(crate) aa: Matrix4<f64>,
    /// ∂²g/∂q_B².
    pub(crate) bb: Matrix4<f64>,
    /// ∂²g/∂q_A ∂q_B.
    pub(crate) ab: Matrix4<f64>,
    /// ∂²g/∂r_A ∂q_A.
    pub(crate) position_a: Matrix3x4<f64>,
    /// ∂²g/∂r_A ∂q_B.
    pub(crate) position_b: Matrix3x4<f64>,
    /// ∂²g/∂r_A².
    pub(crate) positions: Matrix3<f64>,
}

/// Σ w_k Q_k.
pub(crate) fn weighted(forms: &Forms, weights: &Vector3<f64>) -> Matrix4<f64> {
    forms.iter().zip(weights).map(|(form, weight)| form * *weight).sum()
}

/// Matrix with the rows (Q_k q)ᵀ.
pub(crate) fn rows(forms: &Forms, q: &Vector4<f64>) -> Matrix3x4<f64> {
    let [x, y, z] = [0, 1, 2].map(|k| (forms[k] * q).transpose());
    Matrix3x4::from_rows(&[x, y, z])
}
