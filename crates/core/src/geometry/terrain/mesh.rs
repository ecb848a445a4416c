//! Surfaces of triangles: open or closed meshes.

use super::check_placement;
use crate::error::{Error, all_in_range};
use crate::geometry::mesh::indexed;
use crate::geometry::{Aabb, Tree};
use nalgebra::{Matrix3, Vector3};
use std::collections::HashMap;

/// Largest number of triangles of a surface.
const MOST_TRIANGLES: usize = 10_000_000;

/// Height of a triangle over its longest side, relative to this side, below which it has no normal.
const FLAT: f64 = 1e-9;

/// Distance up to which vertices on borders of a file's facets are one, relative to the extent of the
/// surface. Single precision rounds a coordinate by at most 6·10⁻⁸ of it.
const SAME_VERTEX: f64 = 1e-6;

/// A surface of triangles, open or closed.
#[derive(Debug, Clone)]
pub struct Surface {
    vertices: Vec<Vector3<f64>>,
    triangles: Vec<[u32; 3]>,
    /// First entry of each vertex in `around`.
    starts: Vec<u32>,
    /// Triangles at each vertex.
    around: Vec<u32>,
    tree: Tree,
    joined: usize,
}

impl PartialEq for Surface {
    fn eq(&self, other: &Self) -> bool {
        (&self.vertices, &self.triangles) == (&other.vertices, &other.triangles)
    }
}

impl Surface {
    /// Surface of vertices (m) and triangles. The triangles have three vertex indices, and all are
    /// counter-clockwise seen from one side.
    ///
    /// # Errors
    /// - No triangle or more than 10 million; an index without a vertex.
    /// - A coordinate beyond ±1e4 m.
    /// - A triangle without area.
    /// - An edge of more than two triangles, or of two in the same direction.
    pub fn new(vertices: Vec<Vector3<f64>>, triangles: Vec<[u32; 3]>) -> Result<Self, Error> {
        let count = triangles.len();
        if !(1..=MOST_TRIANGLES).contains(&count) {
            let field = "triangles of the terrain";
            return Err(Error::Count { field, count, allowed: "1 to 10 million" });
        }
        let coordinates = vertices.iter().flatten();
        all_in_range("coordinate of the terrain (m)", coordinates, -1e4, 1e4, "-1e4 to 1e4")?;
        check_triangles(&vertices, &triangles)?;
        check_edges(&vertices, &triangles)?;
        let mut starts = vec![0_u32; vertices.len() + 1];
        for vertex in triangles.iter().flatten() {
            starts[*vertex as usize + 1] += 1;
        }
        for vertex in 0..vertices.len() {
            starts[vertex + 1] += starts[vertex];
        }
        let mut next = starts.clone();
        let mut around = vec![0; 3 * count];
        for (index, vertex) in triangles.iter().enumerate().flat_map(|(i, t)| t.map(|v| (i, v))) {
            around[next[vertex as usize] as usize] = index as u32;
            next[vertex as usize] += 1;
        }
        let boxes: Vec<_> = triangles.iter().map(|triangle| box_of(&vertices, triangle)).collect();
        Ok(Self { tree: Tree::new(&boxes), vertices, triangles, starts, around, joined: 0 })
    }

    /// Surface of facets with three corners each (m). Equal corners become one vertex, and so do corners
    /// on borders within 10⁻⁶ of the extent of the surface, unless the surface would be refused then.
    ///
    /// # Errors
    /// The errors of [`Surface::new`].
    pub fn from_facets(facets: &[[Vector3<f64>; 3]]) -> Result<Self, Error> {
        let (vertices, triangles) = indexed(facets);
        let triangles = triangles.into_iter().map(|three| three.map(|at| at as u32)).collect();
        let surface = Self::new(vertices, triangles)?;
        Ok(surface.joined_at_borders().unwrap_or(surface))
    }

    /// This surface with nearly equal vertices on borders as one; `None` if there are none.
    fn joined_at_borders(&self) -> Option<Self> {
        let Aabb { low, high } = self.bounds();
        let within = SAME_VERTEX * (high - low).amax();
        let mut same: Vec<u32> = (0..self.vertices.len() as u32).collect();
        // Vertices kept so far, by cubes of this side.
        let mut kept: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        let mut joined = 0;
        for vertex in self.border_vertices() {
            let place = self.vertices[vertex as usize];
            let [x, y, z] = (place / within).map(|at| at.floor() as i64).into();
            let around = [x - 1, x, x + 1].into_iter().flat_map(|x| {
                [y - 1, y, y + 1]
                    .into_iter()
                    .flat_map(move |y| [z - 1, z, z + 1].map(|z| [x, y, z]))
            });
            let mut near = around.filter_map(|cube| kept.get(&cube)).flatten().copied();
            let is_same = |other: &u32| (self.vertices[*other as usize] - place).norm() <= within;
            match near.find(is_same) {
                Some(other) => {
                    same[vertex as usize] = other;
                    joined += 1;
                }
                None => kept.entry([x, y, z]).or_default().push(vertex),
            }
        }
        let triangles = self.triangles.iter().map(|triangle| triangle.map(|v| same[v as usize]));
        let surface = Self::new(self.vertices.clone(), triangles.collect());
        (joined > 0).then_some(Self { joined, ..surface.ok()? })
    }

    /// Vertices on edges with one triangle.
    fn border_vertices(&self) -> Vec<u32> {
        let mut vertices = Vec::new();
        for triangle in &self.triangles {
            for (from, to) in [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (triangle[i], triangle[j])) {
                let shared = self.around(from as usize).iter();
                if shared.filter(|other| self.triangles[**other as usize].contains(&to)).count()
                    == 1
                {
                    vertices.extend([from, to]);
                }
            }
        }
        vertices.sort_unstable();
        vertices.dedup();
        vertices
    }

    /// This surface rotated about the origin and then translated (m).
    ///
    /// # Errors
    /// A matrix that is not a rotation to 1e-9; a coordinate of the translation beyond ±1e4 m, or of
    /// the result.
    pub fn moved_by(
        self,
        rotation: &Matrix3<f64>,
        translation: &Vector3<f64>,
    ) -> Result<Self, Error> {
        check_placement(rotation, translation)?;
        let vertices = self.vertices.iter().map(|vertex| rotation * vertex + translation).collect();
        Ok(Self { joined: self.joined, ..Self::new(vertices, self.triangles)? })
    }

    /// Number of vertices on borders that were joined to others ([`Surface::from_facets`]).
    pub fn joined(&self) -> usize {
        self.joined
    }

    /// The vertices (m).
    pub fn vertices(&self) -> &[Vector3<f64>] {
        &self.vertices
    }

    /// The triangles, as indices of vertices.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Calls `visit` on the triangles at the sides of a triangle.
    pub(super) fn each_beside(&self, triangle: usize, visit: &mut dyn FnMut(usize)) {
        let own = self.triangles[triangle];
        for (from, to) in [(own[0], own[1]), (own[1], own[2]), (own[2], own[0])] {
            for other in self.around(from as usize) {
                if *other as usize != triangle && self.triangles[*other as usize].contains(&to) {
                    visit(*other as usize);
                }
            }
        }
    }

    /// Triangles at a vertex.
    pub(super) fn around(&self, vertex: usize) -> &[u32] {
        &self.around[self.starts[vertex] as usize..self.starts[vertex + 1] as usize]
    }

    pub(super) fn bounds(&self) -> Aabb {
        let start = Vector3::repeat(f64::INFINITY);
        let used = self.triangles.iter().flatten().map(|vertex| self.vertices[*vertex as usize]);
        let (low, high) =
            used.fold((start, -start), |(low, high), at| (low.inf(&at), high.sup(&at)));
        Aabb { low, high }
    }

    /// Calls `visit` on the triangles in the leaves that `enters` accepts; see [`Tree::visit`].
    pub(super) fn visit<S>(
        &self,
        state: &mut S,
        enters: impl Fn(&S, &Aabb) -> bool,
        visit: impl FnMut(&mut S, usize),
    ) {
        self.tree.visit(state, enters, visit);
    }
}

fn box_of(vertices: &[Vector3<f64>], triangle: &[u32; 3]) -> Aabb {
    let [a, b, c] = triangle.map(|vertex| vertices[vertex as usize]);
    Aabb { low: a.inf(&b).inf(&c), high: a.sup(&b).sup(&c) }
}

fn check_triangles(vertices: &[Vector3<f64>], triangles: &[[u32; 3]]) -> Result<(), Error> {
    for (index, triangle) in triangles.iter().enumerate() {
        let facet = index + 1;
        if triangle.iter().any(|vertex| *vertex as usize >= vertices.len()) {
            let why = format!("has no vertices for facet {facet}; list all vertices");
            return Err(refused(why));
        }
        let [a, b, c] = triangle.map(|vertex| vertices[vertex as usize]);
        let longest = [b - a, c - b, a - c].iter().map(Vector3::norm_squared).fold(0.0, f64::max);
        let is_flat = (b - a).cross(&(c - a)).norm() <= FLAT * longest;
        if is_flat {
            return Err(refused(format!("has facet {facet} without area; remove it")));
        }
    }
    Ok(())
}

/// Checks that every edge has one triangle, or two in opposite directions.
fn check_edges(vertices: &[Vector3<f64>], triangles: &[[u32; 3]]) -> Result<(), Error> {
    let mut sides: Vec<(u32, u32, u32, bool)> = Vec::with_capacity(3 * triangles.len());
    for (index, [a, b, c]) in triangles.iter().enumerate() {
        for (from, to) in [(*a, *b), (*b, *c), (*c, *a)] {
            sides.push((from.min(to), from.max(to), index as u32 + 1, from < to));
        }
    }
    sides.sort_unstable();
    let edge = |side: &(u32, u32, u32, bool)| {
        let place = |vertex: u32| {
            let p = vertices[vertex as usize];
            format!("({}, {}, {})", p.x, p.y, p.z)
        };
        format!("the edge {} to {}", place(side.0), place(side.1))
    };
    for same in sides.chunk_by(|one, other| (one.0, one.1) == (other.0, other.1)) {
        match same {
            [] | [_] => {}
            [one, other] if one.3 != other.3 => {}
            [one, other] => {
                let (first, second) = (one.2, other.2);
                return Err(refused(format!(
                    "has {} in the same direction in facets {first} and {second}; list the \
                     vertices of all facets counter-clockwise seen from one side",
                    edge(one)
                )));
            }
            [one, ..] => {
                return Err(refused(format!(
                    "has {} in {} facets; split it so that an edge has at most two",
                    edge(one),
                    same.len()
                )));
            }
        }
    }
    Ok(())
}

fn refused(why: String) -> Error {
    Error::Shape { shape: "the terrain", why }
}

#[cfg(test)]
#[path = "tests/mesh.rs"]
mod tests;
