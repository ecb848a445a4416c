//! Two pieces in the frame of A. The difference of the positions is computed first, so that pairs
//! far from the world origin lose no digits.

use super::axes::{AxisSource, PARALLEL};
use super::segment::span;
use super::{Hull, Piece, Smooth};
use crate::mechanics::Pose;
use nalgebra::{Matrix3, Vector3};

/// A piece and the pose of its body.
pub type PlacedPiece<'a> = (&'a Piece, &'a Pose);

/// Workspace of the narrow phase, shared by all pairs. It stops allocating after the largest hulls.
#[derive(Debug, Clone, Default)]
pub struct PairScratch {
    /// Vertices of B (m, frame of A).
    pub(super) vertices: Vec<Vector3<f64>>,
    /// Normals of B's faces (frame of A).
    pub(super) normals: Vec<Vector3<f64>>,
    /// Dot products of an edge of A with B's normals.
    pub(super) products: Vec<f64>,
    /// Edges of A and of B that may span the axis of largest separation.
    pub(super) edges: [Vec<usize>; 2],
    /// Candidate features for the closest points.
    pub(super) near: super::near::Near,
    /// Two faces to be intersected.
    pub(super) overlap: super::overlap::FaceOverlap,
}

/// Cache of one pair from step to step. It makes queries faster and does not change their results,
/// except for the last digits of smooth shapes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Hint {
    /// Last axis (unit, frame of B at that time, from A to B). Fixed pieces are B, so that the axis
    /// does not turn with a body that rolls on one.
    axis: Option<Vector3<f64>>,
    /// Features that spanned the axis, if any; the axis follows their rotation.
    kind: Option<AxisSource>,
}

impl Hint {
    /// Last axis (unit, world, from A to B), with B at `pose`.
    #[must_use]
    pub fn axis_from(&self, pose: &Pose) -> Option<Vector3<f64>> {
        self.axis.map(|axis| pose.rotation * axis)
    }

    /// The cached axis (unit, world), recomputed from the same features at the given poses.
    #[must_use]
    pub(super) fn axis_between(
        &self,
        a: PlacedPiece<'_>,
        b: PlacedPiece<'_>,
    ) -> Option<Vector3<f64>> {
        self.axis_of(&PiecePair::new(a, b)).map(|axis| a.1.rotation * axis)
    }

    /// The same axis in the frame of A.
    pub(super) fn axis_of(&self, pair: &PiecePair<'_>) -> Option<Vector3<f64>> {
        let before = pair.rotation * self.axis?;
        let now = self.kind.and_then(|kind| match kind {
            AxisSource::FaceA(face) => Some(pair.a.faces().get(face)?.normal),
            AxisSource::FaceB(face) => Some(pair.rotation * -pair.b.faces().get(face)?.normal),
            AxisSource::Edges(a, b) => {
                let along_a = span(pair.a.vertices(), pair.a.edges().get(a)?).1;
                let along_b = span(pair.b.vertices(), pair.b.edges().get(b)?).1;
                let across = along_a.cross(&(pair.rotation * along_b));
                across.try_normalize(PARALLEL * along_a.norm() * along_b.norm())
            }
        });
        // The cross product of two edges has an arbitrary sign.
        Some(now.map_or(before, |now| if now.dot(&before) < 0.0 { -now } else { now }))
    }

    /// Stores an axis (unit, frame of A, from A to B) and the features that span it, if any.
    pub(super) fn set(
        &mut self,
        pair: &PiecePair<'_>,
        axis: Option<Vector3<f64>>,
        kind: Option<AxisSource>,
    ) {
        (self.axis, self.kind) = (axis.map(|axis| pair.rotation.tr_mul(&axis)), kind);
    }
}

/// Two pieces seen from A.
#[derive(Clone, Copy)]
pub(super) struct PiecePair<'a> {
    pub a: &'a Hull,
    pub b: &'a Hull,
    pub radius_a: f64,
    pub radius_b: f64,
    pub smooth_a: Option<&'a Smooth>,
    pub smooth_b: Option<&'a Smooth>,
    /// Rotation from the frame of B to the frame of A.
    pub rotation: Matrix3<f64>,
    /// Origin of B (m, frame of A).
    pub shift: Vector3<f64>,
}

impl<'a> PiecePair<'a> {
    pub fn new((a, pose_a): PlacedPiece<'a>, (b, pose_b): PlacedPiece<'a>) -> Self {
        Self {
            a: a.core(),
            b: b.core(),
            radius_a: a.radius(),
            radius_b: b.radius(),
            smooth_a: a.smooth(),
            smooth_b: b.smooth(),
            rotation: pose_a.rotation.tr_mul(&pose_b.rotation),
            shift: pose_a.rotation.tr_mul(&(pose_b.position - pose_a.position)),
        }
    }

    /// Sum of both radii (m).
    pub fn radii(&self) -> f64 {
        self.radius_a + self.radius_b
    }

    /// Size of the smaller piece (m): the scale of tolerances.
    pub fn size(&self) -> f64 {
        (self.a.reach() + self.radius_a).min(self.b.reach() + self.radius_b)
    }

    /// Writes B's vertices and normals to `scratch` in the frame of A.
    pub fn place(&self, scratch: &mut PairScratch) {
        scratch.vertices.clear();
        scratch.vertices.extend(self.b.vertices().iter().map(|v| self.rotation * v + self.shift));
        scratch.normals.clear();
        scratch.normals.extend(self.b.faces().iter().map(|face| self.rotation * face.normal));
    }

    /// Gap in m along a unit vector (frame of A) plus the radii: a lower bound on the distance of
    /// the cores. A smooth shape is taken as it is.
    pub fn gap_along(&self, axis: &Vector3<f64>) -> f64 {
        let axis_b = self.rotation.tr_mul(axis);
        let low_b = match self.smooth_b {
            None => lowest(self.b.vertices(), &axis_b).1,
            Some(smooth) => self.radius_b - smooth.extent(&-axis_b),
        };
        let high_a = match self.smooth_a {
            None => highest(self.a.vertices(), axis).1,
            Some(smooth) => smooth.extent(axis) - self.radius_a,
        };
        low_b + axis.dot(&self.shift) - high_a
    }

    /// True if a piece has a smooth shape.
    pub fn is_smooth(&self) -> bool {
        self.smooth_a.is_some() || self.smooth_b.is_some()
    }

    /// The point of A and the point of B whose difference b − a is farthest along a unit vector (m,
    /// frame of A).
    pub fn extremes(&self, along: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let farthest =
            |hull: &Hull, radius: f64, smooth: Option<&Smooth>, n: &Vector3<f64>| match smooth {
                Some(smooth) => smooth.farthest(n),
                None => hull.vertices()[highest(hull.vertices(), n).0] + n * radius,
            };
        let along_b = self.rotation.tr_mul(along);
        let of_b = farthest(self.b, self.radius_b, self.smooth_b, &along_b);
        let of_a = farthest(self.a, self.radius_a, self.smooth_a, &-along);
        [of_a, self.rotation * of_b + self.shift]
    }

    /// The difference b − a that is farthest along a unit vector (m, frame of A).
    pub fn difference(&self, along: &Vector3<f64>) -> Vector3<f64> {
        let [a, b] = self.extremes(along);
        b - a
    }

    /// Lower bound on the distance of the cores (m), from their bounding balls and the cached axis.
    pub fn quick_gap(&self, hint: &Hint) -> f64 {
        let between = self.rotation * self.b.centre() + self.shift - self.a.centre();
        let balls = between.norm() - self.a.reach() - self.b.reach();
        hint.axis_of(self).map_or(balls, |axis| balls.max(self.gap_along(&axis)))
    }

    /// Transforms a point from the frame of A to the frame of B.
    pub fn in_b(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation.tr_mul(&(point - self.shift))
    }
}

/// Index and height of the highest vertex along a direction; ties take the first.
pub(super) fn highest(vertices: &[Vector3<f64>], axis: &Vector3<f64>) -> (usize, f64) {
    let mut best = (0, f64::NEG_INFINITY);
    for (index, vertex) in vertices.iter().enumerate() {
        let height = axis.dot(vertex);
        if height > best.1 {
            best = (index, height);
        }
    }
    best
}

/// Index and height of the lowest vertex along a direction; ties take the first.
pub(super) fn lowest(vertices: &[Vector3<f64>], axis: &Vector3<f64>) -> (usize, f64) {
    let (index, height) = highest(vertices, &-axis);
    (index, -height)
}
