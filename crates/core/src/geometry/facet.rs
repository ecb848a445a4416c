//! Facets: triangles of a surface, as flat convex cores that know their neighbours.
//!
//! A facet has two faces, so it is touched from both sides. Its separation from a piece is ordinary
//! geometry. Its surroundings decide which contact points exist. A vertex or an edge of a surface
//! gives a contact along the outward direction d only if it is an end of the surface along d:
//!
//! ```text
//! d·w ≤ 0   for the unit vectors w from the feature into the triangles around it
//! ```
//!
//! This is the normal cone of the feature. It is empty where the surface is concave, and {n} where
//! it is flat. The neighbours with d·w = 0 are level with the feature. A feature inside its level
//! neighbours is no end of them: the inside of a plane or of a straight ridge gives no contact.
//! So a body slides over the seams of a plane as over one face.

use super::Hull;
use super::axes::{AxisSource, SeparatingAxis};
use super::pair::{PairScratch, PiecePair, highest};
use super::segment::span;
use super::touch::{CorePart, Feature, ManifoldPoint, PieceSide};
use crate::error::Error;
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

/// Sine below which a neighbour is level with a feature. Coordinates with the 24 bits of an STL file
/// can be less exact; a seam that they bend further has contacts of its own, along its cone.
const LEVEL: f64 = 1e-6;

/// Cosine above which a plane is that of the facet itself.
const SAME: f64 = 1.0 - 1e-12;

/// Surroundings of a facet in its surface.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rim {
    /// Unit vectors from each vertex to its neighbours.
    rings: [Vec<Vector3<f64>>; 3],
    /// Unit vectors from each edge, perpendicular to it, into the triangles that share it. The first
    /// is the facet itself.
    wings: [Vec<Vector3<f64>>; 3],
}

/// Neighbours of a triangle in a surface (m).
pub(super) trait Surroundings {
    /// Calls `visit` on the neighbours of the corner `corner`.
    fn ring(&self, corner: usize, visit: &mut dyn FnMut(Vector3<f64>));
    /// Calls `visit` on the third corner of the other triangles at the side from `from` to `to`.
    fn across(&self, from: usize, to: usize, visit: &mut dyn FnMut(Vector3<f64>));
}

/// Core of the triangle with `corners` (m), counter-clockwise seen from above.
pub(super) fn facet(corners: [Vector3<f64>; 3], around: &dyn Surroundings) -> Result<Hull, Error> {
    let mut hull = Hull::from_loops(&corners, &[vec![0, 1, 2], vec![0, 2, 1]])?;
    let rings = [0, 1, 2].map(|corner| {
        let mut ring = Vec::new();
        around.ring(corner, &mut |at| ring.extend((at - corners[corner]).try_normalize(0.0)));
        ring
    });
    let wings = [0, 1, 2].map(|edge| {
        let [from, to] = hull.edges()[edge].vertices.map(|vertex| vertex as usize);
        let along = (corners[to] - corners[from]).normalize();
        let wing = |at: Vector3<f64>| {
            let toward = at - corners[from];
            (toward - along * along.dot(&toward)).try_normalize(0.0)
        };
        let mut wings: Vec<_> = wing(corners[3 - from - to]).into_iter().collect();
        around.across(from, to, &mut |at| wings.extend(wing(at)));
        wings
    });
    hull.rim = Some(Box::new(Rim { rings, wings }));
    Ok(hull)
}

impl Rim {
    /// True if vertex `vertex` is an end of the surface along the unit vector `out`.
    fn has_end(&self, vertex: usize, out: &Vector3<f64>) -> bool {
        let ring = &self.rings[vertex];
        if ring.iter().any(|w| out.dot(w) > LEVEL) {
            return false;
        }
        let level = || ring.iter().filter(|w| out.dot(w) >= -LEVEL);
        let Some(first) = level().next() else { return true };
        // The level neighbours leave free more than half of the circle about `out`.
        let other = out.cross(first);
        let angle = |w: &Vector3<f64>| f64::atan2(other.dot(w), first.dot(w)).rem_euclid(TAU);
        let after = |from: f64| {
            let turns = level().map(|w| (angle(w) - from).rem_euclid(TAU));
            turns.filter(|turn| *turn > LEVEL).fold(TAU, f64::min)
        };
        level().any(|w| after(angle(w)) > PI + LEVEL)
    }

    /// True if edge `edge` is an end of the surface along the unit vector `out`.
    fn has_side(&self, edge: usize, out: &Vector3<f64>) -> bool {
        let wings = &self.wings[edge];
        let level = |w: &&Vector3<f64>| out.dot(w) >= -LEVEL;
        wings.iter().all(|w| out.dot(w) <= LEVEL)
            && wings
                .iter()
                .filter(level)
                .all(|w| wings.iter().filter(level).all(|v| v.dot(w) > 0.0))
    }

    /// True if the surface falls away on the side of `out`, a normal of the facet, at one of its
    /// edges, and `point` (m, frame of the facet) is less deep below the other triangle there than
    /// `depth` (m).
    fn is_beside(&self, hull: &Hull, out: &Vector3<f64>, point: &Vector3<f64>, depth: f64) -> bool {
        hull.edges().iter().zip(&self.wings).any(|(edge, wings)| {
            let (from, along) = span(hull.vertices(), edge);
            let falls = |w: &&Vector3<f64>| out.dot(w) < -LEVEL;
            wings[1..].iter().filter(falls).any(|w| {
                let normal = along.cross(w).normalize();
                let normal = if normal.dot(&wings[0]) < 0.0 { normal } else { -normal };
                normal.dot(&(from - point)) < depth
            })
        })
    }
}

/// True if the surface around facet B of the pair permits the contact point `touch`.
///
/// `slack` (m) is the width of a facet's border that counts as inside.
pub(super) fn permits(pair: &PiecePair<'_>, rim: &Rim, touch: &ManifoldPoint, slack: f64) -> bool {
    let out = match touch.point_of {
        PieceSide::A => touch.normal,
        PieceSide::B => -pair.rotation.tr_mul(&touch.normal),
    };
    let part = match touch.feature {
        Feature::Vertex(PieceSide::A, _) | Feature::Ellipsoid(PieceSide::A, _) => None,
        Feature::Vertex(PieceSide::B, vertex) | Feature::Vertices(_, vertex) => {
            Some(CorePart::Vertex(vertex))
        }
        Feature::Edges(_, edge) => Some(CorePart::Edge(edge)),
        Feature::Round(_, part) => Some(part),
        Feature::Ellipsoid(PieceSide::B, _) => return false,
    };
    match part {
        Some(CorePart::Vertex(vertex)) => rim.has_end(vertex as usize, &out),
        Some(CorePart::Edge(edge)) => rim.has_side(edge as usize, &out),
        Some(CorePart::Lateral | CorePart::End(_)) => false,
        None => match pair.b.faces().iter().position(|face| face.normal.dot(&out) > SAME) {
            Some(face) => {
                let point = pair.in_b(&touch.point);
                let depth = -touch.gap - pair.radii();
                pair.b.is_over(face, &point, slack)
                    && (depth <= slack || !rim.is_beside(pair.b, &out, &point, depth - slack))
            }
            None => (0..3).any(|edge| rim.has_side(edge, &out)),
        },
    }
}

/// True if the surface permits facet B to be left along the axis of an overlap.
pub(super) fn leaves(pair: &PiecePair<'_>, rim: &Rim, axis: &SeparatingAxis) -> bool {
    let out = -pair.rotation.tr_mul(&axis.normal);
    match axis.kind {
        AxisSource::FaceB(_) => true,
        AxisSource::Edges(_, edge) => rim.wings[edge].iter().all(|w| out.dot(w) <= LEVEL),
        AxisSource::FaceA(_) => {
            let (vertex, _) = highest(pair.b.vertices(), &out);
            rim.rings[vertex].iter().all(|w| out.dot(w) <= LEVEL)
        }
    }
}

/// Axis along the normal of facet B on which the pair overlaps less.
pub(super) fn upright(pair: &PiecePair<'_>) -> Option<SeparatingAxis> {
    let axis = |(index, face): (usize, &super::hull::Face)| {
        let normal = -(pair.rotation * face.normal);
        let kind = AxisSource::FaceB(index);
        SeparatingAxis { kind, normal, gap: pair.gap_along(&normal), exact: true }
    };
    let axes = pair.b.faces().iter().enumerate().map(axis);
    axes.max_by(|one, other| one.gap.total_cmp(&other.gap))
}

/// The same axis with the index of the face.
pub(super) fn upright_face(pair: &PiecePair<'_>) -> Option<(SeparatingAxis, usize)> {
    let axis = upright(pair)?;
    let AxisSource::FaceB(face) = axis.kind else { return None };
    Some((axis, face))
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
    rim: &Rim,
    scratch: &mut PairScratch,
    mut best: SeparatingAxis,
) -> SeparatingAxis {
    let PairScratch { vertices, products, .. } = scratch;
    for (index_b, edge_b) in pair.b.edges().iter().enumerate() {
        let (from_b, along_b) = span(vertices, edge_b);
        products.clear();
        products.extend(pair.a.faces().iter().map(|face| face.normal.dot(&along_b)));
        let outward = -(pair.rotation * rim.wings[index_b][0]);
        for (index_a, edge_a) in pair.a.edges().iter().enumerate() {
            if edge_a.faces.is_some_and(|[l, r]| products[l as usize] * products[r as usize] >= 0.0)
            {
                continue;
            }
            let (from_a, along_a) = span(pair.a.vertices(), edge_a);
            let across = along_a.cross(&along_b);
            let norm = across.norm();
            if norm <= super::axes::PARALLEL * along_a.norm() * along_b.norm() {
                continue;
            }
            let normal = across * (-across.dot(&outward).signum() / norm);
            let between = |faces: [u32; 2]| faces.map(|face| pair.a.faces()[face as usize].normal);
            if edge_a.faces.map(between).is_some_and(|[l, r]| (l + r).dot(&normal) <= 0.0) {
                continue;
            }
            let gap = normal.dot(&(from_b - from_a));
            if gap > best.gap {
                let kind = AxisSource::Edges(index_a, index_b);
                best = SeparatingAxis { kind, normal, gap, exact: false };
            }
        }
    }
    best
}
