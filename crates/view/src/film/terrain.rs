//! Terrain in pictures: all triangles of a small one, every n-th height of a large field.

use super::Object;
use crate::shape::{Mesh, Shape};
use tumble_core::geometry::Terrain;
use tumble_core::geometry::terrain::{HeightField, TerrainShape};

/// Largest number of triangles that are drawn.
const MOST_TRIANGLES: usize = 8000;

/// Fixed object with the `name` of a terrain. The name says what is not drawn.
pub fn object(name: &str, terrain: &Terrain) -> Object {
    let (name, mesh) = match terrain.shape() {
        TerrainShape::Field(field) => {
            let (mesh, stride) = drawn_field(field);
            match stride {
                1 => (name.to_owned(), Some(mesh)),
                _ => (format!("{name} (every {stride}th height is drawn)"), Some(mesh)),
            }
        }
        TerrainShape::Mesh(mesh) if mesh.triangles().len() > MOST_TRIANGLES => {
            (format!("{name} (not drawn: {} triangles)", mesh.triangles().len()), None)
        }
        TerrainShape::Mesh(mesh) => {
            let triangles = mesh.triangles().iter().map(|three| three.map(|at| at as usize));
            let (vertices, triangles) = (mesh.vertices().to_vec(), triangles.collect());
            (name.to_owned(), Some(Mesh { vertices, triangles, colour: None }))
        }
    };
    let shapes = mesh.map(Shape::Mesh).into_iter().collect();
    Object { name, shapes, ..Object::default() }
}

/// Mesh of every n-th row and column and of the last ones, with n.
fn drawn_field(field: &HeightField) -> (Mesh, usize) {
    let cells = |points: usize, stride: usize| (points - 1).div_ceil(stride);
    let count = |stride: usize| 2 * cells(field.rows(), stride) * cells(field.columns(), stride);
    let stride = (1..).find(|stride| count(*stride) <= MOST_TRIANGLES).unwrap_or(1);
    let places = |points: usize| -> Vec<usize> {
        (0..points - 1).step_by(stride).chain([points - 1]).collect()
    };
    let (rows, columns) = (places(field.rows()), places(field.columns()));
    let vertices =
        rows.iter().flat_map(|row| columns.iter().map(|column| field.point(*row, *column)));
    let vertices = vertices.collect();
    let mut triangles = Vec::new();
    for row in 0..rows.len() - 1 {
        for column in 0..columns.len() - 1 {
            let first = row * columns.len() + column;
            let across = first + columns.len() + 1;
            triangles.extend([[first, first + 1, across], [first, across, across - 1]]);
        }
    }
    (Mesh { vertices, triangles, colour: None }, stride)
}

#[cfg(test)]
#[path = "tests/terrain.rs"]
mod tests;
