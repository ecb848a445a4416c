//! Which boxes around pieces meet: sort along one axis and sweep.
//!
//! Ours, because the crates that do this allocate in every call or give the pairs in the order
//! of the places (`collision`, `phyz-collision`), or come with an engine's types; the order
//! must not depend on the places, and it is 40 lines.

use super::Piece;
use crate::mechanics::Pose;
use nalgebra::Vector3;

/// A box along the axes of the world, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// The smallest coordinates.
    pub low: Vector3<f64>,
    /// The largest coordinates.
    pub high: Vector3<f64>,
}

impl Aabb {
    /// The box around a piece of a body at a pose.
    #[must_use]
    pub fn of(piece: &Piece, pose: &Pose) -> Self {
        let start = Vector3::repeat(f64::INFINITY);
        let (mut low, mut high) = (start, -start);
        for vertex in piece.core().vertices() {
            let placed = pose.rotation * vertex;
            (low, high) = (low.inf(&placed), high.sup(&placed));
        }
        let shift = |by: f64| pose.position.add_scalar(by);
        Self { low: low + shift(-piece.radius()), high: high + shift(piece.radius()) }
    }

    /// The box around a piece at both ends of a step. In between, a piece that turns may leave it by its
    /// [`bulge`](super::Moving::bulge).
    #[must_use]
    pub fn swept(piece: &Piece, from: &Pose, to: &Pose) -> Self {
        Self::of(piece, from).joined(&Self::of(piece, to))
    }

    /// The box around both.
    #[must_use]
    pub fn joined(&self, other: &Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    /// This box with all sides moved out by `margin`, m.
    #[must_use]
    pub fn grown(&self, margin: f64) -> Self {
        Self { low: self.low.add_scalar(-margin), high: self.high.add_scalar(margin) }
    }

    /// Whether the boxes have a point in common.
    #[must_use]
    pub fn meets(&self, other: &Self) -> bool {
        (0..3).all(|i| self.low[i] <= other.high[i] && other.low[i] <= self.high[i])
    }
}

/// The broad phase: owns its memory, which is allocated once.
#[derive(Debug, Clone, Default)]
pub struct Sweep {
    /// The boxes in the order of their low sides, with their numbers.
    sorted: Vec<(Aabb, u32)>,
    pairs: Vec<(u32, u32)>,
}

impl Sweep {
    /// Nothing remembered.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Visits all pairs (i, j), i < j, of boxes that meet, ascending in i, then j. The time
    /// is n log n plus the pairs that meet along the axis along which the boxes are most
    /// spread out.
    pub fn pairs(&mut self, boxes: &[Aabb], mut visit: impl FnMut(usize, usize)) {
        let axis = widest_axis(boxes);
        self.sorted.clear();
        self.sorted.extend(boxes.iter().copied().zip(0..));
        let low = |entry: &(Aabb, u32)| entry.0.low[axis];
        self.sorted.sort_unstable_by(|i, j| low(i).total_cmp(&low(j)).then(i.1.cmp(&j.1)));
        self.pairs.clear();
        for (at, (this, first)) in self.sorted.iter().enumerate() {
            let end = this.high[axis];
            for (other, second) in &self.sorted[at + 1..] {
                if other.low[axis] > end {
                    break;
                }
                if this.meets(other) {
                    self.pairs.push((*first.min(second), *first.max(second)));
                }
            }
        }
        self.pairs.sort_unstable();
        for &(i, j) in &self.pairs {
            visit(i as usize, j as usize);
        }
    }
}

/// The axis along which the middles of the boxes have the largest variance; of equals the
/// first.
fn widest_axis(boxes: &[Aabb]) -> usize {
    let count = boxes.len().max(1) as f64;
    let middle = |b: &Aabb| (b.low + b.high) / 2.0;
    let mean = boxes.iter().map(middle).sum::<Vector3<f64>>() / count;
    let square = |b: &Aabb| (middle(b) - mean).map(|x| x * x);
    let variance: Vector3<f64> = boxes.iter().map(square).sum();
    (1..3).fold(0, |best, axis| if variance[axis] > variance[best] { axis } else { best })
}
