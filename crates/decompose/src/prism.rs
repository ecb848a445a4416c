//! Exact convex parts of a prism: a solid between two equal parallel faces, as parts are that were extruded or
//! cut from a sheet.
//!
//! The triangles of one face are joined across inner edges while the polygons stay convex (Hertel and
//! Mehlhorn, 1983), which gives at most four times the least number of parts.

use crate::{MOST_CORNERS, MOST_CORNERS_OF_ALL};
use nalgebra::{Vector2, Vector3};
use std::collections::BTreeMap;
use tumble_core::geometry::mesh::Mesh;

/// Distance at which points count as equal, relative to the size of the mesh. Files in single precision
/// have errors of 1e-7.
const EQUAL: f64 = 1e-6;
/// Largest number of normals that are tried as the direction of the prism.
const MOST_DIRECTIONS: usize = 8;

/// Corners of convex parts that fill the solid of `mesh`, of the size `extent` (m); `None` if it is no prism, or
/// has too many vertices.
pub fn parts(mesh: &Mesh, extent: f64) -> Option<Vec<Vec<Vector3<f64>>>> {
    let vertices = mesh.vertices();
    // Every vertex is a corner of a part.
    if vertices.len() > MOST_CORNERS_OF_ALL {
        return None;
    }
    let equal = EQUAL * extent;
    let area = |[a, b, c]: &[usize; 3]| {
        (vertices[*b] - vertices[*a]).cross(&(vertices[*c] - vertices[*a]))
    };
    let mut areas: Vec<_> = mesh.triangles().iter().map(area).collect();
    areas.sort_by(|a, b| b.norm().total_cmp(&a.norm()));
    let mut directions: Vec<Vector3<f64>> = Vec::new();
    for normal in areas.iter().filter_map(|area| area.try_normalize(0.0)) {
        if directions.iter().all(|known| known.dot(&normal).abs() < 1.0 - EQUAL) {
            directions.push(normal);
        }
        if directions.len() == MOST_DIRECTIONS {
            break;
        }
    }
    directions.iter().find_map(|direction| along(mesh, direction, equal))
}

/// The parts of a prism along `direction` (unit).
fn along(mesh: &Mesh, direction: &Vector3<f64>, equal: f64) -> Option<Vec<Vec<Vector3<f64>>>> {
    let vertices = mesh.vertices();
    let heights: Vec<_> = vertices.iter().map(|vertex| direction.dot(vertex)).collect();
    let low = heights.iter().copied().fold(f64::INFINITY, f64::min);
    let high = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let is_low = |vertex: usize| heights[vertex] - low <= equal;
    let is_high = |vertex: usize| high - heights[vertex] <= equal;
    if high - low <= 4.0 * equal || !(0..vertices.len()).all(|k| is_low(k) || is_high(k)) {
        return None;
    }
    // Each vertex has one opposite to it.
    let up = (high - low) * direction;
    let opposite = |vertex: usize| {
        let place = vertices[vertex] - up;
        let others = (0..vertices.len()).filter(|other| is_low(*other));
        others.into_iter().find(|other| (vertices[*other] - place).norm() <= 2.0 * equal)
    };
    let tops: Vec<_> = (0..vertices.len()).filter(|vertex| is_high(*vertex)).collect();
    let opposites: BTreeMap<_, _> =
        tops.iter().map(|top| Some((*top, opposite(*top)?))).collect::<Option<_>>()?;
    if 2 * opposites.len() != vertices.len() {
        return None;
    }
    let across = direction.cross(&least_aligned(direction)).normalize();
    let axes = [across, direction.cross(&across)];
    let flat = |vertex: usize| Vector2::from(axes.map(|axis| axis.dot(&vertices[vertex])));
    let faces = mesh.triangles().iter().filter(|triangle| triangle.iter().all(|k| is_high(*k)));
    let polygons = joined(faces.map(|triangle| triangle.to_vec()).collect(), flat);
    let corners = |polygon: Vec<usize>| {
        polygon.iter().flat_map(|top| [vertices[*top], vertices[opposites[top]]]).collect()
    };
    Some(polygons.into_iter().map(corners).collect())
}

/// Joins counter-clockwise polygons, the longest common edges first, while the result is convex and has not
/// too many corners. `at` places a corner.
fn joined(mut polygons: Vec<Vec<usize>>, at: impl Fn(usize) -> Vector2<f64>) -> Vec<Vec<usize>> {
    let length = |[from, to]: [usize; 2]| (at(to) - at(from)).norm();
    let edges = |polygon: &[usize]| {
        let next = polygon.iter().cycle().skip(1);
        polygon.iter().zip(next).map(|(from, to)| [*from, *to]).collect::<Vec<_>>()
    };
    let mut owners = BTreeMap::new();
    for (number, polygon) in polygons.iter().enumerate() {
        owners.extend(edges(polygon).into_iter().map(|edge| (edge, number)));
    }
    let inner = |edge: &[usize; 2]| edge[0] < edge[1] && owners.contains_key(&[edge[1], edge[0]]);
    let mut common: Vec<_> = owners.keys().copied().filter(inner).collect();
    common.sort_by(|a, b| length(*b).total_cmp(&length(*a)));
    for [from, to] in common {
        let [one, other] = [owners[&[from, to]], owners[&[to, from]]];
        if one == other {
            continue;
        }
        let union = union(&polygons[one], &polygons[other], [from, to]);
        if 2 * union.len() > MOST_CORNERS || !is_convex(&union, &at) {
            continue;
        }
        owners.extend(edges(&union).into_iter().map(|edge| (edge, one)));
        polygons[one] = union;
        polygons[other].clear();
    }
    polygons.retain(|polygon| !polygon.is_empty());
    polygons
}

/// Corners of two polygons around without their common edge, which the first has in this direction.
fn union(one: &[usize], other: &[usize], [from, to]: [usize; 2]) -> Vec<usize> {
    let begins = |polygon: &[usize], corner: usize| polygon.iter().position(|k| *k == corner);
    let (Some(start), Some(end)) = (begins(one, to), begins(other, from)) else {
        return Vec::new();
    };
    let around = |polygon: &[usize], start: usize| {
        polygon[start..].iter().chain(&polygon[..start]).copied().take(polygon.len() - 1).collect()
    };
    let parts: [Vec<usize>; 2] = [around(one, start), around(other, end)];
    parts.concat()
}

/// True if a counter-clockwise polygon turns left, or not at all, at each corner.
fn is_convex(polygon: &[usize], at: &impl Fn(usize) -> Vector2<f64>) -> bool {
    let count = polygon.len();
    (0..count).all(|k| {
        let [before, here, after] = [count - 1, 0, 1].map(|shift| at(polygon[(k + shift) % count]));
        let (first, second) = (here - before, after - here);
        first.perp(&second) >= -EQUAL * first.norm() * second.norm()
    })
}

/// The coordinate axis that is least aligned with a direction.
fn least_aligned(direction: &Vector3<f64>) -> Vector3<f64> {
    let mut axis = Vector3::zeros();
    axis[direction.map(f64::abs).imin()] = 1.0;
    axis
}
