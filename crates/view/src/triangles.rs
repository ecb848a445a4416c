//! Triangle meshes of a film's bodies and fixed objects, for other viewers.

use crate::film::{Film, Object};
use crate::palette::{self, STILL};
use crate::shape::{Shape, Surface};
use nalgebra::Vector3;
use std::f64::consts::{PI, TAU};

/// Closed triangle mesh of one colour. Triangles are counter-clockwise seen from outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Triangles {
    /// Vertices (m).
    pub vertices: Vec<Vector3<f64>>,
    /// Indices of the corners.
    pub triangles: Vec<[usize; 3]>,
    /// Red, green and blue.
    pub colour: [u8; 3],
}

/// Meshes of a film.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmTriangles {
    /// Meshes of each body, in its frame.
    pub bodies: Vec<Vec<Triangles>>,
    /// Meshes of each fixed object, in the world.
    pub fixed: Vec<Vec<Triangles>>,
}

/// Meshes of all bodies and fixed objects. Points without a shape have none.
pub fn triangles(film: &Film) -> FilmTriangles {
    let of = |object: &Object, usual: [u8; 3]| {
        let solid = object.shapes.iter().filter(|shape| !matches!(shape, Shape::Points(_)));
        let triangles = |shape: &Shape| {
            let colour = shape.colour().unwrap_or(usual);
            let (vertices, triangles) =
                if shape.radius() > 0.0 { rounded(shape) } else { polyhedron(shape) };
            Triangles { vertices, triangles, colour }
        };
        solid.map(triangles).collect()
    };
    let bodies = film.bodies.iter().zip(palette::body_colours(film));
    FilmTriangles {
        bodies: bodies.map(|(body, colour)| of(body, colour)).collect(),
        fixed: film.fixed.iter().map(|fixed| of(fixed, STILL)).collect(),
    }
}

type Mesh = (Vec<Vector3<f64>>, Vec<[usize; 3]>);

/// Faces of a hull or a mesh, cut into triangles. Each face has its own vertices, so that viewers
/// that average normals at a vertex show sharp edges.
fn polyhedron(shape: &Shape) -> Mesh {
    let (core, mut vertices, mut triangles) = (shape.core(), Vec::new(), Vec::new());
    for face in Surface::from_shape(shape).faces {
        let first = vertices.len();
        vertices.extend(face.corners.iter().map(|corner| core[*corner]));
        for corner in first + 1..vertices.len().saturating_sub(1) {
            let [a, b, c] = [first, corner, corner + 1].map(|corner| vertices[corner]);
            let outward = (b - a).cross(&(c - a)).dot(&face.normal) >= 0.0;
            let ends = if outward { [corner, corner + 1] } else { [corner + 1, corner] };
            triangles.push([first, ends[0], ends[1]]);
        }
    }
    (vertices, triangles)
}

/// Number of directions around the axis of a round piece, and from pole to pole.
const AROUND: usize = 32;
const ACROSS: usize = 17;

/// Surface of a round convex piece: for each direction of a globe, the farthest point. The poles lie
/// along the longest diagonal of the core.
fn rounded(shape: &Shape) -> Mesh {
    let (core, radius) = (shape.core(), shape.radius());
    let along =
        core.iter().map(|point| point - core[0]).max_by(|a, b| a.norm().total_cmp(&b.norm()));
    let axis = along.and_then(|along| along.try_normalize(1e-12)).unwrap_or(Vector3::z());
    let (right, up) = across(&axis);
    let farthest = |direction: &Vector3<f64>| {
        let height = |point: &Vector3<f64>| direction.dot(point);
        core.iter().max_by(|a, b| height(a).total_cmp(&height(b))).copied().unwrap_or_default()
    };
    let mut vertices = Vec::with_capacity(AROUND * (ACROSS + 1));
    for row in 0..=ACROSS {
        // No row is the equator, whose farthest point on a capsule is ambiguous.
        let (sin, cos) = (PI * row as f64 / ACROSS as f64).sin_cos();
        for column in 0..AROUND {
            let (y, x) = (TAU * column as f64 / AROUND as f64).sin_cos();
            let direction = cos * axis + sin * (x * right + y * up);
            vertices.push(farthest(&direction) + radius * direction);
        }
    }
    let mut triangles = Vec::with_capacity(2 * AROUND * ACROSS);
    for row in 0..ACROSS {
        for column in 0..AROUND {
            let next = (column + 1) % AROUND;
            let at = |row: usize, column: usize| row * AROUND + column;
            let [a, b] = [at(row, column), at(row, next)];
            let [c, d] = [at(row + 1, column), at(row + 1, next)];
            triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    (vertices, triangles)
}

/// Two unit vectors that form a right-handed frame with an axis.
fn across(axis: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
    let least = Vector3::ith(axis.iamin(), 1.0);
    let up = axis.cross(&least).normalize();
    (up.cross(axis), up)
}

#[cfg(test)]
#[path = "tests/triangles.rs"]
mod tests;
