//! Separating axis of a pair, kept from step to step.

use super::hull::span;
use super::pair::{PiecePair, PlacedPiece};
use super::separating_axis::{AxisSource, PARALLEL};
use crate::kinematics::Pose;
use nalgebra::Vector3;

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
    pub fn axis_from(&self, pose: &Pose) -> Option<Vector3<f64>> {
        self.axis.map(|axis| pose.rotation * axis)
    }

    /// The cached axis (unit, world), recomputed from the same features at the given poses.
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

impl PiecePair<'_> {
    /// Lower bound on the distance of the cores (m), from their bounding balls and the cached axis.
    pub fn quick_gap(&self, hint: &Hint) -> f64 {
        let between = self.rotation * self.b.centre() + self.shift - self.a.centre();
        let balls = between.norm() - self.a.reach() - self.b.reach();
        hint.axis_of(self).map_or(balls, |axis| balls.max(self.gap_along(&axis)))
    }
}
