//! The axis of largest separation of two cores, among all face normals and all edge pairs that make
//! a face of the Minkowski difference (Gregorius, "The separating axis test between convex
//! polyhedra", GDC 2013).
//!
//! The gap along it is exact if the cores overlap. If they are apart it is a lower bound on their
//! distance, which is exact if a face or two crossing edges are closest.

use super::edge_axes::best_edges;
use super::facet;
use super::features::PieceSide;
use super::pair::PiecePair;
use super::scratch::PairScratch;
use super::separating_axis::{AxisSource, SeparatingAxis, TieBreak};
use super::support::{highest, lowest};
use nalgebra::Vector3;

/// Relative difference below which two areas are equal.
const EQUAL: f64 = 1e-7;
/// Rounding of gaps, in widths of a tie.
const ROUNDED: f64 = 1e-5;

/// Returns the best axis, or the first one found with a gap above `enough`.
///
/// Returns `None` if neither core has a face. `scratch` holds B's vertices and normals in the frame
/// of A. A vertex outside a face by at most `tie.within` counts as over it.
pub(super) fn best_axis(
    pair: &PiecePair<'_>,
    scratch: &mut PairScratch,
    enough: f64,
    tie: TieBreak,
) -> Option<SeparatingAxis> {
    let of_a = best_face_of_a(pair, scratch);
    if let Some(axis) = of_a.filter(|axis| axis.gap > enough) {
        return Some(axis);
    }
    let of_b = best_face_of_b(pair, scratch);
    if let Some(axis) = of_b.filter(|axis| axis.gap > enough) {
        return Some(axis);
    }
    let best = match (of_a, of_b) {
        (Some(a), Some(b)) => better_face(pair, a, b, tie),
        (a, b) => a.or(b)?,
    };
    // If the deepest vertex is over the face itself, no other axis has a larger gap. Facets are not
    // left sideways from an overlap within the tolerance.
    let least = if pair.b.is_facet() { -tie.within } else { 0.0 };
    if best.gap >= least && meets_face(pair, scratch, &best, tie.within) {
        return Some(SeparatingAxis { exact: true, ..best });
    }
    let edges = if pair.b.is_facet() {
        facet::best_edges(pair, scratch, best)
    } else {
        best_edges(pair, scratch, best)
    };
    // Rounding must not decide between a face and edges that span the same plane.
    let best = if edges.gap > best.gap + ROUNDED * tie.within { edges } else { best };
    Some(SeparatingAxis { exact: best.gap <= 0.0, ..best })
}

fn best_face_of_a(pair: &PiecePair<'_>, scratch: &PairScratch) -> Option<SeparatingAxis> {
    let mut best = None;
    let mut lowest = LowestAbove::new(&scratch.vertices);
    for (index, face) in pair.a.faces().iter().enumerate() {
        let (kind, normal) = (AxisSource::FaceA(index), face.normal);
        keep_larger(&mut best, kind, normal, |least| {
            lowest.find(&normal, least, |height| height - face.offset)
        });
    }
    best
}

fn best_face_of_b(pair: &PiecePair<'_>, scratch: &PairScratch) -> Option<SeparatingAxis> {
    let mut best = None;
    let mut lowest = LowestAbove::new(pair.a.vertices());
    for (index, (face, normal)) in pair.b.faces().iter().zip(&scratch.normals).enumerate() {
        let shift = normal.dot(&pair.shift);
        keep_larger(&mut best, AxisSource::FaceB(index), -normal, |least| {
            lowest.find(normal, least, |height| height - face.offset - shift)
        });
    }
    best
}

/// Replaces the best axis by another one, if `gap` finds a gap above the given one.
fn keep_larger(
    best: &mut Option<SeparatingAxis>,
    kind: AxisSource,
    normal: Vector3<f64>,
    gap: impl FnOnce(f64) -> Option<f64>,
) {
    let least = best.map_or(f64::NEG_INFINITY, |best| best.gap);
    if let Some(gap) = gap(least) {
        *best = Some(SeparatingAxis { kind, normal, gap, exact: false });
    }
}

/// Search for the lowest vertices of a core over many planes.
///
/// One vertex that is low enough rules out a plane. It often rules out the next plane, too.
struct LowestAbove<'v> {
    vertices: &'v [Vector3<f64>],
    last: usize,
}

impl<'v> LowestAbove<'v> {
    fn new(vertices: &'v [Vector3<f64>]) -> Self {
        Self { vertices, last: 0 }
    }

    /// Height of the lowest vertex along a normal, if it is above `least`. `height_of` maps the dot
    /// product to the height and must not decrease.
    fn find(
        &mut self,
        normal: &Vector3<f64>,
        least: f64,
        height_of: impl Fn(f64) -> f64,
    ) -> Option<f64> {
        if height_of(normal.dot(&self.vertices[self.last])) <= least {
            return None;
        }
        let mut lowest = f64::INFINITY;
        for (index, vertex) in self.vertices.iter().enumerate() {
            let along = normal.dot(vertex);
            if along < lowest {
                (lowest, self.last) = (along, index);
                if height_of(along) <= least {
                    return None;
                }
            }
        }
        Some(height_of(lowest))
    }
}

/// The face with the larger gap, if the gaps differ by more than the `tie`. Otherwise the larger
/// face, and for equal areas the face of the piece `tie.to`.
fn better_face(
    pair: &PiecePair<'_>,
    a: SeparatingAxis,
    b: SeparatingAxis,
    tie: TieBreak,
) -> SeparatingAxis {
    let (AxisSource::FaceA(face_a), AxisSource::FaceB(face_b)) = (a.kind, b.kind) else { return a };
    let (area_a, area_b) = (pair.a.faces()[face_a].area, pair.b.faces()[face_b].area);
    let apart = b.gap - a.gap;
    let b_wins = if apart.abs() > tie.within {
        apart > 0.0
    } else if area_b > area_a * (1.0 + EQUAL) {
        true
    } else {
        tie.to == PieceSide::B && area_a <= area_b * (1.0 + EQUAL)
    };
    if b_wins { b } else { a }
}

/// True if the deepest vertex of the other core is over the face of the axis. The gap along the
/// axis is then the distance.
fn meets_face(
    pair: &PiecePair<'_>,
    scratch: &PairScratch,
    axis: &SeparatingAxis,
    slack: f64,
) -> bool {
    match axis.kind {
        AxisSource::FaceA(face) => {
            let (deepest, _) = lowest(&scratch.vertices, &axis.normal);
            pair.a.is_over(face, &scratch.vertices[deepest], slack)
        }
        AxisSource::FaceB(face) => {
            let (deepest, _) = highest(pair.a.vertices(), &axis.normal);
            pair.b.is_over(face, &pair.in_b(&pair.a.vertices()[deepest]), slack)
        }
        AxisSource::Edges(..) => false,
    }
}
