//! Euler angles of two or three intersecting hinges in series. The rotation of A's frame relative
//! to B's is
//!
//! ```text
//! Q = q_y(β) ⊗ q_z(γ) ⊗ q_x(α)                                             (J13)
//! ```
//!
//! The first axis, y, is fixed in B. The last, x, is fixed in A. The middle one, z, rotates with
//! the first. Sum and difference of the outer angles are angles in two planes:
//!
//! ```text
//! ½ (β + α) = arg (w + z, x + y),   ½ (β − α) = arg (w − z, y − x),
//! ½ (γ + π/2) = arg (|(w − z, y − x)|, |(w + z, x + y)|),                      (J14)
//! ```
//!
//! The angles (α + π, β + π, π − γ) describe the same rotation. At γ = ±π/2 one of the pairs
//! vanishes and its angle is undefined (gimbal lock).

use super::{Joint, JointAxis, JointFrame, TurnKind};
use crate::error::{Error, in_range};
use crate::mechanics::State;
use nalgebra::{Matrix3, Matrix4x3, Rotation3, RowVector3, UnitQuaternion, Vector3, Vector4};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Zero and sense of a gimbal's middle angle: `sign` (γ − `zero`) of (J13).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(any(feature = "save", feature = "serde"), derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Middle {
    /// True if the middle angle counts −γ.
    pub backwards: bool,
    /// Value of γ at the zero of the middle angle (rad), −π to π.
    pub zero: f64,
}

impl Middle {
    /// Middle axis of hinges about y, z and x: the middle angle is γ.
    pub const STRAIGHT: Self = Self { backwards: false, zero: 0.0 };

    /// Converts the middle angle to γ (rad).
    fn raw(&self, angle: f64) -> f64 {
        self.sign() * angle + self.zero
    }

    /// Converts γ to the middle angle (rad).
    fn angle(&self, raw: f64) -> f64 {
        self.sign() * (raw - self.zero)
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        in_range("zero of a middle axis (rad)", self.zero, -PI, PI, "-pi to pi").map(|_| ())
    }

    fn sign(&self) -> f64 {
        if self.backwards { -1.0 } else { 1.0 }
    }
}

/// Largest deviation of consecutive hinge axes from a right angle, and smallest initial angle
/// between the first and the last axis of a gimbal (rad).
const SQUARE: f64 = 1e-6;

/// Lower bound of the norm of a pair of (J14), so that derivatives stay finite.
const LEAST: f64 = 1e-12;

/// Joint axes for two or three intersecting hinges in series, as robot files define them on one
/// body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hinges {
    /// Frames of the joint in A and B.
    pub frames: [JointFrame; 2],
    /// Middle axis.
    pub middle: Middle,
}

impl Hinges {
    /// Joint axes of the first hinge, in B, of the second and of the third. Two hinges use the
    /// first and the last of these.
    pub const AXES: [JointAxis; 3] =
        [JointAxis::Angular(1), JointAxis::Angular(2), JointAxis::Angular(0)];

    /// Converts hinges about `axes` to joint frames. The axes are given in both `frames` (in A and
    /// in B) at zero angles. The first hinge carries the second, which carries the third, which
    /// carries A.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if an axis has no length, or if consecutive axes are not orthogonal.
    pub fn new(frames: [JointFrame; 2], axes: [Vector3<f64>; 3]) -> Result<Self, Error> {
        let mut unit = axes;
        for axis in &mut unit {
            let length = in_range("length of an axis", axis.norm(), 1e-9, 1e9, "1e-9 to 1e9")?;
            *axis /= length;
        }
        let [first, middle, last] = unit;
        let skew = first.dot(&middle).abs().max(middle.dot(&last).abs());
        in_range("cosine between consecutive hinge axes", skew, 0.0, SQUARE, "0")?;
        // With z = ±middle, x = y × z is at most a quarter turn from the last axis.
        let backwards = first.cross(&middle).dot(&last) < 0.0;
        let z = if backwards { -middle } else { middle };
        let z = (z - first * first.dot(&z)).normalize();
        let x = first.cross(&z);
        let zero = libm::atan2(last.dot(&first), last.dot(&x));
        let of_b = quaternion(&Matrix3::from_columns(&[x, first, z]));
        let (sine, cosine) = libm::sincos(0.5 * zero);
        let of_a = turned(&of_b, &Vector4::new(cosine, 0.0, 0.0, sine));
        let [a, b] = frames;
        let at = |frame: JointFrame, by: &Vector4<f64>| JointFrame {
            attitude: turned(&frame.attitude, by),
            ..frame
        };
        Ok(Self { frames: [at(a, &of_a), at(b, &of_b)], middle: Middle { backwards, zero } })
    }
}

fn turned(by: &Vector4<f64>, first: &Vector4<f64>) -> Vector4<f64> {
    (crate::mechanics::quaternion::left(by) * first).normalize()
}

/// Quaternion of a rotation matrix.
fn quaternion(matrix: &Matrix3<f64>) -> Vector4<f64> {
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*matrix));
    Vector4::new(turn.w, turn.i, turn.j, turn.k)
}

/// Pair of numbers of (J14), with derivatives with respect to (w, x, y, z).
struct AxisPair {
    at: [f64; 2],
    by: [Vector4<f64>; 2],
}

impl AxisPair {
    /// The pairs of the sum and of the difference.
    fn both(q: &Vector4<f64>) -> [Self; 2] {
        let pair = |by: [Vector4<f64>; 2]| Self { at: [by[0].dot(q), by[1].dot(q)], by };
        [
            pair([Vector4::new(1.0, 0.0, 0.0, 1.0), Vector4::new(0.0, 1.0, 1.0, 0.0)]),
            pair([Vector4::new(1.0, 0.0, 0.0, -1.0), Vector4::new(0.0, -1.0, 1.0, 0.0)]),
        ]
    }

    fn size(&self) -> f64 {
        libm::hypot(self.at[0], self.at[1])
    }

    /// Twice the argument of the pair.
    fn angle(&self) -> f64 {
        2.0 * libm::atan2(self.at[1], self.at[0])
    }

    /// Gradient of the argument.
    fn turning(&self) -> Vector4<f64> {
        let size = self.size().max(LEAST);
        (self.by[1] * self.at[0] - self.by[0] * self.at[1]) / (size * size)
    }

    /// Gradient of the norm.
    fn growing(&self) -> Vector4<f64> {
        (self.by[0] * self.at[0] + self.by[1] * self.at[1]) / self.size().max(LEAST)
    }
}

/// Angle equal to `angle` modulo full turns and nearest to `near`.
pub(super) fn nearest(angle: f64, near: f64) -> f64 {
    angle + TAU * libm::round((near - angle) / TAU)
}

/// Angles (α, β, γ) of (J14): the one of both solutions, including full turns, that is nearest to
/// `near`.
pub(super) fn angles(q: &Vector4<f64>, near: &Vector3<f64>, middle: &Middle) -> Vector3<f64> {
    let [sum, difference] = AxisPair::both(q);
    let (outer, inner) = (sum.angle(), difference.angle());
    let (alpha, beta) = (0.5 * (outer - inner), 0.5 * (outer + inner));
    let gamma = 2.0 * libm::atan2(sum.size(), difference.size()) - FRAC_PI_2;
    let near = Vector3::new(near[0], near[1], middle.raw(near[2]));
    let counted = |angles: Vector3<f64>| angles.zip_map(&near, nearest);
    let one = counted(Vector3::new(alpha, beta, gamma));
    let other = counted(Vector3::new(alpha + PI, beta + PI, PI - gamma));
    let is_nearer = (other - near).norm_squared() < (one - near).norm_squared();
    let found = if is_nearer { other } else { one };
    Vector3::new(found[0], found[1], middle.angle(found[2]))
}

/// Half the derivatives of (α, β, γ), for the middle angle `at`; `by` holds the derivatives of (w,
/// x, y, z).
pub(super) fn slopes(
    q: &Vector4<f64>,
    at: f64,
    middle: &Middle,
    by: &Matrix4x3<f64>,
) -> [RowVector3<f64>; 3] {
    let [sum, difference] = AxisPair::both(q);
    let (outer, inner) = (sum.turning() * 0.5, difference.turning() * 0.5);
    let (a, b) = (sum.size(), difference.size());
    let side = side(at, middle);
    let along = (sum.growing() * b - difference.growing() * a) * (side / (a * a + b * b));
    [outer - inner, outer + inner, along].map(|slope| by.tr_mul(&slope).transpose())
}

/// Sign of the derivative of the middle angle with respect to the angle of (J14), at the middle
/// angle `at`. It flips for the second solution π − γ.
pub(super) fn side(at: f64, middle: &Middle) -> f64 {
    if libm::cos(middle.raw(at)) < 0.0 { -middle.sign() } else { middle.sign() }
}

impl Joint {
    /// True for a gimbal in gimbal lock: its first and last axis coincide at `states`.
    pub(crate) fn is_folded(&self, states: &[State]) -> bool {
        let Some(at) = self.coordinates(states) else { return false };
        let pairs = AxisPair::both(&at.turn);
        self.turning() == TurnKind::Gimbal && pairs.iter().any(|pair| pair.size() < SQUARE)
    }
}

#[cfg(test)]
#[path = "tests/gimbal.rs"]
mod tests;
