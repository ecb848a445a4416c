//! What a touch is, and how the features of two pieces make one.

use super::closest::Points;
use super::pair::{PiecePair, highest};
use nalgebra::Vector3;

/// A distance of cores that is smaller than this part of the size has no direction.
const NO_DIRECTION: f64 = 1e-8;

/// One of the two pieces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum PieceSide {
    /// The first.
    A,
    /// The second.
    B,
}

/// What a touch is, between two pieces: the same as long as the same features touch, whatever
/// the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum Feature {
    /// A vertex of the piece on this side against the other piece.
    Vertex(PieceSide, u32),
    /// An edge of A and an edge of B.
    Edges(u32, u32),
    /// A vertex of A and a vertex of B, of pieces of equal radius.
    Vertices(u32, u32),
    /// A vertex or an edge of A and one of B, of which one is rounded: how far they are apart is
    /// known exactly, wherever the pieces are.
    Round(CorePart, CorePart),
}

/// A part of a core that is no face.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum CorePart {
    /// The vertex of this number.
    Vertex(u32),
    /// The edge of this number.
    Edge(u32),
}

/// One point of one piece against a plane of the other. With w the point in the frame of the
/// plane's owner, the gap is n·w − d − ρ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Whose the point is; the plane is the other's.
    pub point_of: PieceSide,
    /// The point of the core, m, body frame of its owner.
    pub point: Vector3<f64>,
    /// ρ, m: the radius of the point's owner.
    pub point_radius: f64,
    /// n, unit, body frame of the plane's owner, pointing away from it.
    pub normal: Vector3<f64>,
    /// d, m, in the same frame; the radius of the plane's owner is in it.
    pub offset: f64,
    /// m, at the poses given.
    pub gap: f64,
    /// Which features touch.
    pub feature: Feature,
}

impl PiecePair<'_> {
    /// The `point` of `point_of` (frame of its owner) against the plane of the other's core with this
    /// `normal` and `offset` (frame of its owner), above which it is by `height`.
    fn touch(
        &self,
        point_of: PieceSide,
        point: Vector3<f64>,
        normal: Vector3<f64>,
        offset: f64,
        height: f64,
        feature: Feature,
    ) -> Touch {
        let (point_radius, radius) = match point_of {
            PieceSide::A => (self.radius_a, self.radius_b),
            PieceSide::B => (self.radius_b, self.radius_a),
        };
        let (offset, gap) = (offset + radius, height - self.radii());
        Touch { point_of, point, point_radius, normal, offset, gap, feature }
    }

    /// A point of B (m, frame of A) against a face of A.
    pub(super) fn on_face_a(&self, face: usize, point: &Vector3<f64>, feature: Feature) -> Touch {
        let face = &self.a.faces()[face];
        let own = match feature {
            Feature::Vertex(PieceSide::B, vertex) => self.b.vertices()[vertex as usize],
            _ => self.in_b(point),
        };
        let height = face.normal.dot(point) - face.offset;
        self.touch(PieceSide::B, own, face.normal, face.offset, height, feature)
    }

    /// A point of A (m, its frame) against a face of B.
    pub(super) fn on_face_b(&self, face: usize, point: &Vector3<f64>, feature: Feature) -> Touch {
        let face = &self.b.faces()[face];
        let height = face.normal.dot(&self.in_b(point)) - face.offset;
        self.touch(PieceSide::A, *point, face.normal, face.offset, height, feature)
    }

    /// Two points, the one against the plane through the other across `normal` (unit, frame
    /// of A, from A to B). The point is that of the larger radius; of equals that of `owner`.
    pub(super) fn between(
        &self,
        points: &Points,
        normal: &Vector3<f64>,
        feature: Feature,
        owner: PieceSide,
    ) -> Touch {
        let owner = match self.radius_a.total_cmp(&self.radius_b) {
            std::cmp::Ordering::Greater => PieceSide::A,
            std::cmp::Ordering::Less => PieceSide::B,
            std::cmp::Ordering::Equal => owner,
        };
        match owner {
            PieceSide::A => self.a_on_plane(&points.a, &points.b, normal, feature),
            PieceSide::B => self.b_on_plane(&points.b, &points.a, normal, feature),
        }
    }

    /// The direction from a point of A to one of B (m, frame of A), unless they are so near
    /// that it is rounding.
    pub(super) fn direction(&self, a: &Vector3<f64>, b: &Vector3<f64>) -> Option<Vector3<f64>> {
        let distance = (b - a).norm();
        (distance > NO_DIRECTION * self.size()).then(|| (b - a) / distance)
    }

    /// Whether no part of the plane's owner is more than `merge` (m) above the plane.
    pub(super) fn is_below(&self, touch: &Touch, merge: f64) -> bool {
        let (hull, radius) = match touch.point_of {
            PieceSide::A => (self.b, self.radius_b),
            PieceSide::B => (self.a, self.radius_a),
        };
        highest(hull.vertices(), &touch.normal).1 + radius - touch.offset <= merge
    }

    /// A point of A against the nearest point of B's core: the plane is across the line
    /// between them, or across `or` where there is no direction.
    pub(super) fn a_against(
        &self,
        point: &Vector3<f64>,
        nearest: &Vector3<f64>,
        or: &Vector3<f64>,
        feature: Feature,
    ) -> Touch {
        let normal = self.direction(point, nearest).unwrap_or(*or);
        self.a_on_plane(point, nearest, &normal, feature)
    }

    /// The same for a point of B.
    pub(super) fn b_against(
        &self,
        point: &Vector3<f64>,
        nearest: &Vector3<f64>,
        or: &Vector3<f64>,
        feature: Feature,
    ) -> Touch {
        let normal = self.direction(nearest, point).unwrap_or(*or);
        self.b_on_plane(point, nearest, &normal, feature)
    }

    /// A point of A against the plane through a point of B; `normal` from A to B.
    fn a_on_plane(
        &self,
        point: &Vector3<f64>,
        on: &Vector3<f64>,
        normal: &Vector3<f64>,
        feature: Feature,
    ) -> Touch {
        let away = self.rotation.tr_mul(&-normal);
        let plane = (away, away.dot(&self.in_b(on)));
        self.touch(PieceSide::A, *point, plane.0, plane.1, normal.dot(&(on - point)), feature)
    }

    /// A point of B against the plane through a point of A; `normal` from A to B.
    fn b_on_plane(
        &self,
        point: &Vector3<f64>,
        on: &Vector3<f64>,
        normal: &Vector3<f64>,
        feature: Feature,
    ) -> Touch {
        let (own, plane) = (self.in_b(point), (*normal, normal.dot(on)));
        self.touch(PieceSide::B, own, plane.0, plane.1, normal.dot(&(point - on)), feature)
    }
}
