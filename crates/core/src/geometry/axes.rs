//! The axis along which two cores are farthest apart, of all face normals and all edge pairs
//! that make a face of the Minkowski difference (Gregorius, "The separating axis test between
//! convex polyhedra", GDC 2013): exact if the cores overlap; if they are apart, a bound from
//! below on their distance, which is exact if a face or two crossing edges are closest.

use super::pair::{PairScratch, PiecePair, highest, lowest};
use super::segment::span;
use super::touch::PieceSide;
use nalgebra::Vector3;

/// Edges at an angle with a smaller sine are taken for parallel: the direction across them is
/// known to 1e-16/1e-6 only, and a face says almost the same.
pub(super) const PARALLEL: f64 = 1e-6;

/// Areas that differ by less than this part are equal.
const EQUAL: f64 = 1e-7;

/// What spans an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) enum AxisSource {
    FaceA(usize),
    FaceB(usize),
    Edges(usize, usize),
}

/// An axis and how far the cores are apart along it.
#[derive(Debug, Clone, Copy)]
pub(super) struct SeparatingAxis {
    pub kind: AxisSource,
    /// Unit, frame of A, from A to B.
    pub normal: Vector3<f64>,
    /// m; negative if the cores overlap.
    pub gap: f64,
    /// Whether the gap is known to be the separation of the cores, not only a bound.
    pub exact: bool,
}

/// How faces that are as good as each other are told apart.
#[derive(Debug, Clone, Copy)]
pub(super) struct TieBreak {
    /// m: gaps that differ by less are equal.
    pub within: f64,
    /// Whose the face is if the areas are equal too.
    pub to: PieceSide,
}

/// The best axis, or one whose gap is above `enough`. None if neither core has a
/// face. `scratch` holds B's placed vertices and normals; what is outside a face by no more than the
/// `tie` is wide counts as over it.
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
    // Where the deepest vertex is over the face itself, nothing can be farther apart.
    if best.gap >= 0.0 && meets_face(pair, scratch, &best, tie.within) {
        return Some(SeparatingAxis { exact: true, ..best });
    }
    let best = best_edges(pair, scratch, best);
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

/// The face with the gap that is larger by more than the `tie`; of equals the larger face; of equals
/// again the one that the tie goes to.
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

/// Whether the deepest vertex of the other core is over the face of the axis: then the axis'
/// gap is the distance.
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

/// The axis across two edges with the largest gap, if it is larger than that of `best`.
///
/// Two edges make a face of the Minkowski difference if the arc between the normals of A's
/// faces at the edge crosses that between the negative normals of B's. With e the edges'
/// directions, l and r the normals to the left and right (e ∥ l × r):
///
/// ```text
/// (l_B·e_A)(r_B·e_A) < 0,   (l_A·e_B)(r_A·e_B) < 0,   (l_B·e_A)(r_A·e_B) < 0
/// ```
///
/// A segment has a whole circle in place of the arc: what it takes part in is left out.
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
