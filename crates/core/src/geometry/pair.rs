//! Two pieces in the frame of A. The difference of the positions is computed first, so that pairs
//! far from the world origin lose no digits.

use super::support::{highest, lowest};
use super::{Hull, Piece, Smooth};
use crate::kinematics::Pose;
use nalgebra::{Matrix3, Vector3};

/// Rounding of a gap along an axis across two edges, relative to the smaller piece.
const ROUNDING: f64 = 1e-12;

/// A piece and the pose of its body.
pub type PlacedPiece<'a> = (&'a Piece, &'a Pose);

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

    /// True if no vertices of the cores are closer to each other along a unit vector (frame of A) than the
    /// `gap` (m), to rounding. `vertices` are those of B (frame of A).
    pub fn are_extremes(&self, vertices: &[Vector3<f64>], axis: &Vector3<f64>, gap: f64) -> bool {
        let along = lowest(vertices, axis).1 - highest(self.a.vertices(), axis).1;
        along >= gap - ROUNDING * self.size()
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

    /// Transforms a point from the frame of A to the frame of B.
    pub fn in_b(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation.tr_mul(&(point - self.shift))
    }
}
