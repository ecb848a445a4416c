//! Separation and contact points of two pieces. They are compared with slow independent methods,
//! and checked for the properties that a simulation needs: complete, steady under drifts, and
//! equivariant under rotation and swapping.

use crate::common::prelude::*;
use crate::pieces::*;
use std::collections::BTreeSet;
use tumble_core::geometry::{
    CorePart, Feature, Hint, ManifoldPoint, PairScratch, PieceSide, overlap,
};

fn features(touches: &[ManifoldPoint]) -> BTreeSet<Feature> {
    touches.iter().map(|touch| touch.feature).collect()
}

/// Two pieces at poses with the separation `gap` [m] along their own axis.
fn near_pair(draw: &mut WideDraw, gap: f64) -> (Piece, Pose, Piece, Pose) {
    let (a, b) = (draw.piece(), draw.piece());
    let (pose_a, mut pose_b) = (draw.pose(1.0), draw.pose(1.0));
    pose_b.position += draw.direction() * 3.0;
    let found = separate((&a, &pose_a), (&b, &pose_b));
    pose_b.position -= found.axis * (found.distance - gap);
    (a, pose_a, b, pose_b)
}

/// Checks the separation from both sides. Along its axis the pieces are as far apart as the result
/// says, and along no random direction farther. The method of Frank and Wolfe bounds it from both
/// sides.
#[test]
fn the_separation_is_that_of_independent_methods() {
    let mut draw = WideDraw::wide(1);
    let (mut apart, mut overlapping, mut loosest) = (0, 0, 0.0f64);
    for _ in 0..400 {
        let (a, b) = (draw.piece(), draw.piece());
        let (pose_a, pose_b) = (draw.pose(0.6), draw.pose(0.6));
        let (a, b) = ((&a, &pose_a), (&b, &pose_b));
        let found = separate(a, b);
        let cores_overlap = found.distance + a.0.radius() + b.0.radius() < 1e-9;
        let no_faces = a.0.core().faces().is_empty() && b.0.core().faces().is_empty();
        assert!((found.axis.norm() - 1.0).abs() < 1e-12);
        let along = gap_along(a, b, &found.axis);
        assert!((along - found.distance).abs() < 1e-12, "{along} {}", found.distance);
        if cores_overlap && !no_faces {
            // The best of many directions, improved step by step, approaches the result and never
            // exceeds it.
            overlapping += 1;
            let mut best = (found.axis, f64::NEG_INFINITY);
            for _ in 0..300 {
                let axis = draw.direction();
                best =
                    Some((axis, gap_along(a, b, &axis))).filter(|x| x.1 > best.1).unwrap_or(best);
            }
            let mut width = 0.3;
            for _ in 0..3000 {
                let axis = (best.0 + draw.direction() * width).normalize();
                let gap = gap_along(a, b, &axis);
                if gap > best.1 {
                    best = (axis, gap);
                } else {
                    width = (width * 0.99).max(1e-9);
                }
            }
            assert!(best.1 <= found.distance + 1e-12, "{} above {}", best.1, found.distance);
        } else {
            apart += 1;
            let (below, above) = distance_bounds(a, b, 3000);
            assert!(found.distance <= above + 1e-12, "{} {above}", found.distance);
            assert!(found.distance >= below - 1e-12, "{} {below}", found.distance);
            loosest = loosest.max(above - below);
        }
    }
    assert!(apart > 100 && overlapping > 50, "{apart} {overlapping}");
    assert!(loosest < 0.02, "the bounds are {loosest} m apart");
}

/// Checks that the depth of an overlap is the least translation that separates the boxes.
#[test]
fn overlapping_boxes_leave_each_other_by_the_least_translation() {
    let mut draw = WideDraw::wide(2);
    for _ in 0..300 {
        let (a, b) = (draw.centred_piece(), draw.centred_piece());
        let (mut pose_a, mut pose_b) = (draw.pose(0.05), draw.pose(0.05));
        pose_a.position -= pose_a.rotation * a.core().centre();
        pose_b.position -= pose_b.rotation * b.core().centre();
        let found = separate((&a, &pose_a), (&b, &pose_b));
        assert!(found.distance < 0.0);
        let mut scratch = PairScratch::default();
        let depth = overlap((&a, &pose_a), (&b, &pose_b), &mut Hint::default(), &mut scratch);
        assert_eq!(depth, -found.distance);
        for (shift, left) in [(1.0 + 1e-9, false), (1.0 - 1e-6, true)] {
            let position = pose_b.position + found.axis * (depth * shift);
            let moved = Pose { position, ..pose_b };
            let rest = overlap((&a, &pose_a), (&b, &moved), &mut Hint::default(), &mut scratch);
            assert_eq!(rest > 0.0, left, "{rest} of {depth}");
        }
    }
}

/// Checks the touches of random pairs. The smallest gap of the points is the separation. All points
/// satisfy their definition, and no two are the same.
#[test]
fn manifolds_of_random_pairs_satisfy_their_definition() {
    let mut draw = WideDraw::wide(3);
    for round in 0..3000 {
        let gap = [0.0, 1e-4, -1e-4, 1e-10, -1e-10][round % 5];
        let (a, pose_a, b, pose_b) = near_pair(&mut draw, gap);
        let (a, b) = ((&a, &pose_a), (&b, &pose_b));
        // Where two sharp features meet, the shortest separating translation is not the reversed
        // approach.
        let actual = separate(a, b).distance;
        assert!(actual.abs() <= gap.abs() + 1e-12, "round {round}: {actual:e} {gap:e}");
        let gap = actual;
        let (bound, found) = touches(a, b, 1e-3);
        let lowest = found.iter().map(|touch| touch.gap).fold(f64::INFINITY, f64::min);
        assert!((lowest - gap).abs() < 1e-7, "round {round}: {lowest:e} for {gap:e}");
        assert!(bound <= gap + 1e-12, "round {round}: {bound:e} for {gap:e}");
        for touch in &found {
            check_touch(touch, a, b);
        }
        assert_eq!(features(&found).len(), found.len(), "round {round}: {found:?}");
        assert!(touches(a, b, gap - 1e-4).1.is_empty(), "round {round}");
    }
}

/// Checks two equal boxes with coincident corners. They have four touches, at the corners, exact to
/// the last bit. Drifts of 1e-9 in any coordinate of the pose change nothing else.
#[test]
fn equal_boxes_touch_in_their_four_corners() {
    let cube = Piece::cuboid(v(0.5, 0.5, 0.5)).unwrap();
    let (_, exact) = touches((&cube, &at(0., 0., 0.)), (&cube, &at(0., 0., 1.)), 0.0);
    assert_eq!(exact.len(), 4);
    let corners: BTreeSet<String> = exact.iter().map(|t| format!("{:?}", t.point)).collect();
    assert_eq!(corners.len(), 4);
    for touch in &exact {
        assert_eq!((touch.gap, touch.point.map(f64::abs)), (0.0, v(0.5, 0.5, 0.5)));
        assert_eq!((touch.normal, touch.offset), (v(0., 0., -1.), 0.5));
    }
    let mut draw = WideDraw::wide(4);
    for _ in 0..500 {
        let shift = draw.vector(1e-9);
        let angle = draw.vector(1e-9);
        let rotation = *Rotation3::new(angle).matrix();
        let drifted = Pose { position: v(0., 0., 1.) + shift, rotation };
        let (_, found) = touches((&cube, &at(0., 0., 0.)), (&cube, &drifted), 1e-6);
        assert_eq!(features(&found), features(&exact));
        assert!(found.iter().all(|touch| touch.gap.abs() < 3e-9));
    }
}

/// Corners of the intersection of two rectangles. One is clipped at each side of the other.
fn clipped(a: [f64; 2], b: [f64; 2], shift: [f64; 2], angle: f64) -> Vec<[f64; 2]> {
    let signs = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
    let (sin, cos) = angle.sin_cos();
    let mut polygon: Vec<[f64; 2]> = signs
        .iter()
        .map(|(x, y)| {
            let (x, y) = (x * b[0], y * b[1]);
            [cos * x - sin * y + shift[0], sin * x + cos * y + shift[1]]
        })
        .collect();
    for (axis, sign) in [(0, 1.0), (0, -1.0), (1, 1.0), (1, -1.0)] {
        let inside = |p: &[f64; 2]| a[axis] - sign * p[axis];
        let mut cut = Vec::new();
        for (k, p) in polygon.iter().enumerate() {
            let q = polygon[(k + 1) % polygon.len()];
            let (here, there) = (inside(p), inside(&q));
            if here >= 0.0 {
                cut.push(*p);
            }
            if (here > 0.0 && there < 0.0) || (here < 0.0 && there > 0.0) {
                let t = here / (here - there);
                cut.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
            }
        }
        polygon = cut;
    }
    polygon
}

/// Checks two boxes on each other, shifted and rotated about the vertical. The touches are exactly
/// the corners of the intersection. Then the whole scene is rotated.
#[test]
fn two_faces_give_every_corner_of_their_overlap() {
    let mut draw = WideDraw::wide(5);
    let (mut eight, mut crossings) = (0, 0);
    for round in 0..1000 {
        let (a, mut b) = (draw.half_sides(), draw.half_sides());
        let (mut shift, mut angle) = (draw.vector(0.5), draw.within(-0.8, 0.8));
        if round % 3 == 0 {
            // Almost equal squares, rotated by almost 45°: eight corners.
            b = a * draw.within(0.95, 1.05);
            (shift, angle) = (shift * 0.05, angle.signum() * 0.7);
        }
        let expected = clipped([a.x, a.y], [b.x, b.y], [shift.x, shift.y], angle);
        let (cube_a, cube_b) = (Piece::cuboid(a).unwrap(), Piece::cuboid(b).unwrap());
        let height = a.z + b.z;
        let pose_b =
            Pose { position: v(shift.x, shift.y, height), rotation: turn(0.0, 0.0, angle) };
        let (_, found) = touches((&cube_a, &at(0., 0., 0.)), (&cube_b, &pose_b), 1e-6);
        if expected.is_empty() {
            continue;
        }
        let flat: Vec<V> = found.iter().map(|t| in_world(t, &at(0., 0., 0.), &pose_b).0).collect();
        assert_eq!(found.len(), expected.len(), "round {round}: {expected:?} {flat:?}");
        for [x, y] in &expected {
            let near = flat.iter().any(|p| (p - v(*x, *y, a.z)).norm() < 1e-9);
            assert!(near, "round {round}: no ({x}, {y}) in {flat:?}");
        }
        eight += u32::from(found.len() == 8);
        crossings += found.iter().filter(|t| matches!(t.feature, Feature::Edges(..))).count();

        let world = draw.pose(10.0);
        let place = |pose: &Pose| Pose {
            position: world.rotation * pose.position + world.position,
            rotation: world.rotation * pose.rotation,
        };
        let turned = (place(&at(0., 0., 0.)), place(&pose_b));
        let (_, again) = touches((&cube_a, &turned.0), (&cube_b, &turned.1), 1e-6);
        assert_eq!(features(&again), features(&found), "round {round}");
    }
    assert!(eight > 20 && crossings > 500, "{eight} {crossings}");
}

/// Checks that drifts of 1e-9 in position and angle change neither keys nor number of touches of
/// two faces. The gaps change by the drift (times the lever, at most 2 m here).
#[test]
fn drifts_leave_the_touches_of_faces_as_they_are() {
    let mut draw = WideDraw::wide(6);
    for round in 0..1000 {
        let (a, b) = (draw.half_sides(), draw.half_sides());
        let (cube_a, cube_b) = (Piece::cuboid(a).unwrap(), Piece::cuboid(b).unwrap());
        // Half of the rounds are aligned as in constructed scenes: flush sides, or one half over
        // the other.
        let aligned = round % 2 == 0;
        let shift = if aligned { v(a.x - b.x, 0.0, 0.0) } else { a * draw.within(-0.5, 0.5) };
        let angle = if aligned { 0.0 } else { draw.within(-0.8, 0.8) };
        let world = draw.pose(10.0);
        let place = |position: V, rotation: Matrix3<f64>| Pose {
            position: world.rotation * position + world.position,
            rotation: world.rotation * rotation,
        };
        let pose_a = place(V::zeros(), Matrix3::identity());
        let up = v(shift.x, shift.y, a.z + b.z);
        let pose_b = place(up, turn(0.0, 0.0, angle));
        let (_, before) = touches((&cube_a, &pose_a), (&cube_b, &pose_b), 1e-6);
        assert!(before.len() >= 3);
        for _ in 0..5 {
            let drift = *Rotation3::new(draw.vector(1e-9)).matrix();
            let moved = Pose {
                position: pose_b.position + draw.vector(1e-9),
                rotation: drift * pose_b.rotation,
            };
            let (_, after) = touches((&cube_a, &pose_a), (&cube_b, &moved), 1e-6);
            assert_eq!(features(&before), features(&after), "round {round}");
            for touch in &after {
                let was = before.iter().find(|t| t.feature == touch.feature).unwrap();
                assert!((touch.gap - was.gap).abs() < 5e-9);
                assert_eq!(touch.point_of, was.point_of);
            }
        }
    }
}

fn swapped(feature: Feature) -> Feature {
    match feature {
        Feature::Vertex(PieceSide::A, vertex) => Feature::Vertex(PieceSide::B, vertex),
        Feature::Vertex(PieceSide::B, vertex) => Feature::Vertex(PieceSide::A, vertex),
        Feature::Edges(a, b) => Feature::Edges(b, a),
        Feature::Vertices(a, b) => Feature::Vertices(b, a),
        Feature::Round(a, b) => Feature::Round(b, a),
        Feature::Ellipsoid(PieceSide::A, one) => Feature::Ellipsoid(PieceSide::B, one),
        Feature::Ellipsoid(PieceSide::B, one) => Feature::Ellipsoid(PieceSide::A, one),
    }
}

/// Checks that rotating and moving the whole scene, or swapping the pieces, leaves the same
/// touches.
#[test]
fn turned_and_swapped_pairs_have_the_same_touches() {
    let mut draw = WideDraw::wide(7);
    for round in 0..2000 {
        let gap = [1e-5, 1e-4, -1e-4][round % 3];
        let (a, pose_a, b, pose_b) = near_pair(&mut draw, gap);
        let (_, found) = touches((&a, &pose_a), (&b, &pose_b), 1e-3);
        let world = draw.pose(5.0);
        let place = |pose: &Pose| Pose {
            position: world.rotation * pose.position + world.position,
            rotation: world.rotation * pose.rotation,
        };
        let (_, turned) = touches((&a, &place(&pose_a)), (&b, &place(&pose_b)), 1e-3);
        let (_, other) = touches((&b, &pose_b), (&a, &pose_a), 1e-3);
        assert_eq!(features(&found), features(&turned), "round {round}");
        let back: BTreeSet<_> = other.iter().map(|touch| swapped(touch.feature)).collect();
        assert_eq!(features(&found), back, "round {round}");
        for touch in &found {
            let same = turned.iter().find(|t| t.feature == touch.feature).unwrap();
            assert!((same.gap - touch.gap).abs() < 1e-9);
            assert!((same.point - touch.point).norm() < 1e-6, "round {round}");
            let same = other.iter().find(|t| swapped(t.feature) == touch.feature).unwrap();
            assert!((same.gap - touch.gap).abs() < 1e-9, "round {round}");
        }
    }
}

fn capsule() -> Piece {
    // The capsule is along x.
    let capsule = Piece::capsule(0.5, 0.1).unwrap();
    capsule.moved_by(&turn(0.0, std::f64::consts::FRAC_PI_2, 0.0), &V::zeros()).unwrap()
}

fn gaps(touches: &[ManifoldPoint]) -> Vec<f64> {
    touches.iter().map(|touch| touch.gap).collect()
}

/// Checks spheres, capsules and boxes in poses with obvious results.
#[test]
fn round_pieces_touch_where_they_should() {
    let floor = Piece::cuboid(v(2.0, 2.0, 0.5)).unwrap();
    let ball = Piece::sphere(0.25).unwrap();
    let ground = at(0., 0., 0.);
    let on = |piece: &Piece, pose: Pose| touches((&floor, &ground), (piece, &pose), 1e-6).1;
    let near = |given: &[f64], count: usize| {
        assert_eq!(given.len(), count);
        assert!(given.iter().all(|gap| gap.abs() < 1e-12), "{given:?}");
    };

    // A ball on a face, over an edge, over a corner: one touch, with the point at its centre.
    let slope = 0.5f64.sqrt() * 0.25;
    let corner = 0.25 / 3.0f64.sqrt();
    let poses = [
        at(1.3, -0.2, 0.75),
        at(2.0 + slope, 0.3, 0.5 + slope),
        at(2.0 + corner, 2.0 + corner, 0.5 + corner),
    ];
    for pose in poses {
        let found = on(&ball, pose);
        near(&gaps(&found), 1);
        // Off the face the contact is between round features.
        let is_over_face = pose.position[0] < 2.0;
        match found[0].feature {
            Feature::Vertex(PieceSide::B, 0) => assert!(is_over_face),
            Feature::Round(_, CorePart::Vertex(0)) => assert!(!is_over_face),
            other => panic!("{other:?}"),
        }
        assert_eq!((found[0].point_of, found[0].point), (PieceSide::B, V::zeros()));
        let half_sides = v(2.0, 2.0, 0.5);
        let nearest = pose.position.sup(&-half_sides).inf(&half_sides);
        let away = (pose.position - nearest).normalize();
        assert!((found[0].normal - away).norm() < 1e-12);
    }

    // A lying capsule has two touches, at its ends. Over the rim it has one at its end and one at a
    // point of its axis above the edge. A standing capsule has one.
    let lying = on(&capsule(), at(0.0, 0.0, 0.6));
    near(&gaps(&lying), 2);
    assert_eq!(features(&lying).len(), 2);
    assert!(lying.iter().all(|touch| touch.point_of == PieceSide::B));
    let over = on(&capsule(), at(1.9, 0.0, 0.6));
    near(&gaps(&over), 2);
    assert_eq!(over.iter().filter(|t| matches!(t.feature, Feature::Edges(..))).count(), 1);
    let tip = over.iter().find(|t| matches!(t.feature, Feature::Edges(..))).unwrap();
    assert!((tip.point - v(0.1, 0.0, 0.0)).norm() < 1e-12, "{}", tip.point);
    let upright = turn(0.0, std::f64::consts::FRAC_PI_2, 0.0);
    let standing = Pose { position: v(0.3, 0.4, 1.1), rotation: upright };
    near(&gaps(&on(&capsule(), standing)), 1);

    // Along the rim, beside the top face: also at its ends.
    let beside = on(&capsule(), at(0.0, 2.0 + 0.1 * 0.6, 0.5 + 0.1 * 0.8));
    near(&gaps(&beside), 2);

    // Two capsules: parallel, shifted along each other, crossed, end to end.
    let pair = |pose: Pose| touches((&capsule(), &ground), (&capsule(), &pose), 1e-6).1;
    near(&gaps(&pair(at(0.0, 0.0, 0.2))), 2);
    let shifted = pair(at(0.4, 0.0, 0.2));
    near(&gaps(&shifted), 2);
    assert_eq!(
        features(&shifted),
        [
            Feature::Round(CorePart::Vertex(1), CorePart::Edge(0)),
            Feature::Round(CorePart::Edge(0), CorePart::Vertex(0))
        ]
        .into()
    );
    let crossed = Pose { position: v(0.1, 0.2, 0.2), rotation: turn(0.0, 0.0, 1.0) };
    assert_eq!(
        features(&pair(crossed)),
        [Feature::Round(CorePart::Edge(0), CorePart::Edge(0))].into()
    );
    let ends = Feature::Round(CorePart::Vertex(1), CorePart::Vertex(0));
    assert_eq!(features(&pair(at(1.2, 0.0, 0.0))), [ends].into());

    // Two spheres: the plane is perpendicular to the line of centres.
    let other = at(0.3, 0.4, 0.0);
    let (gap, found) = touches((&ball, &ground), (&ball, &other), 1e-6);
    near(&gaps(&found), 1);
    assert!(gap.abs() < 1e-15 && (found[0].normal - v(-0.6, -0.8, 0.0)).norm() < 1e-15);

    // A rounded box on the floor: its four lower corners.
    let corners = Piece::cuboid(v(0.3, 0.2, 0.1)).unwrap().core().vertices().to_vec();
    let rounded = Piece::hull(&corners, 0.05).unwrap();
    let found = on(&rounded, at(0.0, 0.0, 0.65));
    near(&gaps(&found), 4);
}

/// Checks overlaps of the cores. The depth is still the length of the shortest separating
/// translation.
#[test]
fn deep_overlaps_have_their_depth() {
    let floor = Piece::cuboid(v(2.0, 2.0, 0.5)).unwrap();
    let ground = at(0., 0., 0.);
    let depth = |piece: &Piece, pose: Pose| -separate((&floor, &ground), (piece, &pose)).distance;
    let ball = Piece::sphere(0.25).unwrap();
    assert!((depth(&ball, at(0.3, 0.1, 0.4)) - 0.35).abs() < 1e-15);
    assert!((depth(&capsule(), at(0.3, 0.1, 0.4)) - 0.2).abs() < 1e-15);
    let (_, found) = touches((&floor, &ground), (&capsule(), &at(0.3, 0.1, 0.4)), 0.0);
    assert_eq!(found.len(), 2);
    assert!(found.iter().all(|touch| (touch.gap + 0.2).abs() < 1e-15));
    // Crossing cores of capsules, and the same sphere twice.
    let crossed = Pose { position: V::zeros(), rotation: turn(0.0, 0.0, 1.0) };
    let found = separate((&capsule(), &ground), (&capsule(), &crossed));
    assert!((found.distance + 0.2).abs() < 1e-15 && (found.axis.z.abs() - 1.0).abs() < 1e-12);
    assert_eq!(separate((&ball, &ground), (&ball, &ground)).distance, -0.5);
    let (_, found) = touches((&ball, &ground), (&ball, &ground), 0.0);
    assert_eq!((found.len(), found[0].gap), (1, -0.5));
}

/// Checks boxes whose difference has the origin on a face, an edge or a corner, exactly or almost.
/// A simplex method may end there without a result. All of these pairs touch.
#[test]
fn touching_features_that_coincide_are_not_dropped() {
    let cube = Piece::cuboid(v(0.5, 0.5, 0.5)).unwrap();
    let mut draw = WideDraw::wide(8);
    let steps = [-1.0, -0.5, 0.0, 0.5, 1.0];
    for x in steps {
        for y in steps {
            for z in [-1.0, 1.0] {
                for tiny in [0.0, 1e-16, 1e-13, 1e-11] {
                    let position = v(x, y, z) + draw.vector(tiny);
                    let pose =
                        Pose { position, rotation: turn(0.0, 0.0, draw.within(-tiny, tiny)) };
                    let (gap, found) = touches((&cube, &at(0., 0., 0.)), (&cube, &pose), 1e-9);
                    assert!(gap.abs() < 1e-10 && !found.is_empty(), "{position} {gap:e}");
                    assert!(found.iter().all(|touch| touch.gap.abs() < 1e-10));
                    // Fully overlapping faces have four corners.
                    if x.abs() < 1.0 && y.abs() < 1.0 {
                        assert_eq!(found.len(), 4, "{position}");
                    }
                }
            }
        }
    }
}

/// Checks corner on face, edge on face and edge on edge of two cubes: one or two touches.
#[test]
fn cubes_on_edge_and_corner_touch_in_one_or_two_points() {
    let floor = Piece::cuboid(v(2.0, 2.0, 0.5)).unwrap();
    let cube = Piece::cuboid(v(0.5, 0.5, 0.5)).unwrap();
    let ground = at(0., 0., 0.);
    let edge = Pose {
        position: v(0.1, 0.2, 0.5 + 0.5f64.sqrt()),
        rotation: turn(std::f64::consts::FRAC_PI_4, 0.0, 0.0),
    };
    let (_, found) = touches((&floor, &ground), (&cube, &edge), 1e-9);
    assert_eq!(found.len(), 2);
    let tilt = Rotation3::rotation_between(&v(1., 1., 1.), &v(0., 0., -1.)).unwrap();
    let corner = Pose { position: v(0.1, 0.2, 0.5 + 0.75f64.sqrt()), rotation: *tilt.matrix() };
    let (_, found) = touches((&floor, &ground), (&cube, &corner), 1e-9);
    assert_eq!(features(&found), [Feature::Vertex(PieceSide::B, 7)].into());
    // Two perpendicular edges.
    let lower =
        Pose { position: V::zeros(), rotation: turn(std::f64::consts::FRAC_PI_4, 0.0, 0.0) };
    let upper = Pose {
        position: v(0.1, 0.2, 2.0f64.sqrt()),
        rotation: turn(0.0, std::f64::consts::FRAC_PI_4, 0.0),
    };
    let (gap, found) = touches((&cube, &lower), (&cube, &upper), 1e-9);
    assert!(gap.abs() < 1e-12 && found.len() == 1);
    assert!(matches!(found[0].feature, Feature::Edges(..)));
    let (point, on_plane, normal) = in_world(&found[0], &lower, &upper);
    assert!(
        (point - v(0.1, 0.0, 0.5f64.sqrt())).norm() < 1e-12 && (point - on_plane).norm() < 1e-12
    );
    assert!((normal.z.abs() - 1.0).abs() < 1e-12);
}
