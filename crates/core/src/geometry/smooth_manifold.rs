//! Contact points of two pieces, at least one with a smooth shape.
//!
//! The features that are farthest along the [axis](super::smooth_axis) touch:
//!
//! | features | contact |
//! |---|---|
//! | ellipsoid or rim, and a face | the nearest point of each ellipsoid against the plane of the face |
//! | flat end | the corners of the core's end, as for polyhedra |
//! | lateral surface of a cylinder, and an edge, a vertex or another lateral surface | gap in closed form from the axis of the cylinder |
//! | ellipsoid or rim, and any other feature | the ellipsoid against the tangent plane of the other piece |
//! | lateral surface of a cone, and an edge or a vertex | the place where they cross against the tangent plane of the cone |

use super::features::{CorePart, Feature, PieceSide};
use super::hull::Corner;
use super::manifold_pair::{MERGE, ManifoldPair};
use super::segment::closest_segment_parameters;
use super::separating_axis::{AxisSource, SeparatingAxis};
use super::smooth_side::{SmoothSide, SupportFeature};
use super::touch::ManifoldPoint;
use nalgebra::Vector3;

/// Sine of the angle below which a cylinder is nearly parallel to a face.
const NEARLY_PARALLEL: f64 = 0.03;
/// Sine of the angle below which two straight features touch at both ends of their common part.
/// Beyond it they cross. At this angle, the ends are off by 2 × 10⁻⁶ of the radius.
pub(super) const PARALLEL: f64 = 2e-3;
/// Fraction of a straight feature up to which a place on it is its end.
const AT_END: f64 = 1e-7;

/// Adds the contact points of two pieces with the `axis` of separation (unit, frame of A).
pub(super) fn smooth_manifold(mut found: ManifoldPair<'_, '_>, axis: &Vector3<f64>) {
    let pair = found.pair;
    let [a, b] = pair.sides();
    let normals = [*axis, -b.to_local(axis)];
    let faces = [a.face_across(&normals[0]), b.face_across(&normals[1])];
    if let Some(face) = faces[0] {
        on_face(&mut found, &b, &a, face);
    }
    if let Some(face) = faces[1] {
        on_face(&mut found, &a, &b, face);
    }
    let ends = [(&a, faces[0]), (&b, faces[1])];
    if ends.iter().any(|(side, face)| side.smooth.is_some() && face.is_some()) {
        let kind = match faces {
            [_, Some(face)] => AxisSource::FaceB(face),
            [face, None] => AxisSource::FaceA(face.unwrap_or(0)),
        };
        let gap = pair.gap_along(axis);
        found.faces(&SeparatingAxis { kind, normal: *axis, gap, exact: true });
    }
    // A face that is nearly across need not have the deepest point.
    let deepest = pair.gap_along(axis) - pair.radii() + MERGE * pair.size();
    let has_deepest = |found: &ManifoldPair<'_, '_>| found.out.iter().any(|at| at.gap <= deepest);
    if has_deepest(&found) {
        return;
    }
    let features = [a.support(&normals[0]), b.support(&normals[1])];
    match (
        Straight::from_feature(&a, features[0], &normals[0]),
        Straight::from_feature(&b, features[1], &normals[1]),
    ) {
        (Some(u), Some(v)) if u.is_cone || v.is_cone => {
            // A ball or a capsule rolls on the tangent plane of the cone.
            let is_plane_of_a = match (u.radius > 0.0, v.radius > 0.0) {
                (true, _) => false,
                (_, true) => true,
                _ => found.plane_of == PieceSide::A,
            };
            let (point, plane) = if is_plane_of_a { (&v, &u) } else { (&u, &v) };
            point.cross(plane, (point.whole, plane.whole), Some(axis), &mut found);
        }
        (Some(u), Some(v)) if u.radius + v.radius > 0.0 => u.touch(&v, &mut found),
        _ => tangent(&mut found, [&a, &b], features, &normals),
    }
}

/// Adds the contacts of a smooth shape with the flat face `face` of the piece on `side`.
pub(super) fn on_flat_face(found: &mut ManifoldPair<'_, '_>, side: PieceSide, face: usize) {
    let [a, b] = found.pair.sides();
    match side {
        PieceSide::A => on_face(found, &b, &a, face),
        PieceSide::B => on_face(found, &a, &b, face),
    }
}

/// Adds the contacts of the smooth shape of `on`, if it has one, with a face of the other piece.
fn on_face(
    found: &mut ManifoldPair<'_, '_>,
    on: &SmoothSide<'_>,
    of: &SmoothSide<'_>,
    face: usize,
) {
    let Some(smooth) = on.smooth else { return };
    // A rim and the border of a face may lie in one plane.
    let border = MERGE * found.pair.size();
    let plane = of.hull.faces()[face];
    let normal = on.to_local(&(of.rotation * plane.normal));
    let in_face = |point: &Vector3<f64>| of.to_local(&(on.placed(point) - of.shift));
    let mut push = |feature: Feature, point: Vector3<f64>| {
        let local = in_face(&point);
        if of.hull.is_over(face, &local, border) {
            found.push_new(ManifoldPoint {
                point_of: on.side,
                point,
                point_radius: 0.0,
                normal: plane.normal,
                offset: plane.offset + of.radius,
                gap: plane.normal.dot(&local) - plane.offset - of.radius,
                feature,
            });
        }
    };
    // Lowest points of ellipsoids and discs, the apex of a cone, and lateral surfaces along the face
    for (one, index) in smooth.ellipsoids().iter().zip(0..) {
        if !one.is_across(&normal) {
            push(Feature::Ellipsoid(on.side, index), one.centre - one.farthest(&normal));
        }
    }
    if let Some((vertex, apex)) = smooth.apex() {
        push(Feature::Vertex(on.side, vertex), apex);
    }
    if let Some(line) = Straight::from_feature(on, SupportFeature::Lateral, &normal) {
        let height = line.along.dot(&(of.rotation * plane.normal));
        if height.abs() < NEARLY_PARALLEL * line.along.norm() {
            over_sides(found, &line, of, face);
        }
    }
}

/// Adds the contacts where the lateral surface of a cylinder crosses the sides of a face.
fn over_sides(found: &mut ManifoldPair<'_, '_>, line: &Straight, of: &SmoothSide<'_>, face: usize) {
    let from = of.to_local(&(line.from - of.shift));
    let along = of.to_local(&line.along);
    let normal = of.hull.faces()[face].normal;
    let corners = of.hull.face_loop(face);
    let at = |corner: &Corner| of.hull.vertices()[corner.vertex as usize];
    // Part of the axis inside the sides, and the edges that bound it.
    let (mut low, mut high) = ((AT_END, None), (1.0 - AT_END, None));
    for (corner, next) in corners.iter().zip(corners.iter().cycle().skip(1)) {
        let inward = normal.cross(&(at(next) - at(corner)));
        let height = inward.dot(&(from - at(corner)));
        let rate = inward.dot(&along);
        let share = -height / rate;
        let edge = Some(corner.edge);
        if rate > 0.0 && share > low.0 {
            low = (share, edge);
        } else if rate < 0.0 && share < high.0 {
            high = (share, edge);
        } else if rate == 0.0 && height < 0.0 {
            return;
        }
    }
    if low.0 >= high.0 {
        return;
    }
    for edge in [low.1, high.1].into_iter().flatten() {
        if let Some(edge) = Straight::from_feature(of, SupportFeature::Edge(edge), &normal) {
            line.cross(&edge, (line.whole, edge.whole), None, found);
        }
    }
}

/// Adds the contact of an ellipsoid or a vertex with the tangent plane of the other piece.
fn tangent(
    found: &mut ManifoldPair<'_, '_>,
    sides: [&SmoothSide<'_>; 2],
    features: [SupportFeature; 2],
    normals: &[Vector3<f64>; 2],
) {
    let touching = |at: usize| {
        let (side, n) = (sides[at], &normals[at]);
        match features[at] {
            SupportFeature::Ellipsoid(index) => {
                let one = side.ellipsoid(index)?;
                Some((at, Feature::Ellipsoid(side.side, index), one.centre + one.farthest(n)))
            }
            SupportFeature::Vertex(vertex) => {
                let point = side.hull.vertices()[vertex as usize];
                Some((at, Feature::Vertex(side.side, vertex), point))
            }
            _ => None,
        }
    };
    // Ellipsoids first. Of two, the one whose piece does not own the plane.
    let is_ellipsoid = |at: &usize| matches!(features[*at], SupportFeature::Ellipsoid(_));
    let order = if found.plane_of == PieceSide::A { [1, 0] } else { [0, 1] };
    let of_ellipsoid = order.into_iter().filter(is_ellipsoid).find_map(touching);
    let Some((on, feature, point)) = of_ellipsoid.or_else(|| order.into_iter().find_map(touching))
    else {
        return;
    };
    let side = sides[on];
    let other = sides[1 - on];
    let normal = normals[1 - on];
    let point_radius = if side.smooth.is_some() { 0.0 } else { side.radius };
    let offset = other.extent(&normal);
    let height = normal.dot(&other.to_local(&(side.placed(&point) - other.shift)));
    let gap = height - offset - point_radius;
    let point_of = side.side;
    found.push_new(ManifoldPoint { point_of, point, point_radius, normal, offset, gap, feature });
}

/// A straight feature with a radius, in the frame of A: a vertex, an edge, the axis of a cylinder or
/// the line of a cone that touches.
#[derive(Debug, Clone, Copy)]
struct Straight {
    side: PieceSide,
    whole: CorePart,
    ends: [CorePart; 2],
    from: Vector3<f64>,
    along: Vector3<f64>,
    radius: f64,
    is_cone: bool,
}

impl Straight {
    /// Straight feature of a piece that is farthest along the unit vector `n` (own frame).
    fn from_feature(
        side: &SmoothSide<'_>,
        feature: SupportFeature,
        n: &Vector3<f64>,
    ) -> Option<Self> {
        let (whole, ends) = match feature {
            SupportFeature::Lateral | SupportFeature::Cone => {
                (CorePart::Lateral, [CorePart::End(0), CorePart::End(1)])
            }
            SupportFeature::Edge(edge) => {
                let ends = side.hull.edges()[edge as usize].vertices;
                (CorePart::Edge(edge), ends.map(CorePart::Vertex))
            }
            SupportFeature::Vertex(vertex) => {
                let part = CorePart::Vertex(vertex);
                (part, [part; 2])
            }
            SupportFeature::Ellipsoid(_) | SupportFeature::Face => return None,
        };
        let (at, radius) = side.ends(feature, n)?;
        let [from, to] = at.map(|point| side.placed(&point));
        let is_cone = feature == SupportFeature::Cone;
        Some(Self { side: side.side, whole, ends, from, along: to - from, radius, is_cone })
    }

    /// Adds the contacts with a straight feature of the other piece: one, or the ends of the common
    /// part of parallel features.
    fn touch(&self, other: &Self, found: &mut ManifoldPair<'_, '_>) {
        let (u, v) = (&self.along, &other.along);
        let is_parallel = u.cross(v).norm() <= PARALLEL * u.norm() * v.norm();
        if !is_parallel || *u == Vector3::zeros() || *v == Vector3::zeros() {
            return self.cross(other, (self.whole, other.whole), None, found);
        }
        let share_on = |line: &Self, point: &Vector3<f64>| {
            line.along.dot(&(point - line.from)) / line.along.norm_squared()
        };
        // Ends of both at one place are taken from this feature.
        for at in [0, 1] {
            let share = share_on(other, &(self.from + self.along * at as f64));
            if (-AT_END..=1.0 + AT_END).contains(&share) {
                self.cross(other, (self.ends[at], other.whole), None, found);
            }
            let share = share_on(self, &(other.from + other.along * at as f64));
            if share > AT_END && share < 1.0 - AT_END {
                self.cross(other, (self.whole, other.ends[at]), None, found);
            }
        }
    }

    /// Adds the contact of two parts. The normal is along the shortest line between them, or along
    /// the `axis` of separation (unit, frame of A, from A to B).
    fn cross(
        &self,
        other: &Self,
        parts: (CorePart, CorePart),
        axis: Option<&Vector3<f64>>,
        found: &mut ManifoldPair<'_, '_>,
    ) {
        let part = |line: &Self, part: CorePart| {
            let end = line.ends.iter().position(|&end| end == part && line.whole != part);
            match end {
                Some(end) => (line.from + line.along * end as f64, Vector3::zeros()),
                None => (line.from, line.along),
            }
        };
        let ((p, u), (q, v)) = (part(self, parts.0), part(other, parts.1));
        let (s, t) = closest_segment_parameters(&p, &u, &q, &v);
        let (point, foot) = (p + u * s, q + v * t);
        let offset_vector = foot - point;
        let [a, b] = found.pair.sides();
        let (of_point, of_plane, feature, sign) = match self.side {
            PieceSide::A => (a, b, Feature::Round(parts.0, parts.1), 1.0),
            PieceSide::B => (b, a, Feature::Round(parts.1, parts.0), -1.0),
        };
        let normal = axis.map(|axis| axis * sign).or_else(|| offset_vector.try_normalize(0.0));
        let Some(normal) = normal else { return };
        let away = of_plane.to_local(&-normal);
        found.push_new(ManifoldPoint {
            point_of: self.side,
            point: of_point.to_local(&(point - of_point.shift)),
            point_radius: self.radius,
            normal: away,
            offset: away.dot(&of_plane.to_local(&(foot - of_plane.shift))) + other.radius,
            gap: normal.dot(&offset_vector) - self.radius - other.radius,
            feature,
        });
    }
}
