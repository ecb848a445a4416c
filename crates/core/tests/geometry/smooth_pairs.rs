//! Axes and contact points of pairs with cylinders, cones and ellipsoids.

use crate::common::draw::Draw;
use crate::common::prelude::*;
use nalgebra::Quaternion;
use std::f64::consts::{PI, TAU};
use tumble_core::geometry::{
    Hint, PairScratch, PieceSide, RayCaster, closest_points, manifold, signed_distance,
};

impl Draw {
    /// A piece of kind 0 to 5, with sizes from 0.025 m to 0.4 m.
    fn piece(&mut self, kind: usize) -> Piece {
        let mut size = || 0.1 * 4.0_f64.powf(self.unit());
        let sizes = [size(), size(), size()];
        let [x, y, z] = sizes;
        let piece = match kind {
            0 => Piece::cuboid(sizes.into()),
            1 => Piece::sphere(x),
            2 => Piece::capsule(x, y),
            3 => Piece::cylinder(x, y, 24),
            4 => Piece::cone(x, y, 24),
            _ => Piece::ellipsoid(Vector3::new(x, y, z), 24),
        };
        piece.unwrap()
    }

    fn pose(&mut self) -> Pose {
        let [w, i, j, k] = std::array::from_fn(|_| self.unit());
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k));
        Pose { position: self.vector(1.0), rotation: *turn.to_rotation_matrix().matrix() }
    }
}

/// Largest n·x over a placed piece (m).
fn extent(piece: &Piece, pose: &Pose, n: &Vector3<f64>) -> f64 {
    let own = pose.rotation.tr_mul(n);
    let heights = piece.core().vertices().iter().map(|vertex| own.dot(vertex));
    let core = || heights.fold(f64::NEG_INFINITY, f64::max) + piece.radius();
    n.dot(&pose.position) + piece.smooth().map_or_else(core, |smooth| smooth.extent(&own))
}

/// Largest gap along any direction (m), by a dense search that is refined around the best one.
fn best_gap(a: (&Piece, &Pose), b: (&Piece, &Pose)) -> f64 {
    let gap = |n: &Vector3<f64>| -extent(a.0, a.1, n) - extent(b.0, b.1, &-n);
    let grid = (0..24).flat_map(|i| (0..48).map(move |j| (i, j))).map(|(i, j)| {
        let (polar, around) = (PI * (f64::from(i) + 0.5) / 24.0, TAU * f64::from(j) / 48.0);
        Vector3::new(polar.sin() * around.cos(), polar.sin() * around.sin(), polar.cos())
    });
    let mut best = grid.max_by(|x, y| gap(x).total_cmp(&gap(y))).unwrap();
    let mut width = 0.1;
    while width > 1e-9 {
        let u = best.cross(&Vector3::ith(best.iamin(), 1.0)).normalize();
        let v = best.cross(&u);
        let around = (0..24).map(|i| {
            let (sine, cosine) = (TAU * f64::from(i) / 24.0).sin_cos();
            (best + (u * cosine + v * sine) * width).normalize()
        });
        let next = around.max_by(|x, y| gap(x).total_cmp(&gap(y))).unwrap();
        if gap(&next) > gap(&best) { best = next } else { width *= 0.5 }
    }
    gap(&best)
}

/// Moves B until both pieces touch.
fn bring_together(a: (&Piece, &Pose), b: (&Piece, &mut Pose), scratch: &mut PairScratch) {
    for _ in 0..80 {
        let found = signed_distance(a, (b.0, &*b.1), &mut Hint::default(), scratch);
        b.1.position -= found.axis * found.distance;
        if found.distance.abs() < 1e-14 {
            return;
        }
    }
}

/// Pairs of all shapes that touch: no direction has a larger gap than the axis, A and B may be
/// swapped, and the lowest contact point has the gap of the pieces. A flat end meets edges and
/// corners of others with the corners of its core, which are inside the end by up to 0.9 % of its
/// radius; there the lowest point may be higher.
#[test]
fn touching_pairs_have_the_gap_of_the_best_direction() {
    let (mut draw, mut scratch) = (Draw::new(7), PairScratch::default());
    let (mut tested, mut inside) = (0, 0);
    for number in 0..360 {
        let kinds = (number % 6, number / 6 % 6);
        let (a, b) = (draw.piece(kinds.0), draw.piece(kinds.1));
        let (of_a, mut of_b) = (draw.pose(), draw.pose());
        if kinds.0 < 3 && kinds.1 < 3 {
            continue;
        }
        bring_together((&a, &of_a), (&b, &mut of_b), &mut scratch);
        let (a, b) = ((&a, &of_a), (&b, &of_b));
        let mut hint = Hint::default();
        let found = signed_distance(a, b, &mut hint, &mut scratch).distance;
        let swapped = signed_distance(b, a, &mut Hint::default(), &mut scratch).distance;
        let at = format!("pair {number}, kinds {kinds:?}: {found:e}");
        if found > 1e-9 {
            // Two needles that approach slowly.
            continue;
        }
        tested += 1;
        assert!((found - swapped).abs() < 1e-8, "{at}, {swapped:e}");
        let best = best_gap(a, b);
        assert!(best < found + 1e-8, "{at}, {best:e}");
        let mut touches = Vec::new();
        manifold(a, b, 1e-4, PieceSide::A, &mut hint, &mut scratch, &mut touches);
        let least = touches.iter().map(|touch| touch.gap).fold(f64::INFINITY, f64::min);
        inside += usize::from(least > found + 1e-7);
        assert!(least < found + 1e-4, "{at}, {least:e}");
    }
    assert!(tested > 250 && inside < 5, "{tested} {inside}");
}

/// The gap along the axis is a lower bound on the distance, and the length between a point of A and
/// a point of B is an upper bound. Both are equal.
#[test]
fn pairs_that_are_apart_have_their_distance() {
    let (mut draw, mut scratch) = (Draw::new(31), PairScratch::default());
    let mut tested = 0;
    for number in 0..3600 {
        let kinds = (number % 6, number / 6 % 6);
        let (a, b) = (draw.piece(kinds.0), draw.piece(kinds.1));
        let (of_a, of_b) = (draw.pose(), draw.pose());
        let found = closest_points((&a, &of_a), (&b, &of_b), &mut Hint::default(), &mut scratch);
        let (distance, axis) = (found.separation.distance, found.separation.axis);
        if kinds.0 < 3 && kinds.1 < 3 || distance < 1e-3 {
            continue;
        }
        tested += 1;
        let at = format!("pair {number}, kinds {kinds:?}: {distance:e}");
        let bound = -extent(&a, &of_a, &axis) - extent(&b, &of_b, &-axis);
        assert!((bound - distance).abs() < 1e-12, "{at}, {bound:e}");
        assert!(((found.b - found.a).norm() - distance).abs() < 1e-9, "{at}");
        // A point of a convex piece is not beyond its extent along any direction. Along the surface
        // the points are off by the square root of the rounding error of the distance.
        for _ in 0..20 {
            let n = draw.vector(1.0).normalize();
            assert!(n.dot(&found.a) < extent(&a, &of_a, &n) + 1e-6, "{at}");
            assert!(n.dot(&found.b) < extent(&b, &of_b, &n) + 1e-6, "{at}");
        }
    }
    assert!(tested > 1500, "{tested}");
}

/// Rays enter the lateral surface and the end of a cylinder, and an ellipsoid, where they should.
#[test]
fn rays_enter_smooth_shapes_at_their_surface() {
    let pose = Pose { position: Vector3::zeros(), rotation: Matrix3::identity() };
    let mut caster = RayCaster::new().unwrap();
    let mut enter = |piece: &Piece, from: Vector3<f64>, along: Vector3<f64>| {
        caster.enter(piece, &pose, &from, &along).map(|entry| entry.distance)
    };
    let cylinder = Piece::cylinder(0.5, 0.2, 24).unwrap();
    let along = Vector3::new(-1.0, 0.0, 0.0);
    for angle in [0.0_f64, 0.05, 0.13, 0.4] {
        let from = Vector3::new(2.0, 0.2 * angle.sin(), 0.3);
        let found = enter(&cylinder, from, along).unwrap();
        assert!((found - (2.0 - 0.2 * angle.cos())).abs() < 1e-12, "{found}");
    }
    assert_eq!(enter(&cylinder, Vector3::new(2.0, 0.2001, 0.3), along), None);
    let down = -Vector3::z();
    let found = enter(&cylinder, Vector3::new(0.1, 0.17, 3.0), down).unwrap();
    assert!((found - 2.5).abs() < 1e-12, "{found}");
    let egg = Piece::ellipsoid(Vector3::new(0.3, 0.2, 0.4), 24).unwrap();
    let found = enter(&egg, Vector3::new(0.1, 0.05, 3.0), down).unwrap();
    let height = 0.4 * (1.0_f64 - (0.1_f64 / 0.3).powi(2) - (0.05_f64 / 0.2).powi(2)).sqrt();
    assert!((found - (3.0 - height)).abs() < 1e-12, "{found}");
}
