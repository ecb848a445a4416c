//! One piece of a pair with a smooth shape: its support points and the features there.

use super::features::PieceSide;
use super::manifold_pair::NEARLY_ACROSS;
use super::pair::PiecePair;
use super::support::highest;
use super::{Ellipsoid, Hull, Smooth};
use nalgebra::{Matrix3, Vector3};

/// Difference of heights below which two parts of a piece are equally far, relative to its size.
pub(super) const TIE: f64 = 1e-6;
/// Difference from 1 of the cosine above which a face of a core is the flat end of its shape.
const SAME_NORMAL: f64 = 1e-12;

/// Features of a piece that are farthest along a direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum SupportFeature {
    /// An ellipsoid or the rim of a disc, by its index.
    Ellipsoid(u32),
    /// The lateral surface of a cylinder.
    Lateral,
    Vertex(u32),
    Edge(u32),
    /// A face of a polyhedron or the flat end of a smooth shape.
    Face,
    /// The lateral surface of a cone.
    Cone,
}

/// One piece of a pair, and its pose in the frame of A.
#[derive(Clone, Copy)]
pub(super) struct SmoothSide<'a> {
    pub side: PieceSide,
    pub hull: &'a Hull,
    pub radius: f64,
    pub smooth: Option<&'a Smooth>,
    pub rotation: Matrix3<f64>,
    pub shift: Vector3<f64>,
}

impl<'a> PiecePair<'a> {
    /// Both pieces, A first.
    pub(super) fn sides(&self) -> [SmoothSide<'a>; 2] {
        let of_a = SmoothSide {
            side: PieceSide::A,
            hull: self.a,
            radius: self.radius_a,
            smooth: self.smooth_a,
            rotation: Matrix3::identity(),
            shift: Vector3::zeros(),
        };
        let of_b = SmoothSide {
            side: PieceSide::B,
            hull: self.b,
            radius: self.radius_b,
            smooth: self.smooth_b,
            rotation: self.rotation,
            shift: self.shift,
        };
        [of_a, of_b]
    }
}

/// True if a face of a core with this `normal` is a face of the piece: of a polyhedron, or the flat
/// end of a smooth shape.
pub(super) fn is_flat_end(smooth: Option<&Smooth>, normal: &Vector3<f64>) -> bool {
    match smooth {
        Some(Smooth::Ellipsoid(_)) => false,
        Some(smooth) => smooth.ellipsoids()[0].normal().dot(normal).abs() >= 1.0 - SAME_NORMAL,
        None => true,
    }
}

impl SmoothSide<'_> {
    /// A direction of the frame of A, in the frame of this piece.
    pub fn to_local(self, direction: &Vector3<f64>) -> Vector3<f64> {
        self.rotation.tr_mul(direction)
    }

    /// A point of this piece (m) in the frame of A.
    pub fn placed(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point + self.shift
    }

    /// Largest n·x over the piece for a unit vector `n` (m, own frame).
    pub fn extent(&self, n: &Vector3<f64>) -> f64 {
        match self.smooth {
            Some(smooth) => smooth.extent(n),
            None => highest(self.hull.vertices(), n).1 + self.radius,
        }
    }

    pub fn ellipsoid(&self, index: u32) -> Option<&Ellipsoid> {
        self.smooth?.ellipsoids().get(index as usize)
    }

    /// Features that are farthest along the unit vector `n` (own frame).
    pub fn support(&self, n: &Vector3<f64>) -> SupportFeature {
        self.support_within(n, TIE)
    }

    /// The same, where parts that are less far by up to `tie` (relative) count as well.
    pub fn support_within(&self, n: &Vector3<f64>, tie: f64) -> SupportFeature {
        let tie = tie * self.hull.reach().max(self.radius);
        let Some(smooth) = self.smooth else { return self.support_of_core(n, tie) };
        let one = &smooth.ellipsoids()[0];
        let height = |one: &Ellipsoid| n.dot(&one.centre) + one.half_width(n);
        let other = match smooth {
            Smooth::Cylinder([_, to]) => height(to),
            Smooth::Cone { apex, .. } => n.dot(&apex.1),
            Smooth::Ellipsoid(_) => return SupportFeature::Ellipsoid(0),
        };
        let (second, between) = match smooth {
            Smooth::Cone { apex, .. } => (SupportFeature::Vertex(apex.0), SupportFeature::Cone),
            _ => (SupportFeature::Ellipsoid(1), SupportFeature::Lateral),
        };
        let higher = other - height(one);
        let found = match (higher.abs() <= tie, higher > 0.0) {
            (true, _) => return between,
            (_, true) => second,
            _ => SupportFeature::Ellipsoid(0),
        };
        let is_flat = one.half_width(n) <= TIE * one.size();
        match found {
            SupportFeature::Ellipsoid(_) if is_flat => SupportFeature::Face,
            found => found,
        }
    }

    fn support_of_core(&self, n: &Vector3<f64>, tie: f64) -> SupportFeature {
        let vertices = self.hull.vertices();
        let (first, height) = highest(vertices, n);
        let is_far = |vertex: usize| n.dot(&vertices[vertex]) >= height - tie;
        let mut others = (0..vertices.len()).filter(|&vertex| vertex != first && is_far(vertex));
        match (others.next(), others.next()) {
            (None, _) => SupportFeature::Vertex(first as u32),
            (Some(second), None) => {
                let ends = [first.min(second) as u32, first.max(second) as u32];
                let edge = self.hull.edges().iter().position(|edge| edge.vertices == ends);
                edge.map_or(SupportFeature::Vertex(first as u32), |edge| {
                    SupportFeature::Edge(edge as u32)
                })
            }
            _ => SupportFeature::Face,
        }
    }

    /// The feature between two features: the edge of two vertices, or a lateral surface. A feature
    /// that bounds it leaves it unchanged.
    pub fn between(&self, one: SupportFeature, other: SupportFeature) -> Option<SupportFeature> {
        use SupportFeature::{Cone, Edge, Ellipsoid, Lateral, Vertex};
        let has =
            |edge: u32, vertex: u32| self.hull.edges()[edge as usize].vertices.contains(&vertex);
        match (one, other) {
            (Ellipsoid(i), Ellipsoid(j)) if i != j => Some(Lateral),
            (Lateral, Ellipsoid(_)) => Some(Lateral),
            (Ellipsoid(_), Vertex(_)) | (Vertex(_), Ellipsoid(_)) => Some(Cone),
            (Cone, Ellipsoid(_) | Vertex(_)) => Some(Cone),
            (Vertex(i), Vertex(j)) if i != j => {
                let edges = 0..self.hull.edges().len() as u32;
                edges.into_iter().find(|&edge| has(edge, i) && has(edge, j)).map(Edge)
            }
            (Edge(edge), Vertex(vertex)) if has(edge, vertex) => Some(Edge(edge)),
            _ => None,
        }
    }

    /// Normals of the faces of a polyhedron, or of the flat ends of a smooth shape (own frame).
    pub fn flat_normals(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        let faces = self.hull.faces().iter().filter(|face| is_flat_end(self.smooth, &face.normal));
        faces.map(|face| face.normal)
    }

    /// Face of a polyhedron, or the flat end of a smooth shape, whose normal is nearly along the unit
    /// vector `n` (own frame). The end of a smooth shape is a face of its core.
    pub fn face_across(&self, n: &Vector3<f64>) -> Option<usize> {
        let faces = self.hull.faces().iter().enumerate();
        let cosines = faces.filter(|(_, face)| is_flat_end(self.smooth, &face.normal));
        let cosines = cosines.map(|(index, face)| (index, face.normal.dot(n)));
        let best = cosines.max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)))?;
        (best.1 > NEARLY_ACROSS).then_some(best.0)
    }

    /// Ends of a straight feature, or a vertex twice (m, own frame), and its radius (m). The line of
    /// a cone is the one that is farthest along the unit vector `n` (own frame). `None` for another
    /// feature.
    pub fn ends(
        &self,
        feature: SupportFeature,
        n: &Vector3<f64>,
    ) -> Option<([Vector3<f64>; 2], f64)> {
        let vertex = |at: u32| self.hull.vertices()[at as usize];
        match feature {
            SupportFeature::Lateral => Some((self.smooth?.axis()?, self.smooth?.radius()?)),
            SupportFeature::Cone => {
                let base = self.ellipsoid(0)?;
                Some(([self.smooth?.apex()?.1, base.centre + base.farthest(n)], 0.0))
            }
            SupportFeature::Edge(edge) => {
                let ends = self.hull.edges()[edge as usize].vertices;
                Some((ends.map(vertex), self.radius))
            }
            SupportFeature::Vertex(at) => {
                // The core of an ellipsoid has a radius, and an apex has none.
                Some(([vertex(at); 2], if self.smooth.is_some() { 0.0 } else { self.radius }))
            }
            SupportFeature::Ellipsoid(_) | SupportFeature::Face => None,
        }
    }

    /// The point that is farthest along the unit vector `n` (m, own frame).
    pub fn farthest(&self, n: &Vector3<f64>) -> Vector3<f64> {
        match self.smooth {
            Some(smooth) => smooth.farthest(n),
            None => self.hull.vertices()[highest(self.hull.vertices(), n).0] + n * self.radius,
        }
    }
}
