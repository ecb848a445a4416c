//! Facets: triangles of a surface, as flat convex cores.
//!
//! A facet has two faces, so it is touched from both sides. Its separation from a piece is ordinary
//! geometry. Which contact points exist, the facets around it decide
//! ([`contact::exposure`](crate::contact)).

use super::Hull;
use super::hull::span;
use super::pair::PiecePair;
use super::scratch::PairScratch;
use super::separating_axis::{AxisSource, PARALLEL, SeparatingAxis};
use crate::error::Error;
use nalgebra::Vector3;

/// Core of the triangle with `corners` (m), counter-clockwise seen from above.
pub(super) fn facet(corners: [Vector3<f64>; 3]) -> Result<Hull, Error> {
    Hull::from_loops(&corners, &[vec![0, 1, 2], vec![0, 2, 1]])
}

/// First corner of each side of a facet (m), and the outward unit normal of the side in its plane. None
/// for another core.
pub(super) fn borders(hull: &Hull) -> impl Iterator<Item = (Vector3<f64>, Vector3<f64>)> + '_ {
    let face = hull.faces().first().filter(|_| hull.is_facet());
    face.into_iter().flat_map(|face| {
        let corners = hull.face_loop(0);
        let at = |corner: usize| hull.vertices()[corners[corner % corners.len()].vertex as usize];
        (0..corners.len()).map(move |corner| {
            let along = at(corner + 1) - at(corner);
            (at(corner), along.cross(&face.normal).normalize())
        })
    })
}

/// The axis across an edge of A and an edge of facet B with the largest gap, or `best` if its gap is
/// larger.
///
/// The outward normals at an edge of a facet are a half circle. Let o be the vector out of the facet
/// across the edge, and d = ±e_A × e_B/|e_A × e_B| with d·o ≥ 0. The two edges make a face of the
/// Minkowski difference if −d is between the normals of A's faces at its edge:
///
/// ```text
/// (l_A·e_B)(r_A·e_B) < 0,   (l_A + r_A)·d < 0
/// ```
pub(super) fn best_edges(
    pair: &PiecePair<'_>,
    scratch: &mut PairScratch,
    mut best: SeparatingAxis,
) -> SeparatingAxis {
    let PairScratch { vertices, products, .. } = scratch;
    let centre = pair.rotation * pair.b.centre() + pair.shift;
    for (index_b, edge_b) in pair.b.edges().iter().enumerate() {
        let (from_b, along_b) = span(vertices, edge_b);
        products.clear();
        products.extend(pair.a.faces().iter().map(|face| face.normal.dot(&along_b)));
        let toward = from_b - centre;
        let outward = toward - along_b * (along_b.dot(&toward) / along_b.norm_squared());
        for (index_a, edge_a) in pair.a.edges().iter().enumerate() {
            if edge_a.faces.is_some_and(|[l, r]| products[l as usize] * products[r as usize] >= 0.0)
            {
                continue;
            }
            let (from_a, along_a) = span(pair.a.vertices(), edge_a);
            let across = along_a.cross(&along_b);
            let norm = across.norm();
            if norm <= PARALLEL * along_a.norm() * along_b.norm() {
                continue;
            }
            let normal = across * (-across.dot(&outward).signum() / norm);
            let between = |faces: [u32; 2]| faces.map(|face| pair.a.faces()[face as usize].normal);
            if edge_a.faces.map(between).is_some_and(|[l, r]| (l + r).dot(&normal) <= 0.0) {
                continue;
            }
            let gap = normal.dot(&(from_b - from_a));
            if gap > best.gap && pair.are_extremes(vertices, &normal, gap) {
                let kind = AxisSource::Edges(index_a, index_b);
                best = SeparatingAxis { kind, normal, gap, exact: false };
            }
        }
    }
    best
}
