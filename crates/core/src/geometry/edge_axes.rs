//! The axis of largest separation across two edges.
//!
//! Two edges make a face of the Minkowski difference if two arcs cross: the arc between the normals
//! of A's faces at the edge, and the arc between the negative normals of B's. With e the directions
//! of the edges and l and r the normals to the left and right (e ∥ l × r):
//!
//! ```text
//! (l_B·e_A)(r_B·e_A) < 0,   (l_A·e_B)(r_A·e_B) < 0,   (l_B·e_A)(r_A·e_B) < 0
//! ```
//!
//! A segment has a full circle instead of an arc, so its conditions are skipped.
//!
//! Most edges cannot beat the best face. An axis n on the arc of an edge is αl + βr, with α, β ≥ 0,
//! over its length. Let h_l and h_r be the heights of a vertex of the other core over the planes of
//! both faces, and h the larger one. The gap along n is at most
//!
//! ```text
//! (αh_l + βh_r)/|αl + βr| ≤ h          for h ≤ 0
//!                         ≤ h/|(l + r)/2|   for h > 0
//! ```
//!
//! Edges for which some vertex makes this bound smaller than the best gap are left out.
//!
//! The signs of these products are rounding for edges of nearly parallel faces. So the gap of an axis counts
//! only if no vertex of A is above its edge, and no vertex of B is below its own.

use super::hull::{Edge, span};
use super::pair::PiecePair;
use super::scratch::PairScratch;
use super::separating_axis::{AxisSource, PARALLEL, SeparatingAxis};
use super::support::lowest;
use nalgebra::Vector3;

/// Least difference from the best gap at which an edge is left out, relative to the smaller piece.
/// The normal across nearly parallel edges has errors up to 1e-16/[`PARALLEL`].
const BEATEN: f64 = 1e-9;

/// The axis across two edges with the largest gap, or `best` if its gap is larger.
pub(super) fn best_edges(
    pair: &PiecePair<'_>,
    scratch: &mut PairScratch,
    mut best: SeparatingAxis,
) -> SeparatingAxis {
    let PairScratch { vertices, normals, products, edges: [edges_a, edges_b], .. } = scratch;
    let least = best.gap - BEATEN * pair.size();
    let plane_of_a = |face: u32| {
        let face = &pair.a.faces()[face as usize];
        (face.normal, face.offset)
    };
    let plane_of_b = |face: u32| {
        let normal = normals[face as usize];
        (normal, pair.b.faces()[face as usize].offset + normal.dot(&pair.shift))
    };
    find_contenders(pair.a.edges(), plane_of_a, vertices, least, edges_a);
    if edges_a.is_empty() {
        return best;
    }
    find_contenders(pair.b.edges(), plane_of_b, pair.a.vertices(), least, edges_b);
    // Two edges span a separating axis only if their arcs of normals cross on the Gauss sphere.
    for &index_a in &*edges_a {
        let edge_a = &pair.a.edges()[index_a];
        let (from_a, along_a) = span(pair.a.vertices(), edge_a);
        products.clear();
        products.extend(normals.iter().map(|normal| normal.dot(&along_a)));
        for &index_b in &*edges_b {
            let edge_b = &pair.b.edges()[index_b];
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
            // The separation along the axis is that of the edges if both are extreme there.
            let gap = normal.dot(&(from_b - from_a));
            if gap > best.gap && pair.are_extremes(vertices, &normal, gap) {
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

/// Collects the edges of a core that may span an axis with a gap above `least` (m).
///
/// `plane_of` has the normal and the offset of a face. `vertices` are those of the other core.
fn find_contenders(
    edges: &[Edge],
    plane_of: impl Fn(u32) -> (Vector3<f64>, f64),
    vertices: &[Vector3<f64>],
    least: f64,
    found: &mut Vec<usize>,
) {
    found.clear();
    let mut low = 0;
    for (index, edge) in edges.iter().enumerate() {
        let Some(faces) = edge.faces else {
            found.push(index);
            continue;
        };
        let planes = faces.map(&plane_of);
        let sum = planes[0].0 + planes[1].0;
        let limit = if least > 0.0 { least * sum.norm() / 2.0 } else { least };
        let beats = |vertex: usize| {
            planes.iter().all(|(normal, offset)| normal.dot(&vertices[vertex]) - offset <= limit)
        };
        // A vertex that beats one edge often beats the next one.
        if beats(low) {
            continue;
        }
        low = lowest(vertices, &sum).0;
        if !beats(low) {
            found.push(index);
        }
    }
}
