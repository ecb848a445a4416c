//! Unit tests of `data.rs`.

use super::*;
use crate::samples::ball;

#[test]
fn only_meshes_are_rounded_in_page_data() {
    let corner = |x: f64, y: f64, z: f64| Vector3::new(x, y, z) / 3.0;
    let vertices = vec![corner(1.0, 0.0, 0.0), corner(0.0, 2.0, 0.0), corner(0.0, 0.0, 1.0)];
    let triangles = vec![[0, 1, 2]];
    let mesh = PieceData::new(&Shape::Mesh(Mesh {
        vertices: vertices.clone(),
        triangles,
        colour: Some([1, 2, 255]),
    }));
    assert_eq!(mesh.colour.as_deref(), Some("#0102ff"));
    assert!(mesh.vertices.is_empty() && mesh.faces.is_empty());
    let packed = mesh.mesh.unwrap();
    let steps: Vec<_> = packed.vertices.unpacked().into_iter().flatten().collect();
    // Thirds in units of 1e-5.
    assert_eq!(steps, [33333, 0, 0, 0, 66667, 0, 0, 0, 33333]);
    let corners: Vec<_> = packed.triangles.unpacked().into_iter().flatten().collect();
    assert_eq!(corners, [0, 1, 2]);
    let ball = PieceData::new(&ball(vertices[0], 0.1));
    assert!(ball.mesh.is_none() && ball.vertices[0] == <[f64; 3]>::from(vertices[0]));
}
