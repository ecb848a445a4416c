//! Check of the separate surfaces of a mesh: solids apart from each other, and cavities in them.

use crate::refused;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::TAU;
use tumble_core::error::Error;
use tumble_core::geometry::mesh::Mesh;

/// Maximum number of separate surfaces: each is compared with all triangles.
const MOST_SHELLS: usize = 500;

/// Maximum number of vertices by which the place of a surface is judged.
const SAMPLES: usize = 16;

/// Checks that no separate surface lies in a solid, except for the surface of a cavity, which is
/// inside-out.
pub fn refuse(mesh: &Mesh) -> Result<(), Error> {
    let (owner, count) = owners(mesh);
    if count > MOST_SHELLS {
        return Err(refused(format!(
            "has {count} separate surfaces; allowed: 1 to {MOST_SHELLS}; use a mesh of fewer parts"
        )));
    }
    let vertices = mesh.vertices();
    let corners =
        |three: &[usize; 3], from: &Vector3<f64>| three.map(|index| vertices[index] - from);
    let mut volumes = vec![0.0; count];
    let mut members = vec![Vec::new(); count];
    let from = vertices[mesh.triangles()[0][0]];
    for three in mesh.triangles() {
        let shell = owner[three[0]];
        volumes[shell] += Matrix3::from_columns(&corners(three, &from)).determinant();
        members[shell].push(three[0]);
    }
    for (shell, (volume, members)) in volumes.iter().zip(members).enumerate() {
        let is_turned = *volume < 0.0;
        let is_wrong = |&vertex: &usize| {
            let at = vertices[vertex];
            let others = mesh.triangles().iter().filter(|three| owner[three[0]] != shell);
            let angles = others.map(|three| solid_angle(&corners(three, &at)));
            let winding = angles.sum::<f64>() / (2.0 * TAU);
            (winding > 0.5) != is_turned
        };
        // A surface that touches another has vertices away from it.
        let spread = members.len().div_ceil(SAMPLES);
        if count > 1 && members.iter().step_by(spread).all(is_wrong) {
            let (what, remedy) = if is_turned {
                ("inside-out and not a cavity of a solid", "turn its facets")
            } else {
                ("inside a solid", "remove it, or turn its facets to make a cavity")
            };
            let at = vertices[members[0]];
            return Err(refused(format!(
                "has a separate surface that is {what}, near ({}, {}, {}); {remedy}",
                at.x, at.y, at.z
            )));
        }
    }
    Ok(())
}

/// Number of the surface of each vertex, and number of surfaces with triangles.
fn owners(mesh: &Mesh) -> (Vec<usize>, usize) {
    let mut parent: Vec<usize> = (0..mesh.vertices().len()).collect();
    for &[a, b, c] in mesh.triangles() {
        let first = root(&mut parent, a);
        for other in [b, c] {
            let other = root(&mut parent, other);
            parent[other] = first;
        }
    }
    let mut numbers = vec![usize::MAX; parent.len()];
    let mut count = 0;
    for &[a, _, _] in mesh.triangles() {
        let root = root(&mut parent, a);
        if numbers[root] == usize::MAX {
            numbers[root] = count;
            count += 1;
        }
    }
    let owner = (0..parent.len()).map(|vertex| numbers[root(&mut parent, vertex)]).collect();
    (owner, count)
}

/// Representative of the surface of a vertex. Shortens the path to it.
fn root(parent: &mut [usize], mut vertex: usize) -> usize {
    while parent[vertex] != vertex {
        parent[vertex] = parent[parent[vertex]];
        vertex = parent[vertex];
    }
    vertex
}

/// Signed solid angle of a triangle seen from the origin (van Oosterom and Strackee):
///
/// ```text
/// tan(Ω/2) = det(a, b, c)/(|a| |b| |c| + a·b |c| + b·c |a| + c·a |b|)
/// ```
fn solid_angle([a, b, c]: &[Vector3<f64>; 3]) -> f64 {
    let (p, q, r) = (a.norm(), b.norm(), c.norm());
    let below = p * q * r + a.dot(b) * r + b.dot(c) * p + c.dot(a) * q;
    2.0 * Matrix3::from_columns(&[*a, *b, *c]).determinant().atan2(below)
}
