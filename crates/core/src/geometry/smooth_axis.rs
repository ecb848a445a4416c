//! Axis of separation of two pieces, at least one with a smooth shape.
//!
//! [Portals](super::portal) find an approximate axis n. Of the features that are farthest along it,
//! the axis follows in a few steps:
//!
//! - across a face, or across two straight features that cross;
//! - along the shortest line of two straight features with a radius;
//! - else by Newton's method for the largest gap s(n). With the support points a and b, the tangents
//!   T of n, and the second derivatives H of both support functions,
//!
//! ```text
//! s = n·(b − a),   Tᵀ(H + s) T δ = Tᵀ (b − a)
//! ```
//!
//! Along a straight feature n does not turn. An axis is proved by two points of the pieces, whose
//! difference is s n: then the gap along n is their distance. Where this fails, portals go on to
//! rounding.

use super::nearest::{Nearest, nearest};
use super::pair::{Hint, PiecePair};
use super::portal::{Portal, TIGHT};
use super::segment::nearest_shares;
use super::smooth_side::{SmoothSide, SupportFeature};
use nalgebra::{Matrix2, Matrix2x3, Matrix3, Vector2, Vector3};

/// Distance above which pieces do not touch, relative to the smaller one.
const APART: f64 = 1e-6;
/// Distance of the plane from a portal at which features are tried, relative to the smaller piece.
const ROUGH: f64 = 1e-3;
/// Overlap up to which the axis before may be kept, relative to the smaller piece. Pieces that
/// overlap deeper have several axes.
const SHALLOW: f64 = 1e-3;
/// Largest motion of a piece's end by the last turn of the axis, relative to the smaller piece.
const SETTLED: f64 = 1e-12;
/// Largest number of steps from an approximate axis.
const MOST_STEPS: u32 = 8;
/// Largest part of the difference of two points across the axis that proves it, relative to the
/// smaller piece. The gap then is off by at most the square of this.
const PROVED: f64 = 1e-8;

impl PiecePair<'_> {
    /// Nearest points of a pair with a smooth shape that has the axis of separation `axis`. `None` if
    /// the pieces touch or overlap.
    pub(super) fn smooth_nearest(&self, axis: &Vector3<f64>) -> Option<Nearest> {
        let is_apart = self.gap_along(axis) - self.radii() > APART * self.size();
        if is_apart { nearest(self, axis) } else { None }
    }

    /// Axis of separation (unit, frame of A, from A to B) of a pair with a smooth shape.
    ///
    /// If straight features or faces are farthest along it, the axis is exactly perpendicular to
    /// them. An axis before (`hint`) saves the search if the features are still the same.
    pub(super) fn smooth_axis(&self, hint: &Hint) -> Vector3<f64> {
        let sides = self.sides();
        // Overlapping pieces have several axes along which the gap is largest nearby.
        let better = |than: Vector3<f64>| {
            let least = self.gap_along(&than) - TIGHT * self.size();
            self.follow(&sides, than).filter(|axis| self.gap_along(axis) >= least)
        };
        let is_shallow = |axis: &Vector3<f64>| self.gap_along(axis) > -SHALLOW * self.size();
        if let Some(axis) = hint.axis_of(self).and_then(better).filter(is_shallow) {
            return axis;
        }
        let mut portal = Portal::new(self);
        if let Some(axis) = better(portal.axis(ROUGH * self.size())) {
            return axis;
        }
        let found = portal.axis(TIGHT * self.size());
        better(found).unwrap_or(found)
    }

    /// Follows the features from an approximate axis. `None` if no axis is proved.
    fn follow(&self, sides: &[SmoothSide<'_>; 2], mut axis: Vector3<f64>) -> Option<Vector3<f64>> {
        for _ in 0..MOST_STEPS {
            let normals = [axis, -sides[1].seen(&axis)];
            if let Some(axis) = self.across_face(sides, &normals) {
                return Some(axis);
            }
            let features = [0, 1].map(|at| sides[at].support(&normals[at]));
            let [a, b] = [0, 1].map(|at| Witness::new(&sides[at], features[at], &normals[at]));
            let (a, b) = (a?, b?);
            let next = step(&a, &b, &axis)?;
            let turned = (next - axis).norm();
            axis = next;
            if turned * self.reach() <= SETTLED * self.size() {
                return self.is_proved(sides, &axis).then_some(axis);
            }
        }
        None
    }

    /// The normal of a face that is nearly across the axis, if the lowest point of the other piece
    /// is over the face.
    fn across_face(
        &self,
        sides: &[SmoothSide<'_>; 2],
        normals: &[Vector3<f64>; 2],
    ) -> Option<Vector3<f64>> {
        [0, 1].into_iter().find_map(|at| {
            let (of, other) = (&sides[at], &sides[1 - at]);
            let face = of.face_across(&normals[at])?;
            let normal = of.rotation * of.hull.faces()[face].normal;
            let lowest = other.placed(&other.farthest(&other.seen(&-normal)));
            let is_over = of.hull.is_over(face, &of.seen(&(lowest - of.shift)), 0.0);
            is_over.then_some(if at == 0 { normal } else { -normal })
        })
    }

    /// True if the gap along the axis is the distance of two points of the pieces.
    fn is_proved(&self, sides: &[SmoothSide<'_>; 2], axis: &Vector3<f64>) -> bool {
        let normals = [*axis, -sides[1].seen(axis)];
        let features = [0, 1].map(|at| sides[at].support(&normals[at]));
        let [a, b] = [0, 1].map(|at| Witness::new(&sides[at], features[at], &normals[at]));
        let (Some(a), Some(b)) = (a, b) else { return false };
        let way = b.nearest(&a) - a.nearest(&b);
        let (along, gap) = (axis.dot(&way), self.gap_along(axis) - self.radii());
        // Parts that are nearly as far as the farthest count as features, too.
        (along - gap).abs() <= SETTLED * self.size()
            && (way - axis * along).norm() <= PROVED * self.size()
    }

    /// Size of both pieces together (m).
    fn reach(&self) -> f64 {
        self.a.reach() + self.b.reach() + self.radii()
    }
}

/// Points of a piece that are farthest along the axis (m, frame of A), and how they follow it.
struct Witness {
    /// A farthest point, or the first end of a straight feature, without its radius.
    from: Vector3<f64>,
    /// Vector to the second end of a straight feature; zero for a point.
    along: Vector3<f64>,
    /// Vector from the feature to the surface.
    outward: Vector3<f64>,
    radius: f64,
    /// Second derivative of the support function (m).
    bend: Matrix3<f64>,
}

impl Witness {
    /// Witness of a `feature` of a piece along the unit vector `n` (own frame). `None` for a face.
    fn new(side: &SmoothSide<'_>, feature: SupportFeature, n: &Vector3<f64>) -> Option<Self> {
        let outward = side.rotation * n;
        let round = |radius: f64| (Matrix3::identity() - outward * outward.transpose()) * radius;
        if let SupportFeature::Ellipsoid(index) = feature {
            let one = side.ellipsoid(index)?;
            let bend = side.rotation * one.bend(n) * side.rotation.transpose();
            let from = side.placed(&(one.centre + one.farthest(n)));
            let zero = Vector3::zeros();
            return Some(Self { from, along: zero, outward: zero, radius: 0.0, bend });
        }
        let (ends, radius) = side.ends(feature, n)?;
        let [from, to] = ends.map(|end| side.placed(&end));
        let along = to - from;
        Some(Self { from, along, outward: outward * radius, radius, bend: round(radius) })
    }

    /// The point of the surface that is nearest to the other piece.
    fn nearest(&self, other: &Self) -> Vector3<f64> {
        let shares = nearest_shares(&self.from, &self.along, &other.from, &other.along);
        self.from + self.along * shares.0 + self.outward
    }

    fn is_straight(&self) -> bool {
        self.along != Vector3::zeros()
    }
}

/// The next axis after the unit vector `axis`. `None` if it does not follow from the features.
fn step(a: &Witness, b: &Witness, axis: &Vector3<f64>) -> Option<Vector3<f64>> {
    if a.is_straight() && b.is_straight() {
        let across = a.along.cross(&b.along);
        let least = super::smooth_manifold::PARALLEL * a.along.norm() * b.along.norm();
        if let Some(across) = across.try_normalize(least) {
            return Some(if across.dot(axis) < 0.0 { -across } else { across });
        }
    }
    if a.radius + b.radius > 0.0
        && a.bend.trace() + b.bend.trace() <= 2.0001 * (a.radius + b.radius)
    {
        // Points and straight features with radii.
        let (s, t) = nearest_shares(&a.from, &a.along, &b.from, &b.along);
        let way = b.from + b.along * t - a.from - a.along * s;
        let along = way.try_normalize(0.0)?;
        return Some(if along.dot(axis) < 0.0 { -along } else { along });
    }
    let way = b.from + b.outward - a.from - a.outward;
    let gap = axis.dot(&way);
    let bend = a.bend + b.bend;
    let straight = [a, b].into_iter().find(|one| one.is_straight());
    let turned = if let Some(straight) = straight {
        let across = straight.along.cross(axis).try_normalize(0.0)?;
        let stiff = across.dot(&(bend * across)) + gap;
        across * (across.dot(&way) / stiff)
    } else {
        let first = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
        let tangents = Matrix2x3::from_rows(&[first.transpose(), axis.cross(&first).transpose()]);
        let stiff: Matrix2<f64> = tangents * bend * tangents.transpose();
        let stiff = stiff + Matrix2::from_diagonal_element(gap);
        let right: Vector2<f64> = tangents * way;
        tangents.transpose() * stiff.lu().solve(&right)?
    };
    let next = (axis + turned).try_normalize(0.0)?;
    (next.dot(axis) > 0.5).then_some(next)
}
