//! Terrain: a fixed surface of triangles, a height field or a mesh.
//!
//! A terrain is touched from both sides. Each triangle is a flat convex [`Piece`]. Pieces of triangles
//! are made when a body comes near, and kept. A grid finds the triangles in a box by their place, a mesh
//! by a tree of boxes.

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
        let mut terrain = Self { shape, bounds, pieces: Cache::new(count), patches: Vec::new() };
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

    /// Piece of a triangle; `None` if there is no such triangle.
    pub fn piece(&self, triangle: usize) -> Option<&Piece> {
        self.pieces.get(triangle, || self.make(triangle).ok())
    }

    /// First triangle of the patch of `triangle`: of the connected triangles in its plane.
    pub fn patch(&self, triangle: usize) -> usize {
        self.patches.get(triangle).map_or(triangle, |first| *first as usize)
    }

    fn make(&self, triangle: usize) -> Result<Piece, Error> {
        Ok(Piece::from_core(facet(self.corners(triangle))?, 0.0))
    }

    /// Calls `visit` on the triangles that may meet the box `around` (m): on those whose boxes meet it,
    /// and on some beside them. The order depends on the terrain alone.
    pub fn visit(&self, around: &Aabb, mut visit: impl FnMut(usize)) {
        if !around.meets(&self.bounds) {
            return;
        }
        let around = &Aabb {
            low: around.low.sup(&self.bounds.low),
            high: around.high.inf(&self.bounds.high),
        };
        match &self.shape {
            TerrainShape::Field(field) => field.visit(around, &mut visit),
            TerrainShape::Mesh(mesh) => mesh.visit(
                &mut (),
                |(), bounds| around.meets(bounds),
                |(), triangle| {
                    if self.box_of(triangle).meets(around) {
                        visit(triangle);
                    }
                },
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
