//! Triangle meshes, and their conversion to convex hulls.

#[cfg(feature = "mesh")]
mod files;

#[cfg(feature = "mesh")]
pub use files::{facets_of_obj, facets_of_stl, parse_obj, parse_stl};

use super::hull::{Hull, extent};
use super::planar::planar;
use crate::error::{Error, all_in_range, in_range};
use nalgebra::{Matrix3, Vector3};
use std::collections::HashMap;

/// Relative tolerance for the distance of a mesh from its convex hull and for coplanar triangles.
/// An STL file stores 24 bits of each coordinate: 6e-8 of it.
const CONVEX: f64 = 1e-6;

/// Largest number of triangles of a mesh.
const MOST_TRIANGLES: usize = 200_000;

/// A closed triangle mesh with triangles counter-clockwise seen from outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    vertices: Vec<Vector3<f64>>,
    triangles: Vec<[usize; 3]>,
}

impl Mesh {
    /// A mesh of vertices (m) and triangles. Each triangle has three vertex indices,
    /// counter-clockwise seen from outside.
    ///
    /// # Errors
    /// - Fewer than 4 or more than 200 000 triangles; an index without a vertex.
    /// - A coordinate beyond ±1e6.
    /// - A triangle that has a vertex twice.
    /// - An edge without exactly two triangles in opposite directions (the mesh is open, or a facet
    ///   is flipped).
    /// - A volume that is not positive (the mesh is inside-out).
    pub fn new(vertices: Vec<Vector3<f64>>, triangles: Vec<[usize; 3]>) -> Result<Self, Error> {
        if !(4..=MOST_TRIANGLES).contains(&triangles.len()) {
            let (field, count) = ("triangles of the mesh", triangles.len());
            return Err(Error::Count { field, count, allowed: "4 to 200000" });
        }
        all_in_range(
            "coordinate of the mesh (m)",
            vertices.iter().flatten(),
            -1e6,
            1e6,
            "-1e6 to 1e6",
        )?;
        let mesh = Self { vertices, triangles };
        mesh.check_edges()?;
        let volume = mesh.volume();
        if volume <= 0.0 {
            return Err(refused(format!(
                "is inside-out: its volume is {volume:.6e} m³; list the vertices of a facet \
                 counter-clockwise seen from outside"
            )));
        }
        Ok(mesh)
    }

    /// Mesh of facets, each with its three corners (m), counter-clockwise seen from outside. Equal
    /// corners become one vertex.
    ///
    /// # Errors
    /// The errors of [`Mesh::new`].
    pub fn from_facets(facets: &[[Vector3<f64>; 3]]) -> Result<Self, Error> {
        let (vertices, triangles) = indexed(facets);
        Self::new(vertices, triangles)
    }

    /// Checks that every edge occurs twice, once in each direction.
    fn check_edges(&self) -> Result<(), Error> {
        let mut sides = Vec::with_capacity(3 * self.triangles.len());
        for (index, &[a, b, c]) in self.triangles.iter().enumerate() {
            let facet = index + 1;
            let count = self.vertices.len();
            if [a, b, c].iter().any(|&vertex| vertex >= count) {
                return Err(refused(format!("has no vertices for facet {facet}")));
            }
            if a == b || b == c || c == a {
                return Err(refused(format!(
                    "has the same vertex twice in facet {facet}; three different vertices are \
                     needed"
                )));
            }
            sides.extend([(a, b, facet), (b, c, facet), (c, a, facet)]);
        }
        // Equal directed edges are neighbours after sorting.
        sides.sort_unstable();
        let place = |vertex: usize| {
            let p = self.vertices[vertex];
            format!("({}, {}, {})", p.x, p.y, p.z)
        };
        for two in sides.windows(2) {
            let ((a, b, first), (x, y, second)) = (two[0], two[1]);
            if (a, b) == (x, y) {
                return Err(refused(format!(
                    "has the edge {} to {} in the same direction in facets {first} and {second}; \
                     two facets per edge, both counter-clockwise seen from outside, are needed",
                    place(a),
                    place(b)
                )));
            }
        }
        // Each directed edge needs its opposite.
        for &(a, b, facet) in &sides {
            if sides.binary_search_by_key(&(b, a), |side| (side.0, side.1)).is_err() {
                return Err(refused(format!(
                    "is open: only facet {facet} has the edge {} to {}; a closed surface is needed",
                    place(a),
                    place(b)
                )));
            }
        }
        Ok(())
    }

    /// Enclosed volume (m³): Σ det(a − o, b − o, c − o)/6 over the triangles, with o a vertex.
    pub fn volume(&self) -> f64 {
        let o = self.vertices.first().copied().unwrap_or_default();
        let corner = |vertex: usize| self.vertices[vertex] - o;
        let six = self.triangles.iter().map(|&[a, b, c]| {
            Matrix3::from_columns(&[corner(a), corner(b), corner(c)]).determinant()
        });
        six.sum::<f64>() / 6.0
    }

    /// The vertices (m).
    pub fn vertices(&self) -> &[Vector3<f64>] {
        &self.vertices
    }

    /// The triangles: vertex indices, counter-clockwise seen from outside.
    pub fn triangles(&self) -> &[[usize; 3]] {
        &self.triangles
    }

    /// Returns this mesh with all lengths multiplied by `factor`, 0.001 for a file in mm.
    ///
    /// # Errors
    /// A factor outside 1e-6…1e6; resulting coordinates beyond ±1e6 m.
    pub fn scaled(&self, factor: f64) -> Result<Self, Error> {
        in_range("scale of the mesh", factor, 1e-6, 1e6, "1e-6 to 1e6")?;
        let vertices = self.vertices.iter().map(|vertex| vertex * factor).collect();
        Self::new(vertices, self.triangles.clone())
    }

    /// Convex hull of a convex mesh. Triangles coplanar to 1e-6 of the size become one face, and its
    /// corners move into its plane.
    ///
    /// # Errors
    /// The errors of [`Hull::from_points`]. A mesh that is not convex: a vertex deeper than 1e-6 of
    /// the size inside the hull, or a volume below the hull's by more than a skin of that
    /// thickness.
    pub fn hull(&self) -> Result<Hull, Error> {
        let hull = Hull::joined(&self.vertices, CONVEX)?;
        let skin = CONVEX * extent(&self.vertices);
        for vertex in &self.vertices {
            let heights = hull.faces().iter().map(|face| face.normal.dot(vertex) - face.offset);
            let depth = -heights.fold(f64::NEG_INFINITY, f64::max);
            if depth > skin {
                let at = format!("its vertex ({}, {}, {})", vertex.x, vertex.y, vertex.z);
                return Err(not_convex(&format!("{at} is {depth:.3e} m inside its convex hull")));
            }
        }
        let triangles = (0..hull.faces().len()).flat_map(|face| hull.fan(face));
        let o = hull.centre();
        let six = triangles.map(|t| Matrix3::from_columns(&t.map(|p| p - o)).determinant());
        let (whole, own) = (six.sum::<f64>() / 6.0, self.volume());
        let area: f64 = hull.faces().iter().map(|face| face.area).sum();
        if (whole - own).abs() > skin * area {
            return Err(not_convex(&format!(
                "its volume is {own:.6e} m³, the volume of its convex hull {whole:.6e} m³"
            )));
        }
        planar(hull, CONVEX)
    }
}

fn not_convex(what: &str) -> Error {
    refused(format!("is not convex: {what}; decompose it into convex pieces"))
}

fn refused(why: String) -> Error {
    Error::Shape { shape: "the mesh", why }
}

/// Vertices of facets, and the indices of their corners. Equal corners become one vertex.
pub(crate) fn indexed(facets: &[[Vector3<f64>; 3]]) -> (Vec<Vector3<f64>>, Vec<[usize; 3]>) {
    // Adding 0 turns −0 into 0, so that equal numbers have equal bits.
    let key = |p: &Vector3<f64>| [p.x + 0.0, p.y + 0.0, p.z + 0.0].map(f64::to_bits);
    let (mut numbers, mut vertices) = (HashMap::new(), Vec::new());
    let mut number = |corner: Vector3<f64>| {
        *numbers.entry(key(&corner)).or_insert_with(|| {
            vertices.push(corner);
            vertices.len() - 1
        })
    };
    let triangles = facets.iter().map(|facet| facet.map(&mut number)).collect();
    (vertices, triangles)
}
