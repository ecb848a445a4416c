//! Intersection of a ray with a piece.
//!
//! A piece is solid and closed: a ray that touches it hits it. A ray along a face hits the face to
//! rounding.

use super::hint::Hint;
use super::scratch::PairScratch;
use super::separation::signed_distance;
use super::{Hull, Piece};
use crate::error::Error;
use crate::kinematics::Pose;
use nalgebra::{Matrix3, Vector3};

/// Squared sine below which a ray is parallel to a capsule. It then enters through an end.
const PARALLEL: f64 = 1e-24;

/// Radius of the ball that measures the distance of a point from a piece (m).
const PROBE: f64 = 1e-6;

/// Largest number of tangent planes. A ray that touches a round surface halves its distance with
/// each plane, so 60 planes reach the rounding error.
const MOST_PLANES: u32 = 200;

/// Entry of a ray into a piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayEntry {
    /// Distance along the ray (m), 0 if it starts inside.
    pub distance: f64,
    /// Outward unit normal of the surface; `None` if the ray starts inside.
    pub normal: Option<Vector3<f64>>,
}

impl RayEntry {
    const INSIDE: Self = Self { distance: 0.0, normal: None };

    /// Entry at `distance` with a normal along `outward`.
    fn at(distance: f64, outward: Vector3<f64>) -> Self {
        Self { distance, normal: outward.try_normalize(0.0) }
    }
}

/// Intersects rays with pieces. It holds the workspace of the intersection.
#[derive(Debug, Clone)]
pub struct RayCaster {
    probe: Piece,
    scratch: PairScratch,
}

impl RayCaster {
    /// Creates the workspace.
    ///
    /// # Errors
    /// None in practice: the radius of the probe is in its range.
    pub fn new() -> Result<Self, Error> {
        Ok(Self { probe: Piece::sphere(PROBE)?, scratch: PairScratch::default() })
    }

    /// First point at which the ray from `origin` (m, world) along the unit vector `direction`
    /// enters `piece` at `pose`; `None` if it misses.
    ///
    /// Balls, capsules and polyhedra have closed forms. A rounded polyhedron and a smooth shape are
    /// approached by tangent planes.
    pub fn enter(
        &mut self,
        piece: &Piece,
        pose: &Pose,
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
    ) -> Option<RayEntry> {
        let ray = LocalRay {
            origin: pose.rotation.tr_mul(&(origin - pose.position)),
            direction: pose.rotation.tr_mul(direction),
        };
        let radius = piece.radius();
        let entry = match piece.core().vertices() {
            _ if piece.smooth().is_some() => self.approach(piece, &ray),
            [centre] => ray.ball(centre, radius),
            [from, to] => ray.capsule(from, to, radius),
            _ if radius == 0.0 => ray.polyhedron(piece.core()),
            _ => self.approach(piece, &ray),
        }?;
        Some(RayEntry { normal: entry.normal.map(|normal| pose.rotation * normal), ..entry })
    }

    /// Entry into any convex piece by its distance function.
    ///
    /// At a point outside, the closest point of the piece has a tangent plane, and the piece lies
    /// behind it. The ray moves on to this plane. The distance is a convex function of the place
    /// along the ray, so this is Newton's method for its first root, from the side on which it
    /// never passes the root.
    fn approach(&mut self, piece: &Piece, ray: &LocalRay) -> Option<RayEntry> {
        const FRAME: Pose = Pose { position: Vector3::new(0.0, 0.0, 0.0), rotation: UNIT };
        let scale = ray.origin.amax() + piece.core().reach() + piece.radius();
        let tolerance = 4.0 * f64::EPSILON * scale;
        let (mut distance, mut normal) = (0.0, None);
        for _ in 0..MOST_PLANES {
            let point = Pose { position: ray.at(distance), rotation: UNIT };
            let (piece, probe) = ((piece, &FRAME), (&self.probe, &point));
            let apart = signed_distance(piece, probe, &mut Hint::default(), &mut self.scratch);
            let height = apart.distance + PROBE;
            if height <= tolerance {
                let outward = normal.map(|_| apart.axis);
                return Some(RayEntry { distance, normal: outward });
            }
            let sinks = -apart.axis.dot(&ray.direction);
            let next = distance + height / sinks;
            // A step below rounding ends at the surface too.
            if sinks <= 0.0 || !next.is_finite() {
                return None;
            }
            if next <= distance {
                return Some(RayEntry { distance, normal: Some(apart.axis) });
            }
            (distance, normal) = (next, Some(apart.axis));
        }
        None
    }
}

const UNIT: Matrix3<f64> = Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);

/// A ray in the frame of a piece.
struct LocalRay {
    origin: Vector3<f64>,
    direction: Vector3<f64>,
}

impl LocalRay {
    fn at(&self, distance: f64) -> Vector3<f64> {
        self.origin + self.direction * distance
    }

    /// Entry into a ball. With c the centre and t₀ the place of the ray nearest to it,
    ///
    /// ```text
    /// t = t₀ − √(ρ² − |o + t₀ d − c|²),   t₀ = (c − o)·d
    /// ```
    fn ball(&self, centre: &Vector3<f64>, radius: f64) -> Option<RayEntry> {
        if (self.origin - centre).norm_squared() <= radius * radius {
            return Some(RayEntry::INSIDE);
        }
        let nearest = (centre - self.origin).dot(&self.direction);
        let square = radius * radius - (self.at(nearest) - centre).norm_squared();
        let distance = nearest - square.max(0.0).sqrt();
        let hits = square >= 0.0 && distance >= 0.0;
        hits.then(|| RayEntry::at(distance, self.at(distance) - centre))
    }

    /// Entry into a capsule: into the tube about its segment, or into the ball of an end.
    fn capsule(&self, from: &Vector3<f64>, to: &Vector3<f64>, radius: f64) -> Option<RayEntry> {
        let (along, start) = (to - from, self.origin - from);
        let length = along.norm();
        let axis = along / length;
        let across = |vector: &Vector3<f64>| vector - axis * axis.dot(vector);
        let foot = from + axis * axis.dot(&start).clamp(0.0, length);
        if (self.origin - foot).norm_squared() <= radius * radius {
            return Some(RayEntry::INSIDE);
        }
        let place = across(&start);
        let across_direction = across(&self.direction);
        let slope = across_direction.norm_squared();
        let tube = || {
            let nearest = -place.dot(&across_direction) / slope;
            let square = radius * radius - (place + across_direction * nearest).norm_squared();
            let distance = nearest - (square.max(0.0) / slope).sqrt();
            let height = axis.dot(&(start + self.direction * distance));
            let hits = square >= 0.0 && distance >= 0.0 && (0.0..=length).contains(&height);
            hits.then(|| RayEntry::at(distance, place + across_direction * distance))
        };
        let tube = if slope > PARALLEL { tube() } else { None };
        let ends = [self.ball(from, radius), self.ball(to, radius)];
        let all = ends.into_iter().chain([tube]).flatten();
        all.min_by(|a, b| a.distance.total_cmp(&b.distance))
    }

    /// Entry into a polyhedron: the last of the faces that the ray passes inwards, if it is not
    /// behind the first face that the ray passes outwards.
    fn polyhedron(&self, hull: &Hull) -> Option<RayEntry> {
        let (mut entry, mut exit) = (RayEntry::INSIDE, f64::INFINITY);
        for face in hull.faces() {
            let height = face.normal.dot(&self.origin) - face.offset;
            let sinks = -face.normal.dot(&self.direction);
            let distance = height / sinks;
            if height > 0.0 {
                if sinks <= 0.0 {
                    return None;
                }
                if distance > entry.distance || entry.normal.is_none() {
                    entry = RayEntry { distance, normal: Some(face.normal) };
                }
            } else if sinks < 0.0 {
                exit = exit.min(distance);
            }
        }
        (entry.distance <= exit).then_some(entry)
    }
}
