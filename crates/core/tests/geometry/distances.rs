//! Distances, closest points, overlaps and near pairs against closed forms and all pairs.

use crate::common::prelude::*;
use crate::pieces::*;
use crate::queried::{Queried, body, random, state_at, world};
use tumble_core::query::{Distance, Query};

/// Error of a distance of a few metres (m); the closest points of nearly parallel edges lose some
/// digits.
const ROUNDING: f64 = 1e-12;

/// Distance of two bodies of one piece each.
fn between(a: (Piece, Pose), b: (Piece, Pose)) -> Distance {
    let world = world(vec![body(vec![a.0]), body(vec![b.0])], None, Vec::new());
    let states = [state_at(&a.1), state_at(&b.1)];
    let query = Query::new(&world, &states).unwrap();
    query.distance(Partner::Body(0), Partner::Body(1)).unwrap()
}

#[test]
fn closest_points_of_simple_pairs() {
    let ball = |radius: f64| Piece::sphere(radius).unwrap();
    let apart = between((ball(0.5), at(0.0, 0.0, 0.0)), (ball(0.2), at(2.0, 0.0, 0.0)));
    assert!((apart.distance - 1.3).abs() < 1e-15 && apart.normal == V::x());
    assert_eq!(apart.points, [v(0.5, 0.0, 0.0), v(1.8, 0.0, 0.0)]);
    let deep = between((ball(0.5), at(0.0, 0.0, 0.0)), (ball(0.2), at(0.6, 0.0, 0.0)));
    assert!((deep.distance + 0.1).abs() < 1e-15);
    assert!((deep.points[0] - v(0.5, 0.0, 0.0)).norm() < 1e-15);
    assert!((deep.points[1] - v(0.4, 0.0, 0.0)).norm() < 1e-15);
    // A corner over a face, 0.25 m above it.
    let cube = || Piece::cuboid(v(0.5, 0.5, 0.5)).unwrap();
    let tilted = Pose { position: v(0.1, 0.2, 0.0), rotation: turn(0.9, 0.3, 0.1) };
    let lowest = support(&cube(), &tilted, &-V::z()).1;
    let tilted = Pose { position: tilted.position + V::z() * (0.75 + lowest), ..tilted };
    let over = between((cube(), at(0.0, 0.0, 0.0)), (cube(), tilted));
    assert!((over.distance - 0.25).abs() < 1e-14 && (over.normal - V::z()).norm() < 1e-14);
    let corner = support(&cube(), &tilted, &-V::z()).0;
    assert!((over.points[1] - corner).norm() < 1e-14);
    assert!((over.points[0] - (corner - V::z() * 0.25)).norm() < 1e-14);
    // Two edges that cross.
    let ridge = |angle: f64, height: f64| Pose {
        position: V::z() * height,
        rotation: turn(0.0, 0.0, angle) * turn(std::f64::consts::FRAC_PI_4, 0.0, 0.0),
    };
    let half = 0.5f64.sqrt();
    for gap in [0.3, -0.1] {
        let crossed = between((cube(), ridge(0.0, 0.0)), (cube(), ridge(1.5, 2.0 * half + gap)));
        assert!((crossed.distance - gap).abs() < 1e-14, "{}", crossed.distance);
        assert!((crossed.points[0] - V::z() * half).norm() < 1e-14);
        assert!((crossed.points[1] - V::z() * (half + gap)).norm() < 1e-14);
    }
}

/// Checks that the closest points are on the surfaces, that the line between them is the normal, and
/// that the second object leaves the first along it.
#[test]
fn closest_points_are_on_the_surfaces_and_measure_the_distance() {
    let mut draw = WideDraw::wide(6);
    let (mut overlaps, mut gaps) = (0, 0);
    for _ in 0..1500 {
        let (a, b) = ((draw.piece(), draw.pose(0.6)), (draw.piece(), draw.pose(0.6)));
        let found = between(a.clone(), b.clone());
        let expected = separate((&a.0, &a.1), (&b.0, &b.1));
        assert!((found.distance - expected.distance).abs() < ROUNDING);
        let along = found.points[1] - found.points[0];
        assert!((along - found.normal * found.distance).norm() < ROUNDING);
        // Two bodies whose poses went through quaternions.
        let surfaces = [&a, &b].into_iter().zip(&found.points);
        let cores_meet = found.distance < -(a.0.radius() + b.0.radius()) + 1e-6;
        let flat = a.0.core().faces().is_empty() && b.0.core().faces().is_empty();
        for ((piece, pose), point) in surfaces {
            let ball = Piece::sphere(1e-6).unwrap();
            let height = separate((piece, pose), (&ball, &at(point.x, point.y, point.z)));
            let height = height.distance + 1e-6;
            // The surface of a rounded core is not reached where the cores themselves overlap.
            assert!(height.abs() < 1e-9 || (cores_meet && flat), "{height:e} m off the surface");
        }
        let (overlap, gap) = (found.distance < 0.0, found.distance > 0.0);
        (overlaps, gaps) = (overlaps + usize::from(overlap), gaps + usize::from(gap));
        let clear = found.normal * (1e-6 - found.distance);
        let moved = Pose { position: b.1.position + clear, ..b.1 };
        let rest = separate((&a.0, &a.1), (&b.0, &moved)).distance;
        assert!(rest > 0.0 && rest < 1.01e-6, "{rest:e}");
    }
    assert!(overlaps > 300 && gaps > 300, "{overlaps} {gaps}");
}

#[test]
fn distances_of_objects_are_those_of_their_nearest_pieces() {
    let mut draw = WideDraw::wide(7);
    for _ in 0..60 {
        let queried = random(&mut draw, 4, 2, 1.5);
        let query = Query::new(&queried.world, &queried.states).unwrap();
        let mut all = queried.solids();
        all.push(Partner::Ground);
        for &one in &all {
            for &other in all.iter().filter(|other| **other != one) {
                let found = query.distance(one, other).unwrap();
                let (solid, rest) =
                    if one == Partner::Ground { (other, one) } else { (one, other) };
                let each = queried.pieces(solid);
                let each = each.iter().map(|(piece, pose)| queried.distance(piece, pose, rest));
                let expected = each.fold(f64::INFINITY, f64::min);
                assert!((found.distance - expected).abs() < ROUNDING, "{one}, {other}");
                let back = query.distance(other, one).unwrap();
                assert!((back.distance - found.distance).abs() < ROUNDING);
                if found.distance > 1e-6 {
                    assert!((back.normal + found.normal).norm() < 1e-6);
                }
            }
        }
    }
}

#[test]
fn objects_without_a_distance_are_refused_with_a_reason() {
    let ball = || body(vec![Piece::sphere(0.1).unwrap()]);
    let dots = RigidBody::new(1.0, Matrix3::identity(), &[V::x(), V::y()]).unwrap();
    let free = world(vec![ball(), dots], None, Vec::new());
    let states = [state_at(&at(0.0, 0.0, 0.0)); 2];
    let query = Query::new(&free, &states).unwrap();
    let refused = |one, other| query.distance(one, other).unwrap_err().to_string();
    let body = Partner::Body;
    assert!(refused(body(0), body(0)).contains("both objects are the same"));
    assert!(refused(body(0), body(1)).contains("points without volume"));
    assert!(refused(body(0), Partner::Ground).contains("there is no ground"));
    assert!(refused(body(0), body(2)).contains("body: 2 given"));
    assert!(refused(Partner::Fixed(0), body(0)).contains("fixed piece: 0 given"));
}

/// Distances to all objects near `piece`, over all pairs.
fn near(queried: &Queried, piece: &Piece, pose: &Pose, within: f64) -> Vec<Partner> {
    let mut all = queried.solids();
    all.push(Partner::Ground);
    all.sort_unstable();
    all.retain(|of| queried.distance(piece, pose, *of) <= within);
    all
}

#[test]
fn regions_find_what_overlaps_them() {
    let mut draw = WideDraw::wide(8);
    let mut found = 0;
    for round in 0..150 {
        let queried = random(&mut draw, 1 + round % 20, round % 5, 2.0);
        let query = Query::new(&queried.world, &queried.states).unwrap();
        let (piece, pose) = (draw.piece(), draw.pose(2.5));
        for within in [0.0, 0.3, 2.0] {
            let all = query.near(&piece, &pose, within, |_| true).unwrap();
            let owners: Vec<_> = all.iter().map(|near| near.owner).collect();
            assert_eq!(owners, near(&queried, &piece, &pose, within));
            for near in &all {
                let expected = queried.distance(&piece, &pose, near.owner);
                assert!((near.distance - expected).abs() < ROUNDING);
            }
            found += all.len();
        }
        let overlaps = query.overlaps(&piece, &pose, |_| true).unwrap();
        assert_eq!(overlaps, query.near(&piece, &pose, 0.0, |_| true).unwrap());
        let fixed = |of| matches!(of, Partner::Fixed(_));
        let only = query.near(&piece, &pose, 2.0, fixed).unwrap();
        assert!(only.iter().all(|near| fixed(near.owner)));
    }
    assert!(found > 500, "{found}");
    let queried = random(&mut draw, 1, 0, 1.0);
    let query = Query::new(&queried.world, &queried.states).unwrap();
    let (piece, pose) = (Piece::sphere(1.0).unwrap(), at(0.0, 0.0, 0.0));
    for within in [-1.0, f64::NAN, f64::INFINITY] {
        assert!(query.near(&piece, &pose, within, |_| true).is_err());
        assert!(query.pairs_within(within, |_, _| true).is_err());
    }
    let nowhere = Pose { position: v(f64::NAN, 0.0, 0.0), ..pose };
    let mirror = Pose { rotation: -Matrix3::identity(), ..pose };
    let nothing = Pose { rotation: Matrix3::from_element(f64::NAN), ..pose };
    for odd in [nowhere, mirror, nothing] {
        assert!(query.overlaps(&piece, &odd, |_| true).is_err());
    }
}

#[test]
fn pairs_within_a_distance_are_those_of_all_pairs() {
    let mut draw = WideDraw::wide(9);
    let mut count = 0;
    for round in 0..60 {
        let queried = random(&mut draw, 1 + round % 12, round % 4, 2.0);
        let reversed = queried.reversed();
        let query = Query::new(&queried.world, &queried.states).unwrap();
        let other = Query::new(&reversed.world, &reversed.states).unwrap();
        for within in [0.0, 0.2, 3.0] {
            let found = query.pairs_within(within, |_, _| true).unwrap();
            let mut expected = Vec::new();
            for body in 0..queried.states.len() {
                let pieces = queried.pieces(Partner::Body(body));
                let mut partners = queried.solids();
                partners.push(Partner::Ground);
                partners.sort_unstable();
                for partner in partners.into_iter().filter(|p| p.body().is_none_or(|b| b > body)) {
                    let each = pieces.iter().map(|(p, pose)| queried.distance(p, pose, partner));
                    let distance = each.fold(f64::INFINITY, f64::min);
                    if distance <= within {
                        expected.push((body, partner, distance));
                    }
                }
            }
            assert_eq!(found.len(), expected.len());
            for (pair, (body, partner, distance)) in found.iter().zip(&expected) {
                assert_eq!((pair.body, pair.partner), (*body, *partner));
                assert!((pair.distance - distance).abs() < ROUNDING);
            }
            count += found.len();
            let turned = other.pairs_within(within, |_, _| true).unwrap();
            assert_eq!(turned.len(), found.len());
            let fixed = query.pairs_within(within, |_, of| matches!(of, Partner::Fixed(_)));
            assert!(fixed.unwrap().iter().all(|pair| matches!(pair.partner, Partner::Fixed(_))));
        }
    }
    assert!(count > 500, "{count}");
}

#[test]
fn excluded_pairs_can_be_left_out() {
    let ball = || body(vec![Piece::sphere(0.1).unwrap()]);
    let world = world(vec![ball(), ball()], Some(Plane::level()), Vec::new());
    let world = world.with_apart(0, Partner::Body(1)).unwrap();
    let states = [state_at(&at(0.0, 0.0, 0.1)), state_at(&at(0.25, 0.0, 0.2))];
    let query = Query::new(&world, &states).unwrap();
    assert_eq!(query.pairs_within(0.2, |_, _| true).unwrap().len(), 3);
    let touching = query.pairs_within(0.2, |body, of| world.may_touch(body, of)).unwrap();
    assert!(touching.iter().all(|pair| pair.partner == Partner::Ground) && touching.len() == 2);
}

/// The ground is touched by smooth shapes themselves, so distances to it are those of their surfaces:
/// φ = n·r − d − (h |cos θ| + R sin θ) for a cylinder whose axis is tilted by θ.
#[test]
fn the_ground_is_as_far_as_the_surface_of_a_smooth_shape() {
    let (half, radius) = (0.3, 0.2);
    for number in 0..30 {
        let tilt = 0.1 * f64::from(number);
        let rotation = turn(tilt, 0.0, 0.0) * turn(0.0, 0.0, 0.37);
        let cylinder = Piece::cylinder(half, radius, 12).unwrap();
        let ellipsoid = Piece::ellipsoid(v(0.1, 0.2, 0.3), 12).unwrap();
        let up = rotation.tr_mul(&V::z());
        let extents = [
            half * tilt.cos().abs() + radius * tilt.sin().abs(),
            v(0.1, 0.2, 0.3).component_mul(&up).norm(),
        ];
        for (piece, extent) in [cylinder, ellipsoid].into_iter().zip(extents) {
            let world = world(vec![body(vec![piece])], Some(Plane::level()), Vec::new());
            let pose = Pose { position: v(1.0, -2.0, 2.0), rotation };
            let states = [state_at(&pose)];
            let found = Query::new(&world, &states).unwrap();
            let found = found.distance(Partner::Body(0), Partner::Ground).unwrap();
            assert!(
                (found.distance - (2.0 - extent)).abs() < ROUNDING,
                "{tilt}: {}",
                found.distance
            );
            assert!((found.points[0].z - found.distance).abs() < ROUNDING);
        }
    }
}
