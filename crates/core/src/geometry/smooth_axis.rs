//! Axis of separation of two pieces, at least one with a smooth shape.
//!
//! [Portals](super::portal) find an approximate axis n. Of the features that are farthest along it,
//! the axis follows in a few steps:
//!
//! - across a face, or across two straight features that cross, also lines of cones;
//! - along the shortest line of two straight features with a radius;
//! - else by Newton's method for the largest gap s(n). With the support points a and b, the tangents
//!   T of n, and the second derivatives H of both support functions,
//!
//! ```text
//! s = n·(b − a),   Tᵀ(H + s) T δ = Tᵀ (b − a)
//! ```
//!
//! While a straight feature or the line of a cone is farthest, n has a constant angle with it, and the
//! step stays on this circle. An axis is proved by two points of the pieces, whose
//! difference is s n: then the gap along n is their distance. Where this fails, portals go on to
//! rounding.

use super::features::PieceSide;
use super::gjk::{Nearest, nearest};
use super::hint::Hint;
use super::pair::PiecePair;
use super::portal::{Portal, TIGHT};
use super::segment::closest_segment_parameters;
use super::smooth_manifold::PARALLEL;
use super::smooth_side::{SmoothSide, SupportFeature, TIE, is_flat_end};
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
/// Difference of heights along a rough axis below which two parts are equally far, relative to the
/// piece.
const NEARLY: f64 = 0.02;
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
    /// them. Overlapping pieces are at least as far apart along it as across each flat face.
    pub(super) fn smooth_axis(&self, hint: &Hint) -> Vector3<f64> {
        let axis = self.nearby_axis(hint);
        let mut best = (axis, self.gap_along(&axis) + SETTLED * self.size());
        if best.1 >= self.radii() {
            return axis;
        }
        for side in self.sides() {
            let sign = if side.side == PieceSide::A { 1.0 } else { -1.0 };
            for face in side.hull.faces() {
                let normal = side.rotation * face.normal * sign;
                let gap = self.gap_along(&normal);
                if gap > best.1 && is_flat_end(side.smooth, &face.normal) {
                    best = (normal, gap);
                }
            }
        }
        best.0
    }

    /// An axis along which the gap is largest nearby. The axis before (`hint`) saves the search if the
    /// features are still the same.
    fn nearby_axis(&self, hint: &Hint) -> Vector3<f64> {
        let sides = self.sides();
        // Overlapping pieces have several axes along which the gap is largest nearby.
        let better = |than: Vector3<f64>, tie: f64| {
            let least = self.gap_along(&than) - TIGHT * self.size();
            self.follow(&sides, than, tie).filter(|axis| self.gap_along(axis) >= least)
        };
        let is_shallow = |axis: &Vector3<f64>| self.gap_along(axis) > -SHALLOW * self.size();
        let before = hint.axis_of(self).and_then(|axis| better(axis, TIE));
        if let Some(axis) = before.filter(is_shallow) {
            return axis;
        }
        let mut portal = Portal::new(self);
        if let Some(axis) = better(portal.axis(ROUGH * self.size()), NEARLY) {
            return axis;
        }
        let found = portal.axis(TIGHT * self.size());
        better(found, TIE).or_else(|| better(found, NEARLY)).unwrap_or(found)
    }

    /// Follows the features from an approximate axis. Parts that are less far along it by up to `tie`
    /// (relative) count as well. `None` if no axis is proved.
    fn follow(
        &self,
        sides: &[SmoothSide<'_>; 2],
        mut axis: Vector3<f64>,
        tie: f64,
    ) -> Option<Vector3<f64>> {
        let mut before: Option<[SupportFeature; 2]> = None;
        for _ in 0..MOST_STEPS {
            let normals = [axis, -sides[1].to_local(&axis)];
            if let Some(axis) = self.across_face(sides, &normals) {
                return Some(axis);
            }
            let tie = if before.is_none() { tie } else { TIE };
            let found = [0, 1].map(|at| sides[at].support_within(&normals[at], tie));
            // A step from one feature to the next has passed what is between them.
            let features = before.map_or(found, |before| {
                [0, 1].map(|at| sides[at].between(before[at], found[at]).unwrap_or(found[at]))
            });
            before = Some(features);
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
            let lowest = other.placed(&other.farthest(&other.to_local(&-normal)));
            let is_over = of.hull.is_over(face, &of.to_local(&(lowest - of.shift)), 0.0);
            is_over.then_some(if at == 0 { normal } else { -normal })
        })
    }

    /// True if the gap along the axis is the distance of two points of the pieces.
    fn is_proved(&self, sides: &[SmoothSide<'_>; 2], axis: &Vector3<f64>) -> bool {
        let normals = [*axis, -sides[1].to_local(axis)];
        let features = [0, 1].map(|at| sides[at].support(&normals[at]));
        let [a, b] = [0, 1].map(|at| Witness::new(&sides[at], features[at], &normals[at]));
        let (Some(a), Some(b)) = (a, b) else { return false };
        let offset_vector = b.nearest(&a) - a.nearest(&b);
        let along = axis.dot(&offset_vector);
        let gap = self.gap_along(axis) - self.radii();
        // Parts that are nearly as far as the farthest count as features, too.
        (along - gap).abs() <= SETTLED * self.size()
            && (offset_vector - axis * along).norm() <= PROVED * self.size()
    }

    /// Size of both pieces together (m).
    fn reach(&self) -> f64 {
        self.a.reach() + self.b.reach() + self.radii()
    }
}

/// Points of a piece that are farthest along the axis (m, frame of A), and how they follow it.
struct Witness {
    /// A farthest point, or the first end of a straight feature, without its radius. The apex of a
    /// cone.
    from: Vector3<f64>,
    /// Vector to the second end of a straight feature; zero for a point.
    along: Vector3<f64>,
    /// Vector from the feature to the surface.
    outward: Vector3<f64>,
    radius: f64,
    /// Second derivative of the support function (m).
    bend: Matrix3<f64>,
    /// The plane in which the axis ends while the feature is farthest.
    level: Option<Level>,
    /// True for an ellipsoid and for the line of a cone, which move over the surface with the axis.
    follows: bool,
}

/// The plane n·u = c of the ends of unit vectors n.
#[derive(Clone, Copy)]
struct Level {
    u: Vector3<f64>,
    c: f64,
}

impl Witness {
    /// Witness of a `feature` of a piece along the unit vector `n` (own frame). `None` for a face.
    fn new(side: &SmoothSide<'_>, feature: SupportFeature, n: &Vector3<f64>) -> Option<Self> {
        let (outward, zero) = (side.rotation * n, Vector3::zeros());
        if let SupportFeature::Ellipsoid(index) = feature {
            let one = side.ellipsoid(index)?;
            let bend = side.rotation * one.bend(n) * side.rotation.transpose();
            let from = side.placed(&(one.centre + one.farthest(n)));
            let (radius, level) = (0.0, None);
            return Some(Self {
                from,
                along: zero,
                outward: zero,
                radius,
                bend,
                level,
                follows: true,
            });
        }
        let (ends, radius) = side.ends(feature, n)?;
        let [from, to] = ends.map(|end| side.placed(&end));
        let along = to - from;
        let bend = (Matrix3::identity() - outward * outward.transpose()) * radius;
        let follows = feature == SupportFeature::Cone;
        let level = if follows {
            let (axis, sine) = side.smooth?.cone()?;
            let c = if side.side == PieceSide::A { sine } else { -sine };
            Some(Level { u: side.rotation * axis, c })
        } else {
            along.try_normalize(0.0).map(|u| Level { u, c: 0.0 })
        };
        Some(Self { from, along, outward: outward * radius, radius, bend, level, follows })
    }

    /// The point of the surface that is nearest to the other piece.
    fn nearest(&self, other: &Self) -> Vector3<f64> {
        let shares = closest_segment_parameters(&self.from, &self.along, &other.from, &other.along);
        self.from + self.along * shares.0 + self.outward
    }
}

impl Level {
    /// The unit vector in both planes that is nearest to `axis`.
    ///
    /// ```text
    /// n = (c v × w + d w × u)/|w|² ± w/|w| √(1 − |…|²),   w = u × v
    /// ```
    fn crossing(&self, other: &Self, axis: &Vector3<f64>) -> Option<Vector3<f64>> {
        let across = self.u.cross(&other.u);
        let unit = across.try_normalize(PARALLEL)?;
        let toward = other.u.cross(&across) * self.c + across.cross(&self.u) * other.c;
        let middle = toward / across.norm_squared();
        let rest = 1.0 - middle.norm_squared();
        (rest >= 0.0).then(|| middle + unit * rest.sqrt().copysign(unit.dot(axis)))
    }

    /// Newton's step for the largest gap among the unit vectors in this plane. `offset_vector` is the vector
    /// between the pieces (m), and `bend` the sum of the second derivatives (m).
    ///
    /// With r the unit vector across u nearest to the axis, t = u × r and ρ = √(1 − c²),
    ///
    /// ```text
    /// n = c u + ρ (r cos θ + t sin θ),   s' = ρ t·way,   s″ = −ρ r·way − ρ² tᵀ H t
    /// ```
    fn step(
        &self,
        offset_vector: &Vector3<f64>,
        bend: &Matrix3<f64>,
        axis: &Vector3<f64>,
    ) -> Option<Vector3<f64>> {
        let toward = (axis - self.u * self.u.dot(axis)).try_normalize(0.0)?;
        let across = self.u.cross(&toward);
        let radius = (1.0 - self.c * self.c).sqrt();
        let stiff = toward.dot(offset_vector) + radius * across.dot(&(bend * across));
        let turn = across.dot(offset_vector) / stiff;
        Some(self.u * self.c + (toward + across * turn).normalize() * radius)
    }
}

/// The next axis after the unit vector `axis`. `None` if it does not follow from the features.
fn step(a: &Witness, b: &Witness, axis: &Vector3<f64>) -> Option<Vector3<f64>> {
    let crossing = || a.level?.crossing(&b.level?, axis);
    if let Some(crossing) = crossing() {
        return Some(crossing);
    }
    if a.radius + b.radius > 0.0 && !a.follows && !b.follows {
        // The shortest line of points and straight features with radii.
        let (s, t) = closest_segment_parameters(&a.from, &a.along, &b.from, &b.along);
        let offset_vector = b.from + b.along * t - a.from - a.along * s;
        let along = offset_vector.try_normalize(0.0)?;
        return Some(if along.dot(axis) < 0.0 { -along } else { along });
    }
    let offset_vector = b.from + b.outward - a.from - a.outward;
    let bend = a.bend + b.bend;
    let next = if let Some(level) = a.level.or(b.level) {
        level.step(&offset_vector, &bend, axis)?
    } else {
        let first = axis.cross(&Vector3::ith(axis.iamin(), 1.0)).normalize();
        let tangents = Matrix2x3::from_rows(&[first.transpose(), axis.cross(&first).transpose()]);
        let stiff: Matrix2<f64> = tangents * bend * tangents.transpose();
        let stiff = stiff + Matrix2::from_diagonal_element(axis.dot(&offset_vector));
        let right: Vector2<f64> = tangents * offset_vector;
        (axis + tangents.transpose() * stiff.lu().solve(&right)?).try_normalize(0.0)?
    };
    (next.dot(axis) > 0.5).then_some(next)
}
