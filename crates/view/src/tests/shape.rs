//! Unit tests of `shape.rs`.

use super::*;
use crate::samples::ball;

fn corners(edges: [Vector3<f64>; 3]) -> Vec<Vector3<f64>> {
    (0..8).map(|i| (0..3).map(|k| edges[k] * f64::from(i >> k & 1)).sum()).collect()
}

#[test]
fn boxes_are_recognised_among_other_bodies() {
    let edges = [Vector3::x(), Vector3::y() * 2.0, Vector3::z() * 0.1];
    let mut points = corners(edges);
    assert!(is_box(&points));
    points[3][2] += 0.01;
    assert!(!is_box(&points));
    assert!(!is_box(&points[..4]));
    assert!(!is_box(&corners([edges[0]; 3])));
}

/// Points on a ball: its extent in any direction is its radius, also along diagonals.
#[test]
fn a_ball_extends_by_its_radius_in_every_direction() {
    let centre = Vector3::new(1.0, -2.0, 0.5);
    let ball = ball(centre, 0.3);
    let points = ball.surface_points();
    for direction in directions(500) {
        let extent =
            points.iter().map(|point| (point - centre).dot(&direction)).fold(0.0, f64::max);
        assert!((0.97 * 0.3..=0.3 + 1e-12).contains(&extent), "{direction}: {extent}");
    }
}

/// Three triangles form a right-angled corner and one more extends a face in its plane. Every
/// edge is visible except the one between coplanar triangles.
#[test]
fn mesh_lines_are_folds_and_borders() {
    let at = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
    let vertices = vec![
        at(0.0, 0.0, 0.0),
        at(1.0, 0.0, 0.0),
        at(0.0, 1.0, 0.0),
        at(0.0, 0.0, 1.0),
        at(1.0, 1.0, 0.0),
    ];
    let triangles = vec![[0, 1, 2], [1, 4, 2], [0, 2, 3], [0, 0, 1], [0, 1, 9]];
    let mesh = Shape::Mesh(Mesh { vertices, triangles, colour: None });
    let normals: Vec<_> = mesh.sides().into_iter().map(|side| side.1).collect();
    assert_eq!(normals, [Vector3::z(), Vector3::z(), Vector3::x()]);
    let surface = Surface::from_shape(&mesh);
    let creases: Vec<_> = surface.creases.iter().map(|crease| crease.0).collect();
    assert_eq!(creases, [[0, 1], [0, 2], [0, 3], [1, 4], [2, 3], [2, 4]]);
}

/// A prism with 24 sides approximates a cylinder. Its sides are smooth and its ends are flat.
#[test]
fn a_prism_with_many_sides_is_shaded_as_a_cylinder() {
    let sides = 24;
    let turn = |k: usize| std::f64::consts::TAU * k as f64 / sides as f64;
    let corner = |i: usize| {
        let (sine, cosine) = turn(i / 2).sin_cos();
        Vector3::new(cosine, sine, (i % 2) as f64)
    };
    let vertices: Vec<_> = (0..2 * sides).map(corner).collect();
    let core = Hull::from_points(&vertices).unwrap();
    let surface = Surface::from_shape(&Shape::Convex { core, radius: 0.0, name: None });
    for face in &surface.faces {
        for (corner, normal) in face.corners.iter().zip(&face.normals) {
            let radial = Vector3::new(vertices[*corner].x, vertices[*corner].y, 0.0);
            let expected = if face.normal.z == 0.0 { radial } else { face.normal };
            assert!((normal - expected).norm() < 1e-9, "{normal} {expected}");
        }
    }
    assert_eq!(surface.creases.len(), 2 * sides);
}

/// Every face has the corners that lie in its plane, whatever the piece is.
#[test]
fn each_piece_has_the_shape_of_its_geometry() {
    let cuboid = Shape::from(&Piece::cuboid(Vector3::new(0.3, 0.2, 0.1)).unwrap());
    let sides = cuboid.sides();
    assert_eq!((cuboid.core().len(), sides.len(), cuboid.radius()), (8, 6, 0.0));
    for (face, _) in &sides {
        let places: Vec<_> = face.iter().map(|corner| cuboid.core()[*corner]).collect();
        let in_plane = |axis: usize| places.iter().all(|at| at[axis] == places[0][axis]);
        assert!(face.len() == 4 && (0..3).any(in_plane), "{face:?}");
    }
    let capsule = Shape::from(&Piece::capsule(0.4, 0.1).unwrap());
    let [a, b] = capsule.core() else { panic!("a capsule has two ends") };
    assert_eq!(((b - a).norm(), capsule.radius()), (0.8, 0.1));
}
