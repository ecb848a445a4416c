//! Exact convex parts of a mesh with few planar faces: its bounding box, cut along the planes of faces
//! until no part of a face is inside a cell. A cell is then in the solid or outside.

use crate::solid::Solid;
use nalgebra::Vector3;
use tumble_core::geometry::mesh::Mesh;

/// Largest numbers of planes and of cells.
const MOST_PLANES: usize = 48;
const MOST_CELLS: usize = 256;
/// Distance at which points count as equal, relative to the size of the mesh. Files in single precision
/// have errors of 1e-7.
const EQUAL: f64 = 1e-6;
/// Cosine of the largest angle between the normals of triangles in one plane.
const PARALLEL: f64 = 0.999;

type Polygon = Vec<Vector3<f64>>;

#[derive(Debug, Clone, Copy)]
struct Plane {
    normal: Vector3<f64>,
    offset: f64,
}

impl Plane {
    fn through(triangle: &[Vector3<f64>]) -> Self {
        let normal = area_vector(triangle).normalize();
        Self { normal, offset: normal.dot(&triangle[0]) }
    }

    fn height(&self, point: &Vector3<f64>) -> f64 {
        self.normal.dot(point) - self.offset
    }

    /// Parts of a convex polygon above and below the plane. Points within `equal` (m) belong to both, and
    /// a part without others is empty.
    fn split(&self, polygon: &Polygon, equal: f64) -> [Polygon; 2] {
        [1.0, -1.0].map(|side| {
            let height = |point: &Vector3<f64>| side * self.height(point);
            let mut part = Polygon::new();
            for (k, point) in polygon.iter().enumerate() {
                let next = &polygon[(k + 1) % polygon.len()];
                let (from, to) = (height(point), height(next));
                if from >= -equal {
                    part.push(*point);
                }
                if from.abs() > equal && to.abs() > equal && from * to < 0.0 {
                    part.push(point + from / (from - to) * (next - point));
                }
            }
            let has_volume = part.iter().any(|point| height(point) > equal);
            if has_volume && part.len() > 2 { part } else { Polygon::new() }
        })
    }
}

/// Twice the area of a planar polygon, along its normal.
fn area_vector(polygon: &[Vector3<f64>]) -> Vector3<f64> {
    polygon.windows(2).map(|pair| (pair[0] - polygon[0]).cross(&(pair[1] - polygon[0]))).sum()
}

/// Convex cell with the parts of the mesh's faces inside it, each with the number of its plane.
struct Cell {
    sides: Vec<Polygon>,
    faces: Vec<(Polygon, usize)>,
}

impl Cell {
    fn corners(&self) -> impl Iterator<Item = &Vector3<f64>> {
        self.sides.iter().flatten()
    }

    /// The two parts of the cell beside the plane `number`; a part without a volume is `None`.
    fn split(&self, planes: &[Plane], number: usize, equal: f64) -> [Option<Self>; 2] {
        let plane = &planes[number];
        let mut parts = [const { (Vec::new(), Vec::new()) }; 2];
        for side in &self.sides {
            let pieces = plane.split(side, equal);
            parts.iter_mut().zip(pieces).for_each(|(part, piece)| part.0.push(piece));
        }
        for (face, of) in self.faces.iter().filter(|(_, of)| *of != number) {
            let pieces = plane.split(face, equal);
            parts.iter_mut().zip(pieces).for_each(|(part, piece)| part.1.push((piece, *of)));
        }
        parts.map(|(mut sides, mut faces)| {
            sides.retain(|side| !side.is_empty());
            faces.retain(|(face, _)| !face.is_empty());
            sides.push(cut(plane, &sides, equal));
            let has_volume = sides.len() > 3 && sides.last().is_some_and(|cut| cut.len() > 2);
            has_volume.then_some(Self { sides, faces })
        })
    }

    /// Plane of a face that cuts the fewest other faces; `None` without faces.
    fn best_plane(&self, planes: &[Plane], equal: f64) -> Option<usize> {
        let cuts = |number: usize| {
            let heights = |face: &Polygon, side: f64| {
                face.iter().any(|point| side * planes[number].height(point) > equal)
            };
            self.faces.iter().filter(|(face, _)| heights(face, 1.0) && heights(face, -1.0)).count()
        };
        let mut numbers: Vec<_> = self.faces.iter().map(|(_, number)| *number).collect();
        numbers.sort_unstable();
        numbers.dedup();
        numbers.into_iter().min_by_key(|number| cuts(*number))
    }
}

/// Side of a cell in the `plane` that cuts it: the points of its other sides in the plane, in order.
fn cut(plane: &Plane, sides: &[Polygon], equal: f64) -> Polygon {
    let on_plane = sides.iter().flatten().filter(|point| plane.height(point).abs() <= equal);
    let mut points = Polygon::new();
    for point in on_plane {
        if points.iter().all(|other| (other - point).norm() > equal) {
            points.push(*point);
        }
    }
    let centre = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
    let first = points.first().map_or(Vector3::x(), |point| point - centre);
    let second = plane.normal.cross(&first);
    let angle = |point: &Vector3<f64>| {
        let arm = point - centre;
        second.dot(&arm).atan2(first.dot(&arm))
    };
    points.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    points
}

/// Corners of convex parts that fill the solid of `mesh` exactly; `None` if it has many planes or cells.
pub fn parts(mesh: &Mesh, solid: &Solid) -> Option<Vec<Polygon>> {
    let equal = EQUAL * solid.extent();
    let vertices = mesh.vertices();
    let mut triangles: Vec<Polygon> = mesh
        .triangles()
        .iter()
        .map(|three| three.iter().map(|index| vertices[*index]).collect())
        .collect();
    // The planes of large triangles are the most exact ones.
    let size = |triangle: &Polygon| area_vector(triangle).norm();
    triangles.sort_by(|a, b| size(b).total_cmp(&size(a)));
    let mut planes: Vec<Plane> = Vec::new();
    let mut faces = Vec::new();
    for triangle in triangles.into_iter().filter(|triangle| size(triangle) > equal * equal) {
        let own = Plane::through(&triangle);
        let fits = |plane: &Plane| {
            plane.normal.dot(&own.normal).abs() > PARALLEL
                && triangle.iter().all(|point| plane.height(point).abs() <= equal)
        };
        let number = planes.iter().position(fits).unwrap_or(planes.len());
        if number == planes.len() {
            planes.push(own);
        }
        if planes.len() > MOST_PLANES {
            return None;
        }
        faces.push((triangle, number));
    }
    let mut open = vec![Cell { sides: box_around(vertices, solid.extent()), faces }];
    let mut parts = Vec::new();
    let mut count = 0;
    while let Some(cell) = open.pop() {
        if let Some(number) = cell.best_plane(&planes, equal) {
            open.extend(cell.split(&planes, number, equal).into_iter().flatten());
            continue;
        }
        count += 1;
        if count + open.len() > MOST_CELLS {
            return None;
        }
        let corners = cell.corners().count() as f64;
        if solid.contains(&(cell.corners().sum::<Vector3<f64>>() / corners)) {
            let nearest = |corner: &Vector3<f64>| {
                let own = vertices.iter().find(|vertex| (*vertex - corner).norm() <= 2.0 * equal);
                own.copied().unwrap_or(*corner)
            };
            parts.push(cell.corners().map(nearest).collect());
        }
    }
    Some(parts)
}

/// Sides of a box around points, with a distance of their `extent` from them (m).
fn box_around(points: &[Vector3<f64>], extent: f64) -> Vec<Polygon> {
    let low = points.iter().copied().reduce(|a, b| a.inf(&b)).unwrap_or_default();
    let high = points.iter().copied().reduce(|a, b| a.sup(&b)).unwrap_or_default();
    let ends = [low.add_scalar(-extent), high.add_scalar(extent)];
    let side = |axis: usize, end: usize| {
        [[0, 0], [1, 0], [1, 1], [0, 1]]
            .into_iter()
            .map(|[a, b]| {
                let mut corner = Vector3::zeros();
                corner[axis] = ends[end][axis];
                corner[(axis + 1) % 3] = ends[a][(axis + 1) % 3];
                corner[(axis + 2) % 3] = ends[b][(axis + 2) % 3];
                corner
            })
            .collect()
    };
    (0..3).flat_map(|axis| [0, 1].map(|end| side(axis, end))).collect()
}
