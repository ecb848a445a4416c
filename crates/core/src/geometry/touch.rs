//! Contact points, and their construction from the features of two pieces.

use super::closest_features::Points;
use super::features::{Feature, PieceSide};
use super::pair::PiecePair;
use super::support::highest;
use nalgebra::Vector3;

/// Relative distance of cores below which their direction is undefined.
const NO_DIRECTION: f64 = 1e-8;

/// A contact point: a point of one piece against a plane of the other. The gap is n·w − d − ρ, with
/// w the point in the frame of the plane's piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ManifoldPoint {
    /// Piece that owns the point; the other piece owns the plane.
    pub point_of: PieceSide,
    /// Point of the core (m, body frame of its piece).
    pub point: Vector3<f64>,
    /// ρ: radius of the point's piece (m).
    pub point_radius: f64,
    /// n: unit normal (body frame of the plane's piece), pointing away from that piece.
    pub normal: Vector3<f64>,
    /// d: plane offset (m, same frame), including the radius of the plane's piece.
    pub offset: f64,
    /// Gap at the given poses (m).
    pub gap: f64,
    /// The features in contact.
    pub feature: Feature,
}

impl PiecePair<'_> {
    /// Builds the contact of `point` (frame of its piece) and a plane of the other core. The plane
    /// has `normal` and `offset` in the frame of its piece, and the point is `height` above it (m).
    fn touch(
        &self,
        point_of: PieceSide,
        point: Vector3<f64>,
        normal: Vector3<f64>,
        offset: f64,
        height: f64,
        feature: Feature,
    ) -> ManifoldPoint {
        let (point_radius, radius) = match point_of {
            PieceSide::A => (self.radius_a, self.radius_b),
            PieceSide::B => (self.radius_b, self.radius_a),
        };
        let (offset, gap) = (offset + radius, height - self.radii());
        ManifoldPoint { point_of, point, point_radius, normal, offset, gap, feature }
    }

    /// Contact of a point of B (m, frame of A) with a face of A.
    pub(super) fn on_face_a(
        &self,
        face: usize,
        point: &Vector3<f64>,
        feature: Feature,
    ) -> ManifoldPoint {
        let face = &self.a.faces()[face];
        let own = match feature {
            Feature::Vertex(PieceSide::B, vertex) => self.b.vertices()[vertex as usize],
            _ => self.in_b(point),
        };
        let height = face.normal.dot(point) - face.offset;
        self.touch(PieceSide::B, own, face.normal, face.offset, height, feature)
    }

    /// Contact of a point of A (m, frame of A) with a face of B.
    pub(super) fn on_face_b(
        &self,
        face: usize,
        point: &Vector3<f64>,
        feature: Feature,
    ) -> ManifoldPoint {
        let face = &self.b.faces()[face];
        let height = face.normal.dot(&self.in_b(point)) - face.offset;
        self.touch(PieceSide::A, *point, face.normal, face.offset, height, feature)
    }

    /// Contact of one point with the plane through the other point. The plane is perpendicular to
    /// `normal` (unit, frame of A, from A to B).
    ///
    /// The piece with the larger radius owns the point; for equal radii it is `owner`.
    pub(super) fn between(
        &self,
        points: &Points,
        normal: &Vector3<f64>,
        feature: Feature,
        owner: PieceSide,
    ) -> ManifoldPoint {
        let owner = match self.radius_a.total_cmp(&self.radius_b) {
            std::cmp::Ordering::Greater => PieceSide::A,
            std::cmp::Ordering::Less => PieceSide::B,
            std::cmp::Ordering::Equal => owner,
        };
        let [point, on] = owner.ordered([&points.a, &points.b]);
        self.on_plane(owner, point, on, normal, feature)
    }

    /// Unit direction from a point of A to a point of B (both m, frame of A). `None` if their
    /// distance is at rounding level.
    pub(super) fn direction(&self, a: &Vector3<f64>, b: &Vector3<f64>) -> Option<Vector3<f64>> {
        let distance = (b - a).norm();
        (distance > NO_DIRECTION * self.size()).then(|| (b - a) / distance)
    }

    /// True if no part of the plane's piece is more than `merge` (m) above the plane.
    pub(super) fn is_below(&self, touch: &ManifoldPoint, merge: f64) -> bool {
        let (hull, radius) = match touch.point_of {
            PieceSide::A => (self.b, self.radius_b),
            PieceSide::B => (self.a, self.radius_a),
        };
        highest(hull.vertices(), &touch.normal).1 + radius - touch.offset <= merge
    }

    /// Contact of a point of the piece `owner` with the closest point of the other core. The plane is
    /// perpendicular to the line between them, or to `or` if the line has no direction.
    pub(super) fn against(
        &self,
        owner: PieceSide,
        point: &Vector3<f64>,
        nearest: &Vector3<f64>,
        or: &Vector3<f64>,
        feature: Feature,
    ) -> ManifoldPoint {
        let [a, b] = owner.ordered([point, nearest]);
        let normal = self.direction(a, b).unwrap_or(*or);
        self.on_plane(owner, point, nearest, &normal, feature)
    }

    /// Contact of a point of the piece `owner` with the plane through the point `on` of the other; `normal`
    /// points from A to B.
    fn on_plane(
        &self,
        owner: PieceSide,
        point: &Vector3<f64>,
        on: &Vector3<f64>,
        normal: &Vector3<f64>,
        feature: Feature,
    ) -> ManifoldPoint {
        match owner {
            PieceSide::A => {
                let away = self.rotation.tr_mul(&-normal);
                let offset = away.dot(&self.in_b(on));
                self.touch(owner, *point, away, offset, normal.dot(&(on - point)), feature)
            }
            PieceSide::B => {
                let height = normal.dot(&(point - on));
                self.touch(owner, self.in_b(point), *normal, normal.dot(on), height, feature)
            }
        }
    }
}
