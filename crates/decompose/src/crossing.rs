//! Check for a mesh that intersects itself.

use crate::parts::arrays;
use crate::refused;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};
use robust::{Coord3D, orient3d};
use tumble_core::error::Error;
use tumble_core::geometry::mesh::Mesh;

/// Checks that no edge passes through a triangle without a common vertex, from one side to the
/// other. The test is exact. Vertices may lie on other triangles.
pub fn refuse(mesh: &Mesh) -> Result<(), Error> {
    let (points, triangles) = arrays(mesh);
    let corners = |three: &[u32; 3]| three.map(|index| points[index as usize]);
    let boxes: Vec<_> = triangles.iter().map(|three| Aabb::from_points(corners(three))).collect();
    let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
    for (facet, three) in triangles.iter().enumerate() {
        let [a, b, c] = *three;
        // A closed mesh has every edge in both directions: one of them is enough.
        for (from, to) in [(a, b), (b, c), (c, a)].into_iter().filter(|(from, to)| from < to) {
            let edge = [from, to].map(|index| points[index as usize]);
            let crossed = |other: &u32| {
                let other = &triangles[*other as usize];
                !other.contains(&from) && !other.contains(&to) && passes(&edge, &corners(other))
            };
            let place = Aabb::from_points(edge);
            if let Some(other) = tree.intersect_aabb(&place).find(crossed) {
                let at = edge[0];
                return Err(refused(format!(
                    "intersects itself: an edge of facet {} passes through facet {} near ({}, {}, \
                     {}); repair the mesh, for example by a union of its parts",
                    facet + 1,
                    other + 1,
                    at.x,
                    at.y,
                    at.z
                )));
            }
        }
    }
    Ok(())
}

/// True if a segment passes through a triangle, from one side to the other.
fn passes([p, q]: &[Vector; 2], [a, b, c]: &[Vector; 3]) -> bool {
    let side = |a: &Vector, b: &Vector, c: &Vector, d: &Vector| {
        let [a, b, c, d] = [a, b, c, d].map(|p| Coord3D { x: p.x, y: p.y, z: p.z });
        orient3d(a, b, c, d)
    };
    if side(a, b, c, p) * side(a, b, c, q) >= 0.0 {
        return false;
    }
    let around = [side(p, q, a, b), side(p, q, b, c), side(p, q, c, a)];
    around.iter().all(|volume| *volume >= 0.0) || around.iter().all(|volume| *volume <= 0.0)
}
