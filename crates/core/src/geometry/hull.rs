//! Convex cores: a point, a segment, or a polyhedron with whole polygons as faces.

use super::planar::planar;
use super::polygons::{polygons, unresolved};
use super::segment::closest_on_segment;
use super::triangles::{FLAT, hull_triangles};
use crate::error::{Error, all_in_range, in_range};
use nalgebra::{Matrix3, Vector3};

/// Relative tolerance for coplanarity: neighbouring triangles within it become one face. The
/// corners of a rotated box leave their common plane by a few 1e-16 of its size.
const COPLANAR: f64 = 1e-9;

/// Largest number of vertices of a hull. The narrow phase visits all vertices and faces of a pair, so
/// larger hulls would be slow without a warning.
const MOST_VERTICES: usize = 1000;

/// Largest number of input points of a hull.
const MOST_POINTS: usize = 100_000;

/// An immutable convex core: a point (one vertex), a segment (two vertices, one edge) or a
/// polyhedron. Lengths are in m, in the frame of the body.
#[derive(Debug, Clone, PartialEq)]
pub struct Hull {
    vertices: Vec<Vector3<f64>>,
    faces: Vec<Face>,
    corners: Vec<Corner>,
    edges: Vec<Edge>,
    centre: Vector3<f64>,
    reach: f64,
}

/// One polygonal face of a polyhedron: all points x of the hull satisfy n·x ≤ d, with equality on
/// the face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Face {
    /// n: outward unit normal.
    pub normal: Vector3<f64>,
    /// d: plane offset (m).
    pub offset: f64,
    /// Area (m²).
    pub area: f64,
    first: u32,
    count: u32,
}

/// One corner in the loop of a face.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Corner {
    /// Index of the vertex.
    pub vertex: u32,
    /// Index of the edge from this corner to the next one of the loop.
    pub edge: u32,
}

/// One edge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Edge {
    /// Indices of its vertices, the smaller first.
    pub vertices: [u32; 2],
    /// Indices of the left and right face, seen from outside along the direction from the first to
    /// the second vertex. `None` for a segment. The edge runs along n_left × n_right, with n the
    /// normals.
    pub faces: Option<[u32; 2]>,
}

/// First vertex of an edge, and the vector to its second vertex.
pub(super) fn span(vertices: &[Vector3<f64>], edge: &Edge) -> (Vector3<f64>, Vector3<f64>) {
    let [from, to] = edge.vertices.map(|vertex| vertices[vertex as usize]);
    (from, to - from)
}

impl Hull {
    /// A single point: the core of a sphere.
    ///
    /// # Errors
    /// A coordinate beyond ±1e4 m.
    pub fn point(at: Vector3<f64>) -> Result<Self, Error> {
        check_coordinates(&[at])?;
        Ok(Self::with_vertices(vec![at], Vec::new()))
    }

    /// The segment between two points: the core of a capsule.
    ///
    /// # Errors
    /// A coordinate beyond ±1e4 m; a length below 1e-6 m.
    pub fn segment(from: Vector3<f64>, to: Vector3<f64>) -> Result<Self, Error> {
        check_coordinates(&[from, to])?;
        in_range("length of the segment (m)", (to - from).norm(), 1e-6, 4e4, "1e-6 to 4e4")?;
        let edge = Edge { vertices: [0, 1], faces: None };
        Ok(Self::with_vertices(vec![from, to], vec![edge]))
    }

    /// Convex hull of points (m).
    ///
    /// The vertices keep their order. Points inside the hull, on faces or on edges (to 1e-9 of the
    /// size) are left out. Neighbouring triangles that are coplanar to 1e-9 of the size become one
    /// face, and its corners move into its plane.
    ///
    /// # Errors
    /// Fewer than 4 points, more than 100 000, or more than 1000 vertices; a coordinate beyond ±1e4
    /// m; a largest extent below 1e-6 m; points that lie within 1e-5 of their extent in one plane.
    pub fn from_points(points: &[Vector3<f64>]) -> Result<Self, Error> {
        planar(Self::joined(points, COPLANAR)?, COPLANAR)
    }

    /// Convex hull of points with faces that are flat to the tolerance `coplanar`, relative to the size.
    pub(super) fn joined(points: &[Vector3<f64>], coplanar: f64) -> Result<Self, Error> {
        if !(4..=MOST_POINTS).contains(&points.len()) {
            let (field, count) = ("points of the hull", points.len());
            return Err(Error::Count { field, count, allowed: "4 to 100000" });
        }
        check_coordinates(points)?;
        let size = extent(points);
        in_range("largest extent of the hull (m)", size, 1e-6, 2e4, "1e-6 to 2e4")?;
        let flat = || {
            refused(format!(
                "is flat: its points lie within {FLAT:e} of its extent in one plane; give it a \
                 volume"
            ))
        };
        let triangles = hull_triangles(points).ok_or_else(flat)?;
        let loops = polygons(points, &triangles, coplanar * size)?;
        Self::from_loops(points, &loops)
    }

    /// Polyhedron with the given face loops, whose entries are indices into `points`.
    pub(super) fn from_loops(points: &[Vector3<f64>], loops: &[Vec<usize>]) -> Result<Self, Error> {
        let mut used: Vec<usize> = loops.iter().flatten().copied().collect();
        used.sort_unstable();
        used.dedup();
        if used.len() > MOST_VERTICES {
            let (field, count) = ("vertices of the hull", used.len());
            return Err(Error::Count { field, count, allowed: "4 to 1000" });
        }
        let renumbered = |point: &usize| used.binary_search(point).unwrap_or_default() as u32;
        let vertices = used.iter().map(|&point| points[point]).collect();
        let (mut faces, mut corners) = (Vec::new(), Vec::new());
        // All sides of all faces: (smaller vertex, larger vertex, right side?, corner, face).
        let mut sides = Vec::new();
        for (face, polygon) in loops.iter().enumerate() {
            let first = corners.len() as u32;
            for (at, point) in polygon.iter().enumerate() {
                let u = renumbered(point);
                let v = renumbered(&polygon[(at + 1) % polygon.len()]);
                sides.push((u.min(v), u.max(v), u > v, corners.len(), face as u32));
                corners.push(Corner { vertex: u, edge: 0 });
            }
            let (normal, area, offset) = (Vector3::zeros(), 0.0, 0.0);
            faces.push(Face { normal, offset, area, first, count: polygon.len() as u32 });
        }
        sides.sort_unstable();
        let mut edges = Vec::with_capacity(sides.len() / 2);
        // An edge has two sides in opposite directions, which are neighbours after sorting.
        for pair in sides.chunks(2) {
            let &[(u, v, false, left, left_face), (x, y, true, right, right_face)] = pair else {
                return Err(unresolved());
            };
            if (u, v) != (x, y) {
                return Err(unresolved());
            }
            corners[left].edge = edges.len() as u32;
            corners[right].edge = edges.len() as u32;
            edges.push(Edge { vertices: [u, v], faces: Some([left_face, right_face]) });
        }
        let mut hull = Self::with_vertices(vertices, edges);
        (hull.faces, hull.corners) = (faces, corners);
        hull.measure_faces();
        Ok(hull)
    }

    fn with_vertices(vertices: Vec<Vector3<f64>>, edges: Vec<Edge>) -> Self {
        let mut hull = Self {
            vertices,
            edges,
            faces: Vec::new(),
            corners: Vec::new(),
            centre: Vector3::zeros(),
            reach: 0.0,
        };
        hull.measure();
        hull
    }

    fn measure(&mut self) {
        self.centre = self.vertices.iter().sum::<Vector3<f64>>() / self.vertices.len() as f64;
        let distances = self.vertices.iter().map(|v| (v - self.centre).norm());
        self.reach = distances.fold(0.0, f64::max);
    }

    /// Computes normal, area and offset of every face from its loop. The area vector is
    ///
    /// ```text
    /// ½ Σ (v_i − v_0) × (v_{i+1} − v_0)
    /// ```
    fn measure_faces(&mut self) {
        for index in 0..self.faces.len() {
            let area: Vector3<f64> =
                self.fan(index).map(|[a, b, c]| (b - a).cross(&(c - a)) / 2.0).sum();
            let normal = area.normalize();
            let heights = self.polygon(index).map(|vertex| normal.dot(vertex));
            let offset = heights.fold(f64::NEG_INFINITY, f64::max);
            let face = &mut self.faces[index];
            (face.normal, face.offset, face.area) = (normal, offset, area.norm());
        }
    }

    /// Returns this hull rotated about the origin and then translated. `rotation` must be a proper
    /// rotation; [`Piece::moved_by`](super::Piece::moved_by) checks it.
    pub(super) fn moved_by(&self, rotation: &Matrix3<f64>, translation: &Vector3<f64>) -> Self {
        let mut moved = self.clone();
        for vertex in &mut moved.vertices {
            *vertex = rotation * *vertex + translation;
        }
        moved.measure();
        moved.measure_faces();
        moved
    }

    /// The vertices (m).
    pub fn vertices(&self) -> &[Vector3<f64>] {
        &self.vertices
    }

    /// The faces; empty for a point or a segment.
    pub fn faces(&self) -> &[Face] {
        &self.faces
    }

    /// The edges, sorted by their vertices; a segment has one and a point has none.
    pub fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// The loop of face `face`, counter-clockwise seen from outside.
    ///
    /// # Panics
    /// If there is no such face.
    pub fn face_loop(&self, face: usize) -> &[Corner] {
        let Face { first, count, .. } = self.faces[face];
        &self.corners[first as usize..(first + count) as usize]
    }

    /// The corners of face `face`, m, counter-clockwise seen from outside.
    ///
    /// # Panics
    /// If there is no such face.
    pub fn polygon(&self, face: usize) -> impl Iterator<Item = &Vector3<f64>> {
        self.face_loop(face).iter().map(|corner| &self.vertices[corner.vertex as usize])
    }

    /// Triangles of face `face`, fanned from its first corner.
    pub(super) fn fan(&self, face: usize) -> impl Iterator<Item = [Vector3<f64>; 3]> {
        let at = |corner: &Corner| self.vertices[corner.vertex as usize];
        let corners = self.face_loop(face);
        corners[1..].windows(2).map(move |two| [at(&corners[0]), at(&two[0]), at(&two[1])])
    }

    /// True if the projection of a point along the normal of face `face` is inside the face, on its
    /// boundary, or outside by at most `slack` (m).
    pub(super) fn is_over(&self, face: usize, point: &Vector3<f64>, slack: f64) -> bool {
        let corners = self.face_loop(face);
        let normal = &self.faces[face].normal;
        let mut from = &self.vertices[corners[corners.len() - 1].vertex as usize];
        corners.iter().all(|corner| {
            let to = &self.vertices[corner.vertex as usize];
            let along = to - from;
            let side = along.cross(&(point - from)).dot(normal);
            from = to;
            side >= 0.0 || side * side <= slack * slack * along.norm_squared()
        })
    }

    /// Point of face `face` that is nearest to a point (m).
    pub(crate) fn nearest_in_face(&self, face: usize, point: &Vector3<f64>) -> Vector3<f64> {
        let Face { normal, offset, .. } = self.faces[face];
        if self.is_over(face, point, 0.0) {
            return point - normal * (normal.dot(point) - offset);
        }
        let corners = self.face_loop(face).iter();
        let sides = corners.map(|corner| {
            let (from, along) = span(&self.vertices, &self.edges[corner.edge as usize]);
            closest_on_segment(point, &from, &along)
        });
        let distance = |at: &Vector3<f64>| (at - point).norm_squared();
        sides.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(*point)
    }

    /// True for a flat core: a triangle of a terrain.
    #[inline]
    pub(super) fn is_facet(&self) -> bool {
        self.faces.len() == 2
    }

    /// Mean of the vertices (m).
    pub fn centre(&self) -> &Vector3<f64> {
        &self.centre
    }

    /// Distance in m of the farthest vertex from the [centre](Self::centre).
    pub fn reach(&self) -> f64 {
        self.reach
    }
}

fn check_coordinates(points: &[Vector3<f64>]) -> Result<(), Error> {
    all_in_range(
        "coordinate of a shape's point (m)",
        points.iter().flatten(),
        -1e4,
        1e4,
        "-1e4 to 1e4",
    )?;
    Ok(())
}

/// Largest side of the bounding box of points (m).
pub(super) fn extent(points: &[Vector3<f64>]) -> f64 {
    let low = points.iter().fold(Vector3::repeat(f64::INFINITY), |low, p| low.inf(p));
    let high = points.iter().fold(Vector3::repeat(f64::NEG_INFINITY), |high, p| high.sup(p));
    (high - low).max()
}

fn refused(why: String) -> Error {
    Error::Shape { shape: "the hull", why }
}
