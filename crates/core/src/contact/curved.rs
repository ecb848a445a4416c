//! Gaps that have a closed form beyond the tangent plane at k.
//!
//! An [`Ellipsoid`] c + S y, |y| ≤ 1, against a plane n·x = d has the gap
//!
//! ```text
//! φ = n·c − d − ρ − |Sᵀ n|_u                                               (eq. 4c)
//! ```
//!
//! in the frame of the ellipsoid. The nearest point is c − S u with u = Sᵀ n/|Sᵀ n|. Its force acts
//! at one place of the step. So u may turn by 60° in a step, as the direction of D in eq. 4b below.
//! Up to there |·|_u is the norm. A disc that claps flat has other contacts on the other side.
//!
//! The derivative of φ with respect to the bodies' motion is that of the nearest point, because this
//! point is optimal. Let y be the vector from the centre to it. The slip combines the motion of the
//! centre with the rotation of y, so that rolling has no slip.
//!
//! The power of a force at y differs from the rate of the gap, because y moves over the surface
//! within the step. With half kicks the force acts at the y of the start, the middle between the velocities before
//! and after it. What it adds to the one velocity it takes from the other. With velocities of the ends of steps, a
//! force at the y of the start adds energy if φ is concave along the rotation. A force at the y of the end does if
//! φ is convex. So it acts at the y of the start or of the [predicted end](EllipsoidPoint::lever), whichever has
//! the smaller rate n·(ω × y).
//!
//! Two rounded features are a vertex or an edge each. A feature is a [`Core`] (a point or a segment)
//! with a radius. Let D be the shortest vector from
//! the core of B to the core of A. The gap has a closed form at every pose:
//!
//! ```text
//! φ = |D| − ρ_A − ρ_B,   D = p_A + s u_A − p_B − t u_B,   0 ≤ s, t ≤ 1       (eq. 4a)
//! ```
//!
//! Its derivative with respect to the bodies' motion is along D/|D| alone, because s and t are
//! optimal. A step uses the gap at k+1, while its force acts along the normal at k. A body must not
//! come out on the other side within a step. So |D| is used only while D has turned by less than
//! 60° from the normal. Beyond that angle it continues as a plane:
//!
//! ```text
//! |D|_n = max { m·D : |m| = 1, m·n ≥ ½ } ≤ |D|,                           (eq. 4b)
//! ```
//!
//! This is the distance from the cone behind the other core.

use crate::geometry::{Ellipsoid, closest_segment_parameters};
use crate::kinematics::StepMap;
use crate::mechanics::quaternion::rotation;
use crate::mechanics::{Pose, State};
use nalgebra::{Matrix3, Vector3};

/// c of eq. 4b: cosine of the largest angle by which D may turn in a step.
const COSINE: f64 = 0.5;
/// Sine of the same angle.
const SINE: f64 = 0.866_025_403_784_438_6;

/// Length of D below which it has no direction (m).
const SMALLEST: f64 = 1e-100;

/// A point, or a segment from `from` to `from + along` (m).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Core {
    /// The point, or the first end of the segment.
    pub from: Vector3<f64>,
    /// Vector to the second end; zero for a point.
    pub along: Vector3<f64>,
}

impl Core {
    /// The point `from + share · along`.
    pub fn at(&self, share: f64) -> Vector3<f64> {
        self.from + self.along * share
    }

    /// True if the core is a segment.
    pub fn is_segment(&self) -> bool {
        self.along != Vector3::zeros()
    }

    /// This core, rotated and then translated.
    pub fn moved(&self, rotation: &Matrix3<f64>, position: &Vector3<f64>) -> Self {
        Self { from: position + rotation * self.from, along: rotation * self.along }
    }
}

/// Data of a contact beyond its tangent plane at k.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum Curved {
    /// Two rounded features.
    Cores(CorePair),
    /// An ellipsoid of A against the plane of the contact.
    Ellipsoid(EllipsoidPoint),
}

impl Curved {
    /// The two rounded features, if it has them.
    pub fn cores(&self) -> Option<&CorePair> {
        match self {
            Self::Cores(pair) => Some(pair),
            Self::Ellipsoid(_) => None,
        }
    }
}

/// An ellipsoid (m, frame of A) and its nearest point at k.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct EllipsoidPoint {
    /// The ellipsoid.
    pub shape: Ellipsoid,
    /// u (unit): the point is c − S u. Zero for a disc that lies flat at k.
    pub toward: Vector3<f64>,
}

impl EllipsoidPoint {
    /// y: vector from the centre to the point where the force acts (m, frame of B, or world without
    /// B).
    ///
    /// The step `map` begins at the states of A and B. `normal` is the unit normal of
    /// the plane in the same frame as y.
    ///
    /// It is the nearest point of the start or of the end, as predicted with the spins at the start.
    pub fn lever(
        &self,
        normal: &Vector3<f64>,
        (a, b): (&State, Option<&State>),
        map: &StepMap,
    ) -> Vector3<f64> {
        let ahead_of = |state: &State| rotation(&map.advance(&state.attitude, &state.spin));
        let turn = turn_from(&rotation(&a.attitude), b.map(|b| rotation(&b.attitude)));
        let end = turn_from(&ahead_of(a), b.map(ahead_of));
        let start = -(turn * (self.shape.axes * self.toward));
        let ahead = self.shape.direction(&end.tr_mul(normal));
        let predicted = -(end * (self.shape.axes * ahead));
        let mut spin = turn * a.spin;
        if let Some(b) = b {
            spin -= b.spin;
        }
        let across = normal.cross(&spin);
        let is_ahead = ahead.dot(&self.toward) >= COSINE && across.dot(&(predicted - start)) < 0.0;
        if is_ahead { predicted } else { start }
    }

    /// True if the nearest point may turn to the direction `toward` in a step: by at most 60°.
    pub fn reaches(&self, toward: &Vector3<f64>) -> bool {
        toward.dot(&self.toward) >= COSINE * toward.norm()
    }

    /// |Sᵀ n|_u (m) for the normal `n` in the frame of A, with u at its maximum.
    pub fn width(&self, n: &Vector3<f64>) -> Reach {
        Reach::new(&self.shape.axes.tr_mul(n), &self.toward)
    }
}

/// Rotation from the frame of A to the frame of B, or to the world without B.
pub(super) fn turn_from(a: &Matrix3<f64>, b: Option<Matrix3<f64>>) -> Matrix3<f64> {
    b.map_or(*a, |b| b.tr_mul(a))
}

/// Two rounded features.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct CorePair {
    /// Core of A (m, frame of A).
    pub of_a: Core,
    /// Core of B (m, frame of B, or world for a fixed piece).
    pub of_b: Core,
    /// ρ_B: radius of B (m).
    pub radius: f64,
    /// s and t: parameters of the closest points of A and B at k.
    pub shares: (f64, f64),
}

impl CorePair {
    /// Closest point of A's core to B's with A at `a` and B at `b`, and the vector from B's (m, world).
    pub fn nearest(&self, a: &Pose, b: &Pose) -> (Vector3<f64>, Vector3<f64>) {
        let of_a = self.of_a.moved(&a.rotation, &a.position);
        let of_b = self.of_b.moved(&b.rotation, &b.position);
        let (shares, offset_vector) = closest_vector(&of_a, &of_b);
        (of_a.at(shares.0), offset_vector)
    }

    /// Closest point on A's core at k (m, frame of A).
    pub fn point(&self) -> Vector3<f64> {
        self.of_a.at(self.shares.0)
    }

    /// Closest point on B's core at k (m, frame of B).
    pub fn foot(&self) -> Vector3<f64> {
        self.of_b.at(self.shares.1)
    }
}

/// Parameters s and t of the closest points of two cores, and the vector D from `b` to `a` (m).
pub fn closest_vector(a: &Core, b: &Core) -> ((f64, f64), Vector3<f64>) {
    let shares = closest_segment_parameters(&a.from, &a.along, &b.from, &b.along);
    (shares, a.at(shares.0) - b.at(shares.1))
}

/// |D|_n (eq. 4b) and its gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// |D|_n (m).
    pub length: f64,
    /// m at the maximum, unit: the gradient ∂|D|_n/∂D.
    pub direction: Vector3<f64>,
    /// True if the length is |D| itself.
    pub is_exact: bool,
}

impl Reach {
    /// Evaluates |D|_n for the vector `d` (m) and the unit normal `normal` at k.
    pub fn new(d: &Vector3<f64>, normal: &Vector3<f64>) -> Self {
        let (length, along) = (d.norm(), normal.dot(d));
        if along >= COSINE * length {
            let direction = if length > 0.0 { d / length } else { *normal };
            return Self { length, direction, is_exact: true };
        }
        // Directly behind, all tangential directions are equivalent.
        let across = (d - normal * along).try_normalize(SMALLEST).unwrap_or_else(|| {
            let axis = Vector3::ith(normal.iamin(), 1.0);
            (axis - normal * normal.dot(&axis)).normalize()
        });
        let direction = COSINE * normal + SINE * across;
        Self { length: direction.dot(d), direction, is_exact: false }
    }

    /// |D|_n minus that of an earlier vector with its reach (m), without cancellation.
    pub fn beyond(&self, d: &Vector3<f64>, (was, before): (&Vector3<f64>, &Self)) -> f64 {
        let sum = self.length + before.length;
        if self.is_exact && before.is_exact && sum > 0.0 {
            return (d - was).dot(&(d + was)) / sum;
        }
        self.length - before.length
    }
}

#[cfg(test)]
#[path = "tests/curved.rs"]
mod tests;
