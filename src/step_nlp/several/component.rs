//! A component of a contact's motion: its value, and its first and second derivatives with respect
//! to the poses.

use nalgebra::{Matrix3, Matrix3x4, Matrix4, Vector3, Vector4};
use tumble_core::mechanics::State;
use tumble_core::mechanics::quaternion::rotated_point_forms;

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

/// A vector of a body with its forms (eq. 3).
#[derive(Debug, Clone)]
pub(super) struct TurnedPoint {
    pub(super) vector: Vector3<f64>,
    pub(super) forms: Forms,
}

impl TurnedPoint {
    pub(super) fn new(vector: Vector3<f64>) -> Self {
        Self { vector, forms: rotated_point_forms(&vector) }
    }
}

/// A point of A (m, frame of A) and a point of B (m, frame of B).
#[derive(Debug, Clone)]
pub(crate) struct PointPair {
    point: TurnedPoint,
    foot: TurnedPoint,
}

impl PointPair {
    pub(super) fn new(point: Vector3<f64>, foot: Vector3<f64>) -> Self {
        Self { point: TurnedPoint::new(point), foot: TurnedPoint::new(foot) }
    }

    /// Component e·(p_A − p_B) along a world direction e:
    ///
    /// ```text
    /// ∂g/∂r_A = e,   ∂g/∂q_A = J_Aᵀ e,   ∂g/∂q_B = −J_Bᵀ e                     (eq. D12)
    /// ```
    pub(crate) fn along(&self, e: &Vector3<f64>, at: PosePair) -> MotionComponent {
        let PosePair { a, b } = at;
        let turned_a = rows(&self.point.forms, &a.attitude);
        let mut apart = a.position + 0.5 * turned_a * a.attitude;
        let mut turned_b = Matrix3x4::zeros();
        apart -= match b {
            Some(b) => {
                turned_b = rows(&self.foot.forms, &b.attitude);
                b.position + 0.5 * turned_b * b.attitude
            }
            None => self.foot.vector,
        };
        MotionComponent {
            value: e.dot(&apart),
            by_position: *e,
            by_a: turned_a.tr_mul(e),
            by_b: -turned_b.tr_mul(e),
        }
    }

    /// Second derivatives of [`Self::along`]: Σ e_k Q_k(a) for q_A, −Σ e_k Q_k(b) for q_B.
    pub(crate) fn along_curvature(&self, e: &Vector3<f64>) -> Curvature {
        Curvature {
            aa: weighted(&self.point.forms, e),
            bb: -weighted(&self.foot.forms, e),
            ..Curvature::default()
        }
    }
}
