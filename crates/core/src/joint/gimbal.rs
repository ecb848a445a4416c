//! The angles of two or three hinges in one place, one after the other: Euler's, of the turn
//!
//! ```text
//! Q = q_y(β) ⊗ q_z(γ) ⊗ q_x(α)                                             (J13)
//! ```
//!
//! of A's frame against B's. The first axis, y, is fixed in B, the last, x, in A, and the middle one, z, is carried by
//! the first. With the half angles written out, the sum and the difference of the outer ones are angles in two planes,
//!
//! ```text
//! ½ (β + α) = arg (w + z, x + y),   ½ (β − α) = arg (w − z, y − x),
//! ½ (γ + π/2) = arg (|(w − z, y − x)|, |(w + z, x + y)|),                      (J14)
//! ```
//!
//! and so are (α + π, β + π, π − γ). Where γ is a quarter turn one of the pairs is nothing, and so is what it tells.

use super::{Joint, JointAxis, JointFrame, TurnKind};
use crate::error::{Error, in_range};
use crate::mechanics::State;
use nalgebra::{Matrix3, Matrix4x3, Rotation3, RowVector3, UnitQuaternion, Vector3, Vector4};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// What the angle of a gimbal's middle axis is counted from and which way: it is `sign` (γ − `zero`) of (J13).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(any(feature = "save", feature = "serde"), derive(serde::Serialize, serde::Deserialize))]
pub struct Middle {
    /// Whether it is −γ that is counted.
    pub backwards: bool,
    /// γ at its zero, rad, −π to π.
    pub zero: f64,
}

impl Middle {
    /// That of hinges about y, z and x: γ itself.
    pub const STRAIGHT: Self = Self { backwards: false, zero: 0.0 };

    /// γ of its angle, rad.
    fn raw(&self, angle: f64) -> f64 {
        self.sign() * angle + self.zero
    }

    /// Its angle of γ, rad.
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

/// How far from square two axes of hinges that follow each other may be, and within what of a parallel position
/// of the first and the last a gimbal cannot start, rad.
const SQUARE: f64 = 1e-6;

/// What a pair of (J14) counts at least, so that derivatives stay finite.
const LEAST: f64 = 1e-12;

/// Of hinges one after the other in one place, as files of robots have them on one body, the axes of the joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hinges {
    /// The frames of A and B, at `place` in each.
    pub frames: [JointFrame; 2],
    /// The middle axis.
    pub middle: Middle,
}

impl Hinges {
    /// The axis of the joint that the first hinge, which is in B, turns about, of the second and of the third; of two hinges the
    /// first and the last of these.
    pub const AXES: [JointAxis; 3] =
        [JointAxis::Angular(1), JointAxis::Angular(2), JointAxis::Angular(0)];

    /// Those about the `axes`, as they are in both of the `frames` while all angles are zero: the first one carries the
    /// second, this one the third, and the third A. `frames` are in A and in B.
    ///
    /// # Errors
    /// Axes of no length; axes that follow each other and are not at a right angle.
    pub fn new(frames: [JointFrame; 2], axes: [Vector3<f64>; 3]) -> Result<Self, Error> {
        let mut unit = axes;
        for axis in &mut unit {
            let length = in_range("length of an axis", axis.norm(), 1e-9, 1e9, "1e-9 to 1e9")?;
            *axis /= length;
        }
        let [first, middle, last] = unit;
        let skew = first.dot(&middle).abs().max(middle.dot(&last).abs());
        in_range("cosine between axes of hinges that follow each other", skew, 0.0, SQUARE, "0")?;
        // z = ±middle, so that x = y × z leans by at most a quarter turn to the last.
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

/// The quaternion of a rotation.
fn quaternion(matrix: &Matrix3<f64>) -> Vector4<f64> {
    let of = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*matrix));
    Vector4::new(of.w, of.i, of.j, of.k)
}

/// A pair of (J14), and the derivatives of its two numbers by (w, x, y, z).
struct AxisPair {
    at: [f64; 2],
    by: [Vector4<f64>; 2],
}

impl AxisPair {
    /// That of the sum, and that of the difference.
    fn both(q: &Vector4<f64>) -> [Self; 2] {
        let pair = |by: [Vector4<f64>; 2]| Self { at: [by[0].dot(q), by[1].dot(q)], by };
        [
            pair([Vector4::new(1.0, 0.0, 0.0, 1.0), Vector4::new(0.0, 1.0, 1.0, 0.0)]),
            pair([Vector4::new(1.0, 0.0, 0.0, -1.0), Vector4::new(0.0, -1.0, 1.0, 0.0)]),
        ]
    }

    fn size(&self) -> f64 {
        self.at[0].hypot(self.at[1])
    }

    /// Twice its argument.
    fn angle(&self) -> f64 {
        2.0 * libm::atan2(self.at[1], self.at[0])
    }

    /// ∂ of its argument.
    fn turning(&self) -> Vector4<f64> {
        let size = self.size().max(LEAST);
        (self.by[1] * self.at[0] - self.by[0] * self.at[1]) / (size * size)
    }

    /// ∂ of its size.
    fn growing(&self) -> Vector4<f64> {
        (self.by[0] * self.at[0] + self.by[1] * self.at[1]) / self.size().max(LEAST)
    }
}

/// The angle that is `angle` but for whole turns and nearest to `near`.
pub(super) fn nearest(angle: f64, near: f64) -> f64 {
    angle + TAU * libm::round((near - angle) / TAU)
}

/// (α, β, γ) of (J14): of both triples, and with as many turns, those that are nearest to `near`.
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

/// ½ ∂(α, β, γ) by what (w, x, y, z) are by, of a turn at which the middle angle is `at`.
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

/// Which way the middle angle goes with the pairs of (J14), 1 or −1, where it is `at`: on the side of π − γ the other one.
pub(super) fn side(at: f64, middle: &Middle) -> f64 {
    if libm::cos(middle.raw(at)) < 0.0 { -middle.sign() } else { middle.sign() }
}

impl Joint {
    /// Whether the first and the last axis of a gimbal are one at `states`, so that its angles are not told apart.
    pub(crate) fn is_folded(&self, states: &[State]) -> bool {
        let Some(at) = self.coordinates(states) else { return false };
        let pairs = AxisPair::both(&at.turn);
        self.turning() == TurnKind::Gimbal && pairs.iter().any(|pair| pair.size() < SQUARE)
    }
}

#[cfg(test)]
mod tests {
    use super::angles as angles_of;
    use super::*;
    use crate::mechanics::quaternion::left;

    fn about(axis: usize, angle: f64) -> Vector4<f64> {
        let mut turn = Vector4::new((0.5 * angle).cos(), 0.0, 0.0, 0.0);
        turn[axis + 1] = (0.5 * angle).sin();
        turn
    }

    /// (J13).
    fn turn(angles: &Vector3<f64>, middle: &Middle) -> Vector4<f64> {
        let first = left(&about(1, angles[1])) * about(2, middle.raw(angles[2]));
        left(&first) * about(0, angles[0])
    }

    const MIDDLES: [Middle; 3] = [
        Middle::STRAIGHT,
        Middle { backwards: true, zero: 0.0 },
        Middle { backwards: true, zero: 0.4 },
    ];

    /// Angles beyond a quarter turn of the middle one, and with turns: found again from near.
    #[test]
    fn the_angles_are_those_that_the_turn_was_made_of() {
        for middle in &MIDDLES {
            for k in 0..4000 {
                let k = f64::from(k);
                let angles = Vector3::new(0.37 * k, -0.113 * k, 0.0071 * k);
                let near = angles + Vector3::new(0.3, -0.4, 0.2) * (k * 0.7).sin();
                if middle.raw(angles[2]).cos().abs() < 0.3 {
                    continue;
                }
                let q = turn(&angles, middle);
                for q in [q, -q] {
                    let found = angles_of(&q, &near, middle);
                    assert!((found - angles).amax() < 1e-12 * (1.0 + k), "{found} {angles}");
                }
            }
        }
    }

    #[test]
    fn the_slopes_are_those_of_the_angles() {
        const STEP: f64 = 1e-6;
        for middle in &MIDDLES {
            for k in 0..300 {
                let k = f64::from(k);
                let at = Vector3::new((0.9 * k).sin(), (1.7 * k).cos(), 3.0 * (0.31 * k).sin());
                if middle.raw(at[2]).cos().abs() < 0.1 {
                    continue;
                }
                let q = turn(&at, middle);
                let columns = [0, 1, 2].map(|k| left(&q) * about(k, PI));
                let rows = slopes(&q, at[2], middle, &Matrix4x3::from_columns(&columns));
                for (column, by) in columns.iter().enumerate() {
                    let moved = |step: f64| angles_of(&(q + by * step), &at, middle);
                    let found = (moved(STEP) - moved(-STEP)) / (4.0 * STEP);
                    for row in 0..3 {
                        let off = (found[row] - rows[row][column]).abs();
                        assert!(off < 1e-7, "{at} {row} {column}: {off}");
                    }
                }
            }
        }
    }

    /// Hinges about any axes, one square to the next, turn as their product does.
    #[test]
    fn hinges_turn_one_after_the_other() {
        let y = Vector3::new(0.3, -0.5, 0.8).normalize();
        let z = y.cross(&Vector3::x()).normalize();
        let frame = JointFrame { anchor: Vector3::zeros(), attitude: about(0, 0.7) };
        for lean in [0.0, 0.5, -1.2, 2.0, 3.0, -2.5] {
            let last = y.cross(&z) * f64::cos(lean) + y * f64::sin(lean);
            // Any length and not quite square.
            let axes = [y * 2.0, z + y * 1e-9, last * 0.1];
            let of = Hinges::new([frame, frame], axes).unwrap();
            let angles = [0.4, -0.3, 0.9];
            let unit = |axis: &Vector3<f64>, angle: f64| {
                let along = axis.normalize() * f64::sin(0.5 * angle);
                Vector4::new(f64::cos(0.5 * angle), along[0], along[1], along[2])
            };
            let [a, b, c] = [0, 1, 2].map(|k| unit(&[y, z, last][k], angles[k]));
            let turned = left(&(left(&a) * b)) * c;
            let conjugated = |q: Vector4<f64>| Vector4::new(q[0], -q[1], -q[2], -q[3]);
            // As (J1) has it: A's frame against B's, both given in the one at angles of zero.
            let [in_a, in_b] = of.frames.map(|of| left(&conjugated(frame.attitude)) * of.attitude);
            let q = left(&(left(&conjugated(in_b)) * turned)) * in_a;
            let found = angles_of(&q, &Vector3::zeros(), &of.middle);
            for (k, axis) in Hinges::AXES.iter().enumerate() {
                let JointAxis::Angular(axis) = *axis else { unreachable!() };
                assert!((found[axis] - angles[k]).abs() < 1e-8, "{lean}: {found}");
            }
        }
        let skew = [y, y + z, y.cross(&z)];
        let error = Hinges::new([frame, frame], skew).unwrap_err().to_string();
        assert!(error.contains("axes of hinges"), "{error}");
    }
}
