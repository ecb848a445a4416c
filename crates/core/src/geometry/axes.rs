//! The axis of largest separation of two cores, among all face normals and all edge pairs that make
//! a face of the Minkowski difference (Gregorius, "The separating axis test between convex
//! polyhedra", GDC 2013).
//!
//! The gap along it is exact if the cores overlap. If they are apart it is a lower bound on their
//! distance, which is exact if a face or two crossing edges are closest.

use super::facet;
use super::pair::{PairScratch, PiecePair, highest, lowest};
use super::segment::span;
use super::touch::PieceSide;
use nalgebra::Vector3;

/// Sine below which edges count as parallel. Their cross product is then accurate only to
/// 1e-16/1e-6, and a face normal is almost the same axis.
pub(super) const PARALLEL: f64 = 1e-6;

/// Relative difference below which two areas are equal.
const EQUAL: f64 = 1e-7;

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
    let least = if pair.b.rim().is_some() { -tie.within } else { 0.0 };
    if best.gap >= least && meets_face(pair, scratch, &best, tie.within) {
        return Some(SeparatingAxis { exact: true, ..best });
    }
    let best = match pair.b.rim() {
        Some(rim) => facet::best_edges(pair, rim, scratch, best),
        None => best_edges(pair, scratch, best),
    };
    Some(SeparatingAxis { exact: best.gap <= 0.0, ..best })
}

fn best_face_of_a(pair: &PiecePair<'_>, scratch: &PairScratch) -> Option<SeparatingAxis> {
    let mut best: Option<SeparatingAxis> = None;
    for (index, face) in pair.a.faces().iter().enumerate() {
        let gap = lowest(&scratch.vertices, &face.normal).1 - face.offset;
        if best.is_none_or(|best| gap > best.gap) {
            best = Some(SeparatingAxis {
                kind: AxisSource::FaceA(index),
                normal: face.normal,
                gap,
                exact: false,
            });
        }
    }
    best
}

fn best_face_of_b(pair: &PiecePair<'_>, scratch: &PairScratch) -> Option<SeparatingAxis> {
    let mut best: Option<SeparatingAxis> = None;
    for (index, (face, normal)) in pair.b.faces().iter().zip(&scratch.normals).enumerate() {
        let low = lowest(pair.a.vertices(), normal).1;
        let gap = low - face.offset - normal.dot(&pair.shift);
        if best.is_none_or(|best| gap > best.gap) {
            best = Some(SeparatingAxis {
                kind: AxisSource::FaceB(index),
                normal: -normal,
                gap,
                exact: false,
            });
        }
    }
    best
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

/// The axis across two edges with the largest gap, or `best` if its gap is larger.
///
/// Two edges make a face of the Minkowski difference if two arcs cross: the arc between the normals
/// of A's faces at the edge, and the arc between the negative normals of B's. With e the directions
/// of the edges and l and r the normals to the left and right (e ∥ l × r):
///
/// ```text
/// (l_B·e_A)(r_B·e_A) < 0,   (l_A·e_B)(r_A·e_B) < 0,   (l_B·e_A)(r_A·e_B) < 0
/// ```
///
/// A segment has a full circle instead of an arc, so its conditions are skipped.
fn best_edges(
    pair: &PiecePair<'_>,
    scratch: &mut PairScratch,
    mut best: SeparatingAxis,
) -> SeparatingAxis {
    let (vertices, normals) = (&scratch.vertices, &scratch.normals);
    let products = &mut scratch.products;
    for (index_a, edge_a) in pair.a.edges().iter().enumerate() {
        let (from_a, along_a) = span(pair.a.vertices(), edge_a);
        products.clear();
        products.extend(normals.iter().map(|normal| normal.dot(&along_a)));
        for (index_b, edge_b) in pair.b.edges().iter().enumerate() {
            let left_b = edge_b.faces.map(|faces| faces.map(|face| products[face as usize]));
            if left_b.is_some_and(|[left, right]| left * right >= 0.0) {
                continue;
            }
            let (from_b, along_b) = span(vertices, edge_b);
            let faces_a =
                edge_a.faces.map(|faces| faces.map(|face| &pair.a.faces()[face as usize].normal));
            if let Some([left, right]) = faces_a.map(|faces| faces.map(|n| n.dot(&along_b))) {
                let same_side = left_b.is_none_or(|[left_b, _]| left_b * right < 0.0);
                if left * right >= 0.0 || !same_side {
                    continue;
                }
            }
            let across = along_a.cross(&along_b);
            let norm = across.norm();
            if norm <= PARALLEL * along_a.norm() * along_b.norm() {
                continue;
            }
            // Outward at A, or inward at B.
            let outward = match (faces_a, edge_b.faces) {
                (Some([left, right]), _) => across.dot(&(left + right)),
                (None, Some([left, right])) => {
                    -across.dot(&(normals[left as usize] + normals[right as usize]))
                }
                (None, None) => continue,
            };
            let normal = across * (outward.signum() / norm);
            let gap = normal.dot(&(from_b - from_a));
            if gap > best.gap {
                best = SeparatingAxis {
                    kind: AxisSource::Edges(index_a, index_b),
                    normal,
                    gap,
                    exact: false,
                };
            }
        }
    }
    best
}
