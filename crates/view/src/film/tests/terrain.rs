//! Unit tests of `terrain.rs`.

use super::*;

#[test]
fn thinned_height_field_keeps_its_borders() {
    let (rows, columns) = (301, 202);
    let field = HeightField::new(vec![0.0; rows * columns], columns, [0.1, 0.2]).unwrap();
    let drawn = object("hill", &Terrain::from(field));
    assert_eq!(drawn.name, "hill (every 4th height is drawn)");
    let [Shape::Mesh(mesh)] = &drawn.shapes[..] else { panic!("one mesh") };
    assert!(mesh.triangles.len() <= MOST_TRIANGLES);
    let far = mesh.vertices.iter().map(|at| at.x + at.y).fold(0.0, f64::max);
    assert!((far - (201.0 * 0.1 + 300.0 * 0.2)).abs() < 1e-9, "{far}");
    assert!(mesh.triangles.iter().flatten().all(|index| *index < mesh.vertices.len()));
}
