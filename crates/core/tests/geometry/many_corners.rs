//! Pairs of hulls with hundreds of corners. Their search leaves most features out.

use crate::pieces::*;
use std::f64::consts::TAU;
use tumble_core::geometry::{Hint, PairScratch, Piece, closest_points};

/// Hull of random points on an ellipsoid, or of circles of points like a turned part.
fn many(draw: &mut WideDraw) -> Piece {
    let axes = draw.half_sides();
    let count = 40 + draw.index(200);
    let ellipsoid: Vec<V> = (0..count).map(|_| draw.direction().component_mul(&axes)).collect();
    let circles = [(0.6, -1.0), (0.9, -0.9), (1.0, -0.7), (1.0, 0.7), (0.9, 0.9), (0.6, 1.0)];
    let turned: Vec<V> = circles
        .iter()
        .flat_map(|&(radius, height)| {
            (0..count).map(move |at| {
                let angle = TAU * at as f64 / count as f64;
                v(axes.x * radius * angle.cos(), axes.x * radius * angle.sin(), axes.y * height)
            })
        })
        .collect();
    let is_turned = draw.index(2) == 0 && turned.len() < 1000;
    let radius = if draw.index(3) == 0 { 0.02 } else { 0.0 };
    Piece::hull(if is_turned { &turned } else { &ellipsoid }, radius).unwrap()
}

/// Apart, the gap along the axis is a lower bound on the distance, and two points of the hulls are an
/// upper bound. In both cases no random axis has a larger gap, near this one or elsewhere.
#[test]
fn hulls_of_many_corners_are_separated_exactly() {
    let (mut draw, mut scratch) = (WideDraw::wide(41), PairScratch::default());
    for number in 0..120 {
        let (a, b) = (many(&mut draw), many(&mut draw));
        let (pose_a, mut pose_b) = (draw.pose(0.5), draw.pose(0.5));
        if number % 3 == 0 {
            pose_b.rotation = pose_a.rotation * turn(0.0, 0.0, draw.within(0.0, 1.0));
        }
        pose_b.position += draw.direction() * 4.0;
        let wanted = [0.3, 1e-3, 1e-7, -1e-3, -0.05][number % 5];
        for _ in 0..30 {
            let found = separate((&a, &pose_a), (&b, &pose_b));
            pose_b.position -= found.axis * (found.distance - wanted);
        }
        let (a, b) = ((&a, &pose_a), (&b, &pose_b));
        let found = closest_points(a, b, &mut Hint::default(), &mut scratch);
        let (distance, axis) = (found.separation.distance, found.separation.axis);
        let at = format!("pair {number}: {distance:e} for {wanted:e}");
        // The direction of two points, with coordinates near 1 m, has an error of 1e-16 over their distance.
        let rounding = 1e-12 + if distance > 0.0 { 1e-15 / distance } else { 0.0 };
        assert!((gap_along(a, b, &axis) - distance).abs() < rounding, "{at}");
        if distance > 0.0 {
            assert!(((found.b - found.a).norm() - distance).abs() < 1e-12, "{at}");
        }
        for width in [2.0, 0.1, 1e-2, 1e-3] {
            for _ in 0..200 {
                let other = (axis + draw.direction() * width).normalize();
                assert!(gap_along(a, b, &other) < distance + 1e-12, "{at}, {other}");
            }
        }
    }
}
