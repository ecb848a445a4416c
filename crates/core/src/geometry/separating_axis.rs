//! Separating axes of two cores, with the features that span them.

use super::features::PieceSide;
use nalgebra::Vector3;

/// Sine below which edges count as parallel. Their cross product is then accurate only to
/// 1e-16/1e-6, and a face normal is almost the same axis.
pub(super) const PARALLEL: f64 = 1e-12;

/// Features that span an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) enum AxisSource {
    FaceA(usize),
    FaceB(usize),
    Edges(usize, usize),
}

/// A candidate axis and the gap of the cores along it.
#[derive(Debug, Clone, Copy)]
pub(super) struct SeparatingAxis {
    pub kind: AxisSource,
    /// Unit normal (frame of A, from A to B).
    pub normal: Vector3<f64>,
    /// Gap (m); negative if the cores overlap.
    pub gap: f64,
    /// True if the gap is the separation of the cores, false if it is only a bound.
    pub exact: bool,
}

/// Tie-breaking rule for faces with almost equal gaps.
#[derive(Debug, Clone, Copy)]
pub(super) struct TieBreak {
    /// Difference of gaps below which they are equal (m).
    pub within: f64,
    /// Piece whose face is chosen if the areas are equal too.
    pub to: PieceSide,
}
