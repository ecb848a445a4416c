//! Broad phase: finds the pairs of overlapping boxes by sort and sweep along one axis.
//!
//! Crates for this task (`collision`, `phyz-collision`) allocate in every call, return pairs in an
//! order that depends on positions, or require an engine's types. The order of pairs must not
//! depend on positions.

use super::Piece;
use crate::kinematics::Pose;
use nalgebra::Vector3;
use std::cmp::Ordering;

/// An axis-aligned box (m, world).
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Aabb {
    /// Smallest coordinates (m).
    pub low: Vector3<f64>,
    /// Largest coordinates (m).
    pub high: Vector3<f64>,
}

impl Aabb {
    /// Bounding box of a piece whose body is at `pose`.
    pub fn from_piece(piece: &Piece, pose: &Pose) -> Self {
        let start = Vector3::repeat(f64::INFINITY);
        let (mut low, mut high) = (start, -start);
        for vertex in piece.core().vertices() {
            let placed = pose.rotation * vertex;
            (low, high) = (low.inf(&placed), high.sup(&placed));
        }
        let shift = |by: f64| pose.position.add_scalar(by);
        Self { low: low + shift(-piece.radius()), high: high + shift(piece.radius()) }
    }

    /// Bounding box of a piece at both ends of a step. A rotating piece may leave it in between by
    /// its [`bulge`](super::Moving::bulge).
    pub fn swept(piece: &Piece, from: &Pose, to: &Pose) -> Self {
        Self::from_piece(piece, from).joined(&Self::from_piece(piece, to))
    }

    /// Smallest box that contains both boxes.
    pub fn joined(&self, other: &Self) -> Self {
        Self { low: self.low.inf(&other.low), high: self.high.sup(&other.high) }
    }

    /// This box with all sides moved outward by `margin` (m).
    pub fn grown(&self, margin: f64) -> Self {
        Self { low: self.low.add_scalar(-margin), high: self.high.add_scalar(margin) }
    }

    /// True if the boxes have a point in common.
    pub fn meets(&self, other: &Self) -> bool {
        (0..3).all(|i| self.low[i] <= other.high[i] && other.low[i] <= self.high[i])
    }
}

/// The broad phase, with reusable buffers.
#[derive(Debug, Clone, Default)]
pub struct Sweep {
    moving: Sorted,
    fixed: Sorted,
    /// Axis along which the fixed boxes are sorted.
    axis: usize,
    pairs: Vec<(u32, u32)>,
}

impl Sweep {
    /// An empty broad phase without fixed boxes.
    pub fn new() -> Self {
        Self::default()
    }

    /// Replaces the fixed boxes. They are sorted here once.
    pub fn set_fixed(&mut self, boxes: &[Aabb]) {
        self.axis = widest_axis(boxes);
        self.fixed.sort(boxes, self.axis);
    }

    /// Visits all pairs (i, j), i < j, of overlapping boxes, ascending in i, then j.
    ///
    /// At least one of the two belongs to `boxes`. The [fixed](Sweep::set_fixed) boxes are numbered
    /// after them, and two fixed boxes are not a pair. With n boxes and f fixed ones, the time is n
    /// log n + f plus the number of pairs that overlap along the sort axis. The sort axis is the
    /// one of largest spread, chosen separately for the moving and the fixed boxes.
    pub fn pairs(&mut self, boxes: &[Aabb], mut visit: impl FnMut(usize, usize)) {
        for &(i, j) in self.selected(boxes, usize::MAX, |_, _| true) {
            visit(i as usize, j as usize);
        }
    }

    /// The [pairs](Self::pairs) of overlapping boxes for which `keep` holds, at most `most` of them.
    /// The search ends as soon as it has so many.
    pub(crate) fn selected(
        &mut self,
        boxes: &[Aabb],
        most: usize,
        keep: impl Fn(usize, usize) -> bool,
    ) -> &[(u32, u32)] {
        let Self { moving, fixed, axis: axis_of_fixed, pairs } = self;
        pairs.clear();
        let keep = |&(i, j): &(u32, u32)| keep(i as usize, j as usize);
        let axis = widest_axis(boxes);
        moving.sort(boxes, axis);
        for (at, this) in moving.0.iter().enumerate() {
            let met = meeting(this, &moving.0[at + 1..], axis);
            let met = met.map(|other| (this.1.min(other), this.1.max(other)));
            pairs.extend(met.filter(keep).take(most - pairs.len()));
        }
        if !fixed.0.is_empty() {
            let (axis, count) = (*axis_of_fixed, boxes.len() as u32);
            moving.sort(boxes, axis);
            // Each box is tested against later boxes of the other list. If both begin at the same
            // place, the fixed box counts as the later one.
            let mut next = 0;
            for this in &moving.0 {
                next += begin_before(this, &fixed.0[next..], axis, Ordering::is_lt);
                let met = meeting(this, &fixed.0[next..], axis).map(|j| (this.1, count + j));
                pairs.extend(met.filter(keep).take(most - pairs.len()));
            }
            let mut next = 0;
            for this in &fixed.0 {
                next += begin_before(this, &moving.0[next..], axis, Ordering::is_le);
                let met = meeting(this, &moving.0[next..], axis).map(|i| (i, count + this.1));
                pairs.extend(met.filter(keep).take(most - pairs.len()));
            }
        }
        pairs.sort_unstable();
        pairs
    }
}

/// A box and its index.
type Numbered = (Aabb, u32);

/// Boxes sorted by their low sides along an axis.
#[derive(Debug, Clone, Default)]
struct Sorted(Vec<Numbered>);

impl Sorted {
    fn sort(&mut self, boxes: &[Aabb], axis: usize) {
        self.0.clear();
        self.0.extend(boxes.iter().copied().zip(0..));
        let low = |entry: &Numbered| entry.0.low[axis];
        self.0.sort_unstable_by(|i, j| low(i).total_cmp(&low(j)).then(i.1.cmp(&j.1)));
    }
}

/// Indices of the boxes in `sorted` that overlap `this`. The boxes begin no earlier than `this`.
fn meeting(this: &Numbered, sorted: &[Numbered], axis: usize) -> impl Iterator<Item = u32> {
    let end = this.0.high[axis];
    // A box with a NaN overlaps nothing.
    let reached = sorted.iter().take_while(move |other| other.0.low[axis] <= end);
    reached.filter(|other| this.0.meets(&other.0)).map(|other| other.1)
}

/// Number of leading boxes of `sorted` that begin before `this`, by the comparison `is_before`.
fn begin_before(
    this: &Numbered,
    sorted: &[Numbered],
    axis: usize,
    is_before: fn(Ordering) -> bool,
) -> usize {
    let low = this.0.low[axis];
    sorted.iter().take_while(|other| is_before(other.0.low[axis].total_cmp(&low))).count()
}

/// Axis along which the centres of the boxes have the largest variance; ties take the first.
fn widest_axis(boxes: &[Aabb]) -> usize {
    let count = boxes.len().max(1) as f64;
    let middle = |b: &Aabb| (b.low + b.high) / 2.0;
    let mean = boxes.iter().map(middle).sum::<Vector3<f64>>() / count;
    let square = |b: &Aabb| (middle(b) - mean).map(|x| x * x);
    let variance: Vector3<f64> = boxes.iter().map(square).sum();
    (1..3).fold(0, |best, axis| if variance[axis] > variance[best] { axis } else { best })
}
