//! Rays against closed forms, and rays that graze, start inside or run along faces.

use crate::common::prelude::*;
use crate::pieces::*;
use crate::queried::{body, state_at, world};
use tumble_core::query::{Query, Ray, RayHit};

/// Error of the end of a ray over a few metres (m). The rounding errors of its terms are 1e-15.
pub const ROUNDING: f64 = 1e-13;

pub fn ray(origin: V, direction: V) -> Ray {
    Ray::new(origin, direction).unwrap()
}

/// Hit of a ray with one body of one piece.
fn cast(piece: Piece, pose: &Pose, ray: &Ray) -> Option<RayHit> {
    let world = world(vec![body(vec![piece])], None, Vec::new());
    Query::new(&world, &[state_at(pose)]).unwrap().cast_ray(ray, |_| true)
}

/// Random ray that begins outside of a ball of radius 3 and points near the origin.
fn aimed(draw: &mut WideDraw) -> Ray {
    let origin = draw.direction() * draw.within(3.0, 6.0);
    let aim = draw.vector(0.8);
    let length = draw.within(0.1, 20.0);
    ray(origin, (aim - origin) * length)
}

#[test]
fn a_ray_meets_a_ball_at_the_root_of_its_quadratic_equation() {
    let mut draw = WideDraw::wide(1);
    let (mut hits, mut misses) = (0, 0);
    for _ in 0..2000 {
        let (radius, pose, ray) = (draw.within(0.1, 0.9), draw.pose(0.3), aimed(&mut draw));
        let from = ray.origin() - pose.position;
        let (half, rest) = (from.dot(ray.direction()), from.norm_squared() - radius * radius);
        let root = half * half - rest;
        let hit = cast(Piece::sphere(radius).unwrap(), &pose, &ray);
        if root < 0.0 {
            assert!(hit.is_none());
            misses += 1;
            continue;
        }
        let hit = hit.unwrap();
        hits += 1;
        // The equation loses digits near its double root.
        let expected = -half - root.sqrt();
        assert!((hit.distance - expected).abs() < 1e-13 / root.sqrt().max(1e-6));
        let outward = (hit.point - pose.position) / radius;
        assert!((hit.normal - outward).norm() < 1e-12 && !hit.inside);
        assert!((hit.point - ray.at(hit.distance)).norm() == 0.0);
    }
    assert!(hits > 300 && misses > 300, "{hits} {misses}");
}

#[test]
fn a_ray_meets_a_box_where_it_has_entered_its_three_slabs() {
    let mut draw = WideDraw::wide(2);
    let (mut hits, mut misses) = (0, 0);
    for _ in 0..2000 {
        let (half, pose, ray) = (draw.half_sides(), draw.pose(0.3), aimed(&mut draw));
        let origin = pose.rotation.tr_mul(&(ray.origin() - pose.position));
        let direction = pose.rotation.tr_mul(ray.direction());
        let slab = |axis: usize| {
            let side = half[axis].copysign(direction[axis]);
            let at = |side: f64| (side - origin[axis]) / direction[axis];
            (at(-side), at(side))
        };
        let slabs = [0, 1, 2].map(slab);
        let entry = slabs.iter().map(|slab| slab.0).fold(f64::NEG_INFINITY, f64::max);
        let exit = slabs.iter().map(|slab| slab.1).fold(f64::INFINITY, f64::min);
        let hit = cast(Piece::cuboid(half).unwrap(), &pose, &ray);
        assert_eq!(hit.is_some(), entry <= exit);
        let Some(hit) = hit else {
            misses += 1;
            continue;
        };
        hits += 1;
        assert!((hit.distance - entry).abs() < ROUNDING, "{} {entry}", hit.distance);
        let face = (0..3).find(|axis| slabs[*axis].0 == entry).unwrap();
        let normal = -pose.rotation.column(face) * direction[face].signum();
        assert!((hit.normal - normal).norm() < 1e-14);
    }
    assert!(hits > 300 && misses > 300, "{hits} {misses}");
}

/// Signed distance of a point from a capsule along z or from a rounded box about the origin.
fn capsule_height(point: &V, half: f64, radius: f64) -> f64 {
    (point - v(0.0, 0.0, point.z.clamp(-half, half))).norm() - radius
}

fn box_height(point: &V, half: &V, radius: f64) -> f64 {
    let outside = point.zip_map(half, |x, half| (x.abs() - half).max(0.0));
    outside.norm() - radius
}

/// Checks a hit by a signed distance that is convex along the ray: it is zero at the hit and
/// nowhere negative before. Without a hit it is nowhere negative.
fn check(ray: &Ray, hit: Option<&RayHit>, height: impl Fn(&V) -> f64) {
    let along = |distance: f64| height(&ray.at(distance));
    let end = hit.map_or(12.0, |hit| hit.distance);
    if let Some(hit) = hit {
        let error = height(&hit.point);
        assert!(error.abs() < ROUNDING, "the hit is {error:e} m off the surface");
        // The surface rises along its normal.
        let rise = height(&(hit.point + hit.normal * 1e-3));
        assert!((rise - 1e-3).abs() < 1e-12, "{rise}");
        assert!(hit.normal.dot(ray.direction()) < 1e-6);
    }
    // The lowest place before the end, by ternary search.
    let (mut low, mut high) = (0.0, end);
    for _ in 0..200 {
        let (one, other) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if along(one) < along(other) {
            high = other;
        } else {
            low = one;
        }
    }
    assert!(along(low) > -ROUNDING, "{:e} m deep before the end", along(low));
}

#[test]
fn rays_end_on_capsules_and_rounded_boxes() {
    let mut draw = WideDraw::wide(3);
    let mut hits = 0;
    for _ in 0..1000 {
        let ray = aimed(&mut draw);
        let (half, radius) = (draw.within(0.1, 0.8), draw.within(0.05, 0.4));
        let pose = draw.pose(0.3);
        let inner = |point: &V| pose.rotation.tr_mul(&(point - pose.position));
        let hit = cast(Piece::capsule(half, radius).unwrap(), &pose, &ray);
        hits += usize::from(hit.is_some());
        check(&ray, hit.as_ref(), |point| capsule_height(&inner(point), half, radius));

        let (sides, radius) = (draw.half_sides(), draw.within(0.01, 0.2));
        let corners = Piece::cuboid(sides).unwrap();
        let rounded = Piece::hull(corners.core().vertices(), radius).unwrap();
        let hit = cast(rounded, &pose, &ray);
        hits += usize::from(hit.is_some());
        check(&ray, hit.as_ref(), |point| box_height(&inner(point), &sides, radius));
    }
    assert!((500..1800).contains(&hits), "{hits}");
}

/// Checks rays that touch round surfaces: the distance to the surface is the given one of 1e-3 m to
/// 1e-12 m, inside or outside.
#[test]
fn rays_that_graze_hit_or_miss_as_their_distance_says() {
    let sides = v(0.3, 0.4, 0.5);
    let rounded = Piece::hull(Piece::cuboid(sides).unwrap().core().vertices(), 0.1).unwrap();
    let shapes = [
        (Piece::sphere(0.4).unwrap(), v(0.4, 0.0, 0.0)),
        (Piece::capsule(0.3, 0.2).unwrap(), v(0.2, 0.0, 0.1)),
        // The middle of a rounded edge along z.
        (rounded, v(0.3, 0.4, 0.0) + v(0.1, 0.1, 0.0) / 2f64.sqrt()),
    ];
    for (piece, point) in &shapes {
        let outward = v(point.x, point.y, 0.0).normalize();
        let outward = if point.y > 0.0 { v(1.0, 1.0, 0.0).normalize() } else { outward };
        let along = outward.cross(&V::z());
        for exponent in 3..=12 {
            let gap = 0.1f64.powi(exponent);
            for (gap, hits) in [(gap, false), (-gap, true)] {
                let ray = ray(point + outward * gap - along * 2.0, along);
                let hit = cast(piece.clone(), &at(0.0, 0.0, 0.0), &ray);
                assert_eq!(hit.is_some(), hits, "{gap:e}");
            }
        }
    }
}

#[test]
fn rays_that_start_inside_hit_at_once_unless_the_object_is_left_out() {
    let pieces = vec![Piece::cuboid(v(0.5, 0.5, 0.5)).unwrap()];
    let wall = Piece::sphere(0.5).unwrap();
    let wall = wall.moved_by(&turn(0.0, 0.0, 0.0), &v(3.0, 0.0, 0.0)).unwrap();
    let world = world(vec![body(pieces)], Some(Plane::level()), vec![wall]);
    let query = Query::new(&world, &[state_at(&at(0.0, 0.0, 1.0))]).unwrap();
    let out = ray(v(0.1, 0.0, 1.0), V::x());
    let hit = query.cast_ray(&out, |_| true).unwrap();
    assert_eq!((hit.owner, hit.distance, hit.inside), (Partner::Body(0), 0.0, true));
    assert_eq!((hit.point, hit.normal), (*out.origin(), -V::x()));
    // The wall's ball is 1 m higher than the ray's line is.
    assert!(query.cast_ray(&out, |of| of != Partner::Body(0)).is_none());
    let down = ray(v(0.1, 0.0, 1.0), -V::z());
    let hit = query.cast_ray(&down, |of| of != Partner::Body(0)).unwrap();
    assert_eq!((hit.owner, hit.distance, hit.normal), (Partner::Ground, 1.0, V::z()));
    let below = ray(v(0.0, 0.0, -1.0), V::z());
    let all = query.cast_ray_all(&below, |_| true);
    assert_eq!(
        all.iter().map(|hit| hit.owner).collect::<Vec<_>>(),
        [Partner::Ground, Partner::Body(0)]
    );
    assert!(all[0].inside && all[0].distance == 0.0 && all[1].distance == 1.5);
    // A round piece, and one of each other kind.
    for piece in [
        Piece::sphere(0.4).unwrap(),
        Piece::capsule(0.3, 0.2).unwrap(),
        Piece::hull(Piece::cuboid(v(0.3, 0.3, 0.3)).unwrap().core().vertices(), 0.1).unwrap(),
    ] {
        let hit = cast(piece, &at(0.0, 0.0, 0.0), &ray(v(0.1, 0.0, 0.1), V::y())).unwrap();
        assert!(hit.inside && hit.distance == 0.0);
    }
}

#[test]
fn rays_along_faces_and_through_corners() {
    let half = v(0.5, 0.5, 0.5);
    let cube = || Piece::cuboid(half).unwrap();
    let origin = at(0.0, 0.0, 0.0);
    // In the plane of a face and along an edge: the solid is closed.
    for start in [v(-2.0, 0.0, 0.5), v(-2.0, 0.5, 0.5), v(-2.0, -0.5, 0.5)] {
        let hit = cast(cube(), &origin, &ray(start, V::x())).unwrap();
        assert_eq!((hit.distance, hit.normal), (1.5, -V::x()));
    }
    assert!(cast(cube(), &origin, &ray(v(-2.0, 0.0, 0.5 + 1e-12), V::x())).is_none());
    // Onto a corner, along the diagonal.
    let hit = cast(cube(), &origin, &ray(v(2.0, 2.0, 2.0), v(-1.0, -1.0, -1.0))).unwrap();
    assert!((hit.point - half).norm() < 1e-15);
    // From a face outwards: touching counts.
    let hit = cast(cube(), &origin, &ray(v(0.5, 0.0, 0.0), V::x())).unwrap();
    assert!(hit.inside && hit.distance == 0.0);
    // Along the axis of a capsule.
    let capsule = Piece::capsule(0.5, 0.2).unwrap();
    let hit = cast(capsule, &origin, &ray(v(0.0, 0.0, 3.0), -V::z())).unwrap();
    assert!((hit.distance - 2.3).abs() < 1e-15 && hit.normal == V::z());
    // Away from everything, and along the ground.
    let ground = world(vec![body(vec![cube()])], Some(Plane::level()), Vec::new());
    let query = Query::new(&ground, &[state_at(&at(0.0, 0.0, 5.0))]).unwrap();
    assert!(query.cast_ray(&ray(v(2.0, 0.0, 1.0), V::x()), |_| true).is_none());
    assert!(query.cast_ray(&ray(v(2.0, 0.0, 1.0), V::z()), |_| true).is_none());
}

#[test]
fn bodies_of_points_are_never_hit() {
    let points = [v(0.1, 0.0, 0.0), v(-0.1, 0.0, 0.0)];
    let inertia = Matrix3::identity() * 0.01;
    let dots = RigidBody::new(1.0, inertia, &points).unwrap();
    let world = world(vec![dots], None, Vec::new());
    let query = Query::new(&world, &[state_at(&at(0.0, 0.0, 0.0))]).unwrap();
    assert!(query.cast_ray(&ray(v(0.1, 0.0, 3.0), -V::z()), |_| true).is_none());
    assert!(query.cast_ray_all(&ray(V::zeros(), V::x()), |_| true).is_empty());
}

#[test]
fn a_direction_of_any_length_is_accepted_and_none_is_refused() {
    for size in [1e-300, 1e-9, 1.0, 1e300] {
        let ray = ray(V::zeros(), v(3.0, 0.0, -4.0) * size);
        assert!((ray.direction() - v(0.6, 0.0, -0.8)).norm() < 1e-15, "{size:e}");
    }
    let refused = |origin: V, direction: V| match Ray::new(origin, direction) {
        Err(error @ Error::OutOfRange { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    };
    let zero = refused(V::zeros(), V::zeros());
    assert_eq!(zero, "direction of the ray is 0.0; allowed: finite numbers that are not all 0");
    refused(V::zeros(), v(0.0, f64::NAN, 1.0));
    refused(V::zeros(), v(0.0, f64::INFINITY, 1.0));
    refused(v(f64::NAN, 0.0, 0.0), V::x());
    refused(v(1e7, 0.0, 0.0), V::x());
    let ray = ray(V::zeros(), V::x());
    assert!(ray.up_to(-1.0).is_err() && ray.up_to(f64::NAN).is_err());
    assert!(ray.up_to(f64::INFINITY).is_ok() && ray.up_to(0.0).is_ok());
}
