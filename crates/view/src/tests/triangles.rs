//! Unit tests of `triangles.rs`.

use super::*;
use crate::samples::ball;
use tumble_core::geometry::Piece;

/// Volume by the divergence theorem. It is positive if the triangles face outwards.
fn volume((vertices, triangles): &Mesh) -> f64 {
    let part = |corners: &[usize; 3]| {
        let [a, b, c] = corners.map(|corner| vertices[corner]);
        a.dot(&b.cross(&c)) / 6.0
    };
    triangles.iter().map(part).sum()
}

fn cube(radius: f64) -> Shape {
    let corner = |i: usize| Vector3::from_fn(|k, _| (i >> k & 1) as f64);
    let corners: Vec<_> = (0..8).map(corner).collect();
    Shape::from(&Piece::hull(&corners, radius).unwrap())
}

#[test]
fn meshes_have_the_volume_of_their_pieces() {
    assert!((volume(&polyhedron(&cube(0.0))) - 1.0).abs() < 1e-12);
    let ball = ball(Vector3::new(1.0, 2.0, 3.0), 0.5);
    let capsule = Shape::from(&Piece::capsule(0.5, 0.5).unwrap());
    let of_ball = PI / 6.0;
    // The corners lie on the surface. Chords of 11° cut off about 2 % of a ball.
    for (piece, expected) in [(ball, of_ball), (capsule, of_ball + PI / 4.0)] {
        let ratio = volume(&rounded(&piece)) / expected;
        assert!((0.97..1.0).contains(&ratio), "{ratio}");
    }
}

#[test]
fn a_rounded_cube_contains_its_core_and_stays_within_its_radius() {
    let mesh = rounded(&cube(0.2));
    // Volume of the cube with six slabs, twelve quarter cylinders and a ball.
    let most = 1.0 + 6.0 * 0.2 + 3.0 * PI * 0.04 + 4.0 / 3.0 * PI * 0.008;
    assert!((1.0..most).contains(&volume(&mesh)), "{}", volume(&mesh));
    for vertex in &mesh.0 {
        let beyond = vertex.map(|x| (x - x.clamp(0.0, 1.0)).abs()).norm();
        assert!((beyond - 0.2).abs() < 1e-12, "{vertex}");
    }
}
