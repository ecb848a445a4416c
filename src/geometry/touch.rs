//! What a touch is, and how the features of two pieces make one.

use super::closest::Points;
use super::pair::Pair;
use nalgebra::Vector3;

/// One of the two pieces.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Side {
    /// The first.
    A,
    /// The second.
    B,
}

/// What a touch is, between two pieces: the same as long as the same features touch, whatever
/// the motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Feature {
    /// A vertex of the piece on this side against the other piece.
    Vertex(Side, u32),
    /// An edge of A and an edge of B.
    Edges(u32, u32),
}

/// One point of one piece against a plane of the other. With w the point in the frame of the
/// plane's owner, the gap is n·w − d − ρ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Whose the point is; the plane is the other's.
    pub point_of: Side,
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

impl Pair<'_> {
    /// A point of B (m, frame of A) against a face of A.
    pub(super) fn on_face_a(&self, face: usize, point: &Vector3<f64>, feature: Feature) -> Touch {
        let face = &self.a.faces()[face];
        let own = match feature {
            Feature::Vertex(Side::B, vertex) => self.b.vertices()[vertex as usize],
            _ => self.in_b(point),
        };
        Touch {
            point_of: Side::B,
            point: own,
            point_radius: self.radius_b,
            normal: face.normal,
            offset: face.offset + self.radius_a,
            gap: face.normal.dot(point) - face.offset - self.radii(),
            feature,
        }
    }

    /// A point of A (m, its frame) against a face of B.
    pub(super) fn on_face_b(&self, face: usize, point: &Vector3<f64>, feature: Feature) -> Touch {
        let face = &self.b.faces()[face];
        Touch {
            point_of: Side::A,
            point: *point,
            point_radius: self.radius_a,
            normal: face.normal,
            offset: face.offset + self.radius_b,
            gap: face.normal.dot(&self.in_b(point)) - face.offset - self.radii(),
            feature,
        }
    }

    /// Two points, the one against the plane through the other across `normal` (unit, frame
    /// of A, from A to B). The point is that of the larger radius; of equals that of `owner`.
    pub(super) fn between(
        &self,
        points: &Points,
        normal: &Vector3<f64>,
        feature: Feature,
        owner: Side,
    ) -> Touch {
        let owner = match self.radius_a.total_cmp(&self.radius_b) {
            std::cmp::Ordering::Greater => Side::A,
            std::cmp::Ordering::Less => Side::B,
            std::cmp::Ordering::Equal => owner,
        };
        let gap = normal.dot(&(points.b - points.a)) - self.radii();
        let in_b = self.in_b(&points.b);
        match owner {
            Side::A => {
                let normal = self.rotation.tr_mul(&-normal);
                Touch {
                    point_of: Side::A,
                    point: points.a,
                    point_radius: self.radius_a,
                    normal,
                    offset: normal.dot(&in_b) + self.radius_b,
                    gap,
                    feature,
                }
            }
            Side::B => Touch {
                point_of: Side::B,
                point: in_b,
                point_radius: self.radius_b,
                normal: *normal,
                offset: normal.dot(&points.a) + self.radius_a,
                gap,
                feature,
            },
        }
    }
}
