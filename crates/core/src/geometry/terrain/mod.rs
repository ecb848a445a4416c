//! Terrain: a fixed surface of triangles, a height field or a mesh.
//!
//! A terrain is touched from both sides. Each triangle is a flat convex [`Piece`]. Pieces of triangles
//! are made when a body comes near, and kept. A grid finds the triangles in a box by their place, a mesh
//! by a tree of boxes.
//!
//! Pieces are numbered: first the triangles, then the planes of their patches. A piece of a body that is over
//! the inside of a patch touches its plane, as large as the terrain, instead of many triangles.

mod cache;
mod grid;
mod mesh;
mod patches;

pub use grid::{HeightField, MOST_HEIGHTS};
pub use mesh::Surface;

use super::facet::facet;
use super::{Aabb, Piece};
use crate::error::Error;
use cache::Cache;
use nalgebra::{Matrix3, Vector3};

/// Distance of the corners of a plane's facet from its centre, over the diagonal of the terrain.
const CORNER: f64 = 4.0;
/// Distance of a point outside a triangle up to which it is on its border, over the length of the side.
const ON_BORDER: f64 = 1e-9;

/// A fixed surface of triangles (m, world). They are numbered from 0.
#[derive(Debug)]
pub struct Terrain {
    shape: TerrainShape,
    bounds: Aabb,
    pieces: Cache,
    /// First triangle of each triangle's patch; empty if all triangles are alone.
    patches: Vec<u32>,
}

/// Geometry of a terrain.
#[derive(Debug, Clone, PartialEq)]
pub enum TerrainShape {
    /// Heights on a grid.
    Field(HeightField),
    /// A mesh of triangles.
    Mesh(Surface),
}

impl PartialEq for Terrain {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other) || self.shape == other.shape
    }
}

impl From<TerrainShape> for Terrain {
    fn from(shape: TerrainShape) -> Self {
        let bounds = match &shape {
            TerrainShape::Field(field) => field.bounds(),
            TerrainShape::Mesh(mesh) => mesh.bounds(),
        };
        let count = match &shape {
            TerrainShape::Field(field) => field.count(),
            TerrainShape::Mesh(mesh) => mesh.triangles().len(),
        };
        let mut terrain =
            Self { shape, bounds, pieces: Cache::new(2 * count), patches: Vec::new() };
        let corners = |triangle| terrain.corners(triangle);
        let beside = |triangle, visit: &mut dyn FnMut(usize)| terrain.each_beside(triangle, visit);
        terrain.patches = patches::patches(count, corners, beside);
        terrain
    }
}

impl From<HeightField> for Terrain {
    fn from(field: HeightField) -> Self {
        TerrainShape::Field(field).into()
    }
}

impl From<Surface> for Terrain {
    fn from(mesh: Surface) -> Self {
        TerrainShape::Mesh(mesh).into()
    }
}

impl Terrain {
    /// The geometry.
    pub fn shape(&self) -> &TerrainShape {
        &self.shape
    }

    /// Number of triangles.
    pub fn count(&self) -> usize {
        self.pieces.count() / 2
    }

    /// Number of pieces: triangles, and planes with the numbers of the patches' first triangles after them.
    pub(crate) fn piece_count(&self) -> usize {
        self.pieces.count()
    }

    /// Bounding box (m).
    pub fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// Corners of a triangle (m), counter-clockwise seen from above.
    ///
    /// # Panics
    /// If there is no such triangle.
    pub fn corners(&self, triangle: usize) -> [Vector3<f64>; 3] {
        self.vertices(triangle).map(|vertex| self.vertex(vertex))
    }

    /// Piece of a triangle, or of the plane of a patch; `None` if there is none.
    pub fn piece(&self, number: usize) -> Option<&Piece> {
        self.pieces.get(number, || self.make(number).ok())
    }

    /// Triangle of a piece: for a plane the first one of the patch.
    pub(crate) fn triangle_of(&self, piece: usize) -> usize {
        if self.is_plane(piece) { piece - self.count() } else { piece }
    }

    /// True if a piece is the plane of a patch.
    pub(crate) fn is_plane(&self, piece: usize) -> bool {
        piece >= self.count()
    }

    /// Number of the plane of the patch with `triangle`.
    pub(crate) fn plane(&self, triangle: usize) -> usize {
        self.count() + self.patch(triangle)
    }

    /// First triangle of the patch of `triangle`: of the connected triangles in its plane.
    pub fn patch(&self, triangle: usize) -> usize {
        self.patches.get(triangle).map_or(triangle, |first| *first as usize)
    }

    fn make(&self, number: usize) -> Result<Piece, Error> {
        let [a, b, c] = self.corners(self.triangle_of(number));
        if !self.is_plane(number) {
            return Ok(Piece::from_core(facet([a, b, c])?, 0.0));
        }
        // An equilateral triangle around the terrain. Its incircle has half the radius of its corners.
        let (u, normal) = ((b - a).normalize(), (b - a).cross(&(c - a)).normalize());
        let centre = 0.5 * (self.bounds.low + self.bounds.high);
        let centre = centre - normal * normal.dot(&(centre - a));
        let far = CORNER * (self.bounds.high - self.bounds.low).norm();
        let (along, across) = (far * u, far * 0.75_f64.sqrt() * normal.cross(&u));
        let corners = [along, across - 0.5 * along, -across - 0.5 * along];
        Ok(Piece::from_core(facet(corners.map(|corner| centre + corner))?, 0.0))
    }

    /// Calls `visit` on the pieces that a convex body in the box `around` (m) may touch: the triangles as in
    /// [`Terrain::visit`], or the plane of their patch. `near` is a workspace.
    ///
    /// A plane cuts the box in a convex region R. The plane counts if no triangle of its patch in the box is
    /// at the patch's border, and if a point of R is in the patch: R has no border in it, so the
    /// patch covers R.
    pub(crate) fn visit_pieces(
        &self,
        around: &Aabb,
        near: &mut Vec<usize>,
        mut visit: impl FnMut(usize),
    ) {
        if self.patches.is_empty() {
            self.visit(around, visit);
            return;
        }
        near.clear();
        self.visit(around, |triangle| near.push(triangle));
        near.sort_unstable_by_key(|triangle| (self.patch(*triangle), *triangle));
        for patch in near.chunk_by(|one, other| self.patch(*one) == self.patch(*other)) {
            if self.covers(patch, around) {
                visit(self.plane(patch[0]));
            } else {
                patch.iter().for_each(|triangle| visit(*triangle));
            }
        }
    }

    /// True if the patch of the triangles `near`, all of it in the box `around` (m), covers the cut of its plane
    /// with the box.
    fn covers(&self, near: &[usize], around: &Aabb) -> bool {
        let is_inside = |triangle: &usize| {
            let mut beside = 0;
            self.each_beside(*triangle, &mut |other| {
                beside += usize::from(self.patch(other) == self.patch(*triangle));
            });
            beside == 3
        };
        if !near.iter().all(is_inside) {
            return false;
        }
        let [a, b, c] = self.corners(self.patch(near[0]));
        let normal = (b - a).cross(&(c - a)).normalize();
        let centre = 0.5 * (around.low + around.high);
        let foot = centre - normal * normal.dot(&(centre - a));
        let is_over = |triangle: &usize| {
            let [a, b, c] = self.corners(*triangle);
            [(a, b), (b, c), (c, a)].iter().all(|(from, to)| {
                let side = to - from;
                normal.dot(&side.cross(&(foot - from))) >= -ON_BORDER * side.norm_squared()
            })
        };
        around.meets(&Aabb { low: foot, high: foot }) && near.iter().any(is_over)
    }

    /// Calls `visit` on the triangles that may meet the box `around` (m): on those whose boxes meet it.
    /// The order depends on the terrain alone.
    pub fn visit(&self, around: &Aabb, mut visit: impl FnMut(usize)) {
        if !around.meets(&self.bounds) {
            return;
        }
        let around = &Aabb {
            low: around.low.sup(&self.bounds.low),
            high: around.high.inf(&self.bounds.high),
        };
        let mut visit_near = |triangle: usize| {
            if self.box_of(triangle).meets(around) {
                visit(triangle);
            }
        };
        match &self.shape {
            TerrainShape::Field(field) => field.visit(around, &mut visit_near),
            TerrainShape::Mesh(mesh) => mesh.visit(
                &mut (),
                |(), bounds| around.meets(bounds),
                |(), triangle| visit_near(triangle),
            ),
        }
    }

    /// First triangle that a ray from `origin` (m) along the unit vector `direction` meets within
    /// `length` (m): its distance (m) and its normal against the ray.
    pub fn enter(
        &self,
        origin: &Vector3<f64>,
        direction: &Vector3<f64>,
        length: f64,
    ) -> Option<(f64, Vector3<f64>)> {
        let mut nearest: Option<(f64, usize)> = None;
        let mut test = |triangle: usize| -> f64 {
            let limit = nearest.map_or(length, |(distance, _)| distance);
            let distance = crossing(&self.corners(triangle), origin, direction);
            match distance.filter(|distance| *distance <= limit) {
                Some(distance) => {
                    nearest = Some((distance, triangle));
                    distance
                }
                None => limit,
            }
        };
        match &self.shape {
            TerrainShape::Field(field) => field.walk(origin, direction, length, &mut test),
            TerrainShape::Mesh(mesh) => {
                let margin = 16.0 * f64::EPSILON * (origin.amax() + self.reach());
                mesh.visit(
                    &mut length.clone(),
                    |limit, bounds| bounds.entry(origin, direction, *limit, margin).is_some(),
                    |limit, triangle| *limit = test(triangle),
                );
            }
        }
        let (distance, triangle) = nearest?;
        let [a, b, c] = self.corners(triangle);
        let normal = (b - a).cross(&(c - a)).normalize();
        Some((distance, if normal.dot(direction) > 0.0 { -normal } else { normal }))
    }

    /// Largest absolute coordinate (m).
    fn reach(&self) -> f64 {
        self.bounds.low.amax().max(self.bounds.high.amax())
    }

    fn box_of(&self, triangle: usize) -> Aabb {
        let [a, b, c] = self.corners(triangle);
        Aabb { low: a.inf(&b).inf(&c), high: a.sup(&b).sup(&c) }
    }

    fn vertices(&self, triangle: usize) -> [usize; 3] {
        match &self.shape {
            TerrainShape::Field(field) => field.vertices(triangle),
            TerrainShape::Mesh(mesh) => mesh.triangles()[triangle].map(|vertex| vertex as usize),
        }
    }

    fn vertex(&self, vertex: usize) -> Vector3<f64> {
        match &self.shape {
            TerrainShape::Field(field) => field.vertex(vertex),
            TerrainShape::Mesh(mesh) => mesh.vertices()[vertex],
        }
    }

    /// Calls `visit` on the triangles at the sides of a triangle.
    fn each_beside(&self, triangle: usize, visit: &mut dyn FnMut(usize)) {
        match &self.shape {
            TerrainShape::Field(field) => field.each_beside(triangle, visit),
            TerrainShape::Mesh(mesh) => mesh.each_beside(triangle, visit),
        }
    }
}

/// Distance at which a ray crosses a triangle (m).
///
/// The ray passes inside if the volumes that it spans with the three sides have one sign:
///
/// ```text
/// d·((p_i − o) × (p_j − o)) ≥ 0   for all sides, or ≤ 0 for all
/// ```
///
/// Two triangles use the same numbers at their common side, so that no ray slips through.
fn crossing(
    corners: &[Vector3<f64>; 3],
    origin: &Vector3<f64>,
    direction: &Vector3<f64>,
) -> Option<f64> {
    let [a, b, c] = corners.map(|corner| corner - origin);
    let volumes = [a.cross(&b), b.cross(&c), c.cross(&a)].map(|area| area.dot(direction));
    let inside = volumes.iter().all(|v| *v >= 0.0) || volumes.iter().all(|v| *v <= 0.0);
    let normal = (b - a).cross(&(c - a));
    let sinks = normal.dot(direction);
    let distance = normal.dot(&a) / sinks;
    (inside && sinks != 0.0 && distance >= 0.0).then_some(distance)
}

/// Checks a rotation and a translation (m) of a terrain.
pub(super) fn check_placement(
    rotation: &Matrix3<f64>,
    translation: &Vector3<f64>,
) -> Result<(), Error> {
    use crate::error::{all_in_range, in_range};
    let defect = (rotation.tr_mul(rotation) - Matrix3::identity()).amax();
    in_range("error AᵀA − 1 of the terrain's rotation", defect, 0.0, 1e-9, "0 to 1e-9")?;
    in_range("determinant of the terrain's rotation", rotation.determinant(), 0.5, 1.5, "1")?;
    all_in_range("position of the terrain (m)", translation, -1e4, 1e4, "-1e4 to 1e4")?;
    Ok(())
}

#[cfg(test)]
#[path = "tests/mod.rs"]
mod tests;
