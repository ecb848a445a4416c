//! Unit tests of `surface.rs`.

use super::*;

fn at(piece: &Piece, point: [f64; 3]) -> Option<Vec<Vector3<f64>>> {
    let mut normals = Vec::new();
    piece.surface_at(&point.into(), 1e-6, &mut normals).then_some(normals)
}

#[test]
fn box_has_one_normal_on_a_face_three_at_a_corner_and_none_inside() {
    let cube = Piece::cuboid(Vector3::repeat(1.0)).unwrap();
    assert_eq!(at(&cube, [0.2, 0.3, 1.0]), Some(vec![Vector3::z()]));
    assert_eq!(at(&cube, [1.0, 1.0, 1.0]).unwrap().len(), 3);
    assert_eq!(at(&cube, [0.0, 0.0, 0.0]), Some(vec![]));
    assert_eq!(at(&cube, [0.0, 0.0, 1.1]), None);
    // The tolerance is that of a distance.
    assert!(at(&cube, [0.0, 0.0, 1.0 + 0.9e-6]).is_some());
    assert_eq!(at(&cube, [0.0, 0.0, 1.0 + 1.1e-6]), None);
}

#[test]
fn height_is_the_distance_above_a_face() {
    let cube = Piece::cuboid(Vector3::repeat(1.0)).unwrap();
    assert!((cube.height_of(&Vector3::new(0.3, 0.0, 1.5)) - 0.5).abs() < 1e-15);
    assert!((cube.height_of(&Vector3::zeros()) + 1.0).abs() < 1e-15);
    let ball = Piece::sphere(2.0).unwrap();
    assert!((ball.height_of(&Vector3::new(3.0, 4.0, 0.0)) - 3.0).abs() < 1e-15);
}

#[test]
fn normals_of_curved_surfaces_are_gradients_of_their_equations() {
    let close = |piece: &Piece, point: [f64; 3], expected: [f64; 3]| {
        let found = at(piece, point).unwrap();
        assert_eq!(found.len(), 1, "{found:?}");
        assert!((found[0] - Vector3::from(expected)).norm() < 1e-9, "{found:?}");
    };
    close(&Piece::sphere(2.0).unwrap(), [0.0, 1.2, 1.6], [0.0, 0.6, 0.8]);
    close(&Piece::capsule(1.0, 0.5).unwrap(), [0.3, 0.4, 0.7], [0.6, 0.8, 0.0]);
    close(&Piece::cylinder(1.0, 0.5, 24).unwrap(), [0.3, 0.4, 0.7], [0.6, 0.8, 0.0]);
    // Cone of height 2 and radius 1: the normal is (2, 1)/√5.
    let root = 5.0_f64.sqrt();
    let side = [2.0 / root, 0.0, 1.0 / root];
    close(&Piece::cone(1.0, 1.0, 24).unwrap(), [0.5, 0.0, 0.0], side);
    let egg = Piece::ellipsoid(Vector3::new(1.0, 2.0, 3.0), 24).unwrap();
    // x²/1 + y²/4 = 1 at (0.6, 1.6): gradient (0.6, 0.4).
    let length = 0.52_f64.sqrt();
    close(&egg, [0.6, 1.6, 0.0], [0.6 / length, 0.4 / length, 0.0]);
    let rounded = Piece::hull(
        &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Vector3::from),
        0.1,
    );
    close(&rounded.unwrap(), [0.2, 0.2, -0.1], [0.0, 0.0, -1.0]);
}
