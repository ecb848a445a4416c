//! Mesh simplification for drawing.
//!
//! Vertex clustering: the vertices in one cell of a grid are merged, and degenerate triangles are
//! dropped (Rossignac and Borrel 1993). The merged vertex minimises the distances to the planes of
//! its triangles (Lindstrom 2000), which preserves edges and corners.

use super::model::Surface;
use nalgebra::{Matrix3, Vector3};
use std::collections::{HashMap, HashSet};

/// Maximum number of grids to try.
const ATTEMPTS: usize = 12;
/// Fraction of the allowed triangles at which a grid is fine enough.
const ENOUGH: f64 = 0.85;
/// Fraction of the allowed triangles targeted by the next grid.
const AIM: f64 = 0.95;
/// Weight of the cell's mean against the planes. It resolves directions that the planes leave free.
const PULL: f64 = 1e-3;

/// Simplifies a surface to at most `most` triangles.
pub fn coarsened(surface: Surface, most: usize) -> Surface {
    if surface.triangles.len() <= most {
        return surface;
    }
    let surface = &surface;
    let area: f64 = surface.triangles.iter().map(|triangle| across(surface, triangle).norm()).sum();
    // A surface tiled by squares of this side has two triangles per square.
    let mut size = (area / most as f64).sqrt();
    let mut best: Option<(Clusters, Vec<[usize; 3]>)> = None;
    for _ in 0..ATTEMPTS {
        let clusters = Clusters::new(surface, size);
        let triangles = clusters.triangles(surface);
        let part = triangles.len() as f64 / most as f64;
        let fewest = best.as_ref().map_or(1, |(_, triangles)| triangles.len());
        if part <= 1.0 && triangles.len() >= fewest {
            best = Some((clusters, triangles));
        }
        if (ENOUGH..=1.0).contains(&part) {
            break;
        }
        size *= (part / AIM).sqrt().clamp(0.5, 2.0);
    }
    let (vertices, triangles) = match best {
        Some((clusters, triangles)) => (clusters.vertices(surface), triangles),
        None => (surface.vertices.clone(), largest(surface, most)),
    };
    Surface { total: surface.total, ..compact(&vertices, &triangles) }
}

/// Normal of a triangle with length twice its area.
fn across(surface: &Surface, triangle: &[usize; 3]) -> Vector3<f64> {
    let [a, b, c] = triangle.map(|corner| Vector3::from(surface.vertices[corner]));
    (b - a).cross(&(c - a))
}

/// The `most` largest triangles. Fallback for small separate pieces that all vanish in a grid.
fn largest(surface: &Surface, most: usize) -> Vec<[usize; 3]> {
    let mut triangles = surface.triangles.clone();
    let area = |triangle: &[usize; 3]| across(surface, triangle).norm();
    triangles.sort_by(|a, b| area(b).total_cmp(&area(a)));
    triangles.truncate(most);
    triangles
}

/// Surface without unused vertices.
fn compact(vertices: &[[f64; 3]], triangles: &[[usize; 3]]) -> Surface {
    let mut numbers = vec![None; vertices.len()];
    let mut made = Surface::default();
    for triangle in triangles {
        made.triangles.push(triangle.map(|corner| {
            *numbers[corner].get_or_insert_with(|| {
                made.vertices.push(vertices[corner]);
                made.vertices.len() - 1
            })
        }));
    }
    made
}

/// Grid of equal cells over a surface, at least two along each axis.
struct Grid {
    low: Vector3<f64>,
    /// Side lengths of a cell (m).
    sides: Vector3<f64>,
    /// Number of cells along each axis.
    counts: Vector3<f64>,
}

impl Grid {
    /// Grid with cells of about `size` (m).
    fn new(surface: &Surface, size: f64) -> Self {
        let vertices = || surface.vertices.iter().copied().map(Vector3::from);
        let low = vertices().reduce(|a, b| a.inf(&b)).unwrap_or_default();
        let high = vertices().reduce(|a, b| a.sup(&b)).unwrap_or_default();
        let counts = (high - low).map(|extent| (extent / size).ceil().max(2.0));
        Self { low, sides: (high - low).component_div(&counts), counts }
    }

    fn cell(&self, vertex: &[f64; 3]) -> [u32; 3] {
        let place = (Vector3::from(*vertex) - self.low).component_div(&self.sides);
        // An axis of zero extent yields NaN, which selects cell 0.
        [0, 1, 2].map(|axis| place[axis].min(self.counts[axis] - 1.0) as u32)
    }

    /// Projects a point to a cell.
    fn clamped(&self, cell: &[u32; 3], point: &Vector3<f64>) -> Vector3<f64> {
        let low = self.low + Vector3::from(*cell).map(f64::from).component_mul(&self.sides);
        point.sup(&low).inf(&(low + self.sides))
    }
}

/// Clusters of the vertices of a surface, one per occupied cell.
struct Clusters {
    grid: Grid,
    cells: Vec<[u32; 3]>,
    /// Index in `cells` of the cluster of each vertex.
    of: Vec<usize>,
}

impl Clusters {
    fn new(surface: &Surface, size: f64) -> Self {
        let grid = Grid::new(surface, size);
        let mut numbers = HashMap::new();
        let mut cells = Vec::new();
        let mut cluster = |vertex: &[f64; 3]| {
            let cell = grid.cell(vertex);
            *numbers.entry(cell).or_insert_with(|| {
                cells.push(cell);
                cells.len() - 1
            })
        };
        let of = surface.vertices.iter().map(&mut cluster).collect();
        Self { grid, cells, of }
    }

    /// Triangles between three distinct clusters, without duplicates.
    fn triangles(&self, surface: &Surface) -> Vec<[usize; 3]> {
        let mut known = HashSet::new();
        let clustered = surface.triangles.iter().filter_map(|triangle| {
            let mut corners = triangle.map(|corner| self.of[corner]);
            let [a, b, c] = corners;
            if a == b || b == c || c == a {
                return None;
            }
            // Rotates the smallest index to the front, which keeps the orientation.
            while corners[0] > corners[1] || corners[0] > corners[2] {
                corners.rotate_left(1);
            }
            known.insert(corners).then_some(corners)
        });
        clustered.collect()
    }

    /// Position of each cluster's vertex.
    fn vertices(&self, surface: &Surface) -> Vec<[f64; 3]> {
        let mut means = vec![(Vector3::zeros(), 0.0); self.cells.len()];
        for (vertex, cluster) in surface.vertices.iter().zip(&self.of) {
            means[*cluster].0 += Vector3::from(*vertex);
            means[*cluster].1 += 1.0;
        }
        let means: Vec<_> = means.into_iter().map(|(sum, count)| sum / count).collect();
        // Weighted least squares of the distances to the planes of the triangles, relative to the
        // mean.
        let mut planes = vec![(Matrix3::zeros(), Vector3::zeros()); self.cells.len()];
        for triangle in &surface.triangles {
            let across = across(surface, triangle);
            let Some(normal) = across.try_normalize(0.0) else { continue };
            let area = across.norm();
            let corner = Vector3::from(surface.vertices[triangle[0]]);
            for cluster in triangle.map(|corner| self.of[corner]) {
                planes[cluster].0 += normal * normal.transpose() * area;
                planes[cluster].1 += normal * (area * normal.dot(&(corner - means[cluster])));
            }
        }
        let vertex = |cluster: usize| {
            let (matrix, right) = planes[cluster];
            let pulled = matrix + Matrix3::identity() * (PULL * matrix.trace());
            let shift = pulled.cholesky().map_or(Vector3::zeros(), |factor| factor.solve(&right));
            self.grid.clamped(&self.cells[cluster], &(means[cluster] + shift)).into()
        };
        (0..self.cells.len()).map(vertex).collect()
    }
}

#[cfg(test)]
#[path = "tests/coarsening.rs"]
mod tests;
