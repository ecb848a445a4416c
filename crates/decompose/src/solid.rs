//! Solid of a closed mesh: what lies in a box, and distances from outside.

use crate::parts::arrays;
use crate::refused;
use nalgebra::Vector3;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::query::PointQuery;
use parry3d_f64::shape::{TriMesh, TriMeshFlags};
use tumble_core::error::Error;
use tumble_core::geometry::mesh::Mesh;

/// Closed mesh with a search tree.
pub struct Solid {
    surface: TriMesh,
}

impl Solid {
    pub fn new(mesh: &Mesh) -> Result<Self, Error> {
        let (points, triangles) = arrays(mesh);
        let surface = TriMesh::with_flags(points, triangles, TriMeshFlags::ORIENTED);
        let surface = surface.map_err(|error| refused(format!("cannot be used: {error}")))?;
        Ok(Self { surface })
    }

    /// Points whose convex hull is that of the solid within a box: the vertices of the clipped
    /// triangles and the corners of the box inside the solid, each once.
    pub fn points_in(&self, cell: &Aabb) -> Vec<Vector3<f64>> {
        let mut points: Vec<_> = cell.vertices().into();
        points.retain(|corner| self.surface.contains_local_point(*corner));
        let mut polygon = Vec::new();
        for triangle in self.surface.bvh().intersect_aabb(cell) {
            let triangle = self.surface.triangle(triangle);
            polygon.clear();
            polygon.extend([triangle.a, triangle.b, triangle.c]);
            cell.clip_polygon(&mut polygon);
            points.append(&mut polygon);
        }
        points.sort_unstable_by(|a, b| {
            a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z))
        });
        points.dedup();
        points.into_iter().map(|p| Vector3::new(p.x, p.y, p.z)).collect()
    }

    /// Distance of a point from the solid (m); 0 inside.
    pub fn distance(&self, point: &Vector3<f64>) -> f64 {
        let point = Vector::new(point.x, point.y, point.z);
        let nearest = self.surface.project_local_point(point, false);
        if nearest.is_inside { 0.0 } else { (point - nearest.point).length() }
    }

    /// True if a point is in the solid.
    pub fn contains(&self, point: &Vector3<f64>) -> bool {
        self.surface.contains_local_point(Vector::new(point.x, point.y, point.z))
    }

    /// Longest side of the bounding box (m).
    pub fn extent(&self) -> f64 {
        self.surface.local_aabb().extents().max_element()
    }
}
