//! Cells of the parts of a mesh, by V-HACD.

use crate::refused;
use crate::settings::DecompositionSettings;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::transformation::vhacd::{VHACD, VHACDParameters};
use parry3d_f64::transformation::voxelization::{FillMode, VoxelSet};
use std::panic::catch_unwind;
use tumble_core::error::Error;
use tumble_core::geometry::mesh::Mesh;

/// Ratio of the largest number of parts to that of pieces, and of the allowed concavity of a piece
/// to that of a part. V-HACD halves parts one by one; merging small parts finds better pieces.
const FINER: u32 = 4;

/// Boxes whose interiors do not meet and that cover the mesh. Each contains one part.
pub fn cells(mesh: &Mesh, settings: &DecompositionSettings) -> Result<Vec<Aabb>, Error> {
    let (points, triangles) = arrays(mesh);
    let parameters = VHACDParameters {
        concavity: settings.concavity / f64::from(FINER),
        resolution: settings.resolution,
        max_convex_hulls: settings.pieces * FINER,
        // With `detect_cavities` parry 0.31.1 leaves the inside of a mesh empty.
        fill_mode: FillMode::FloodFill { detect_cavities: false },
        ..VHACDParameters::default()
    };
    // The convex hulls in parry can panic on degenerate voxels, see dimforge/parry#347.
    let found = catch_unwind(|| VHACD::decompose(&parameters, &points, &triangles, false));
    let found = found.map_err(|_| {
        let resolution = settings.resolution;
        refused(format!(
            "cannot be decomposed with the resolution {resolution}; use another resolution"
        ))
    })?;
    Ok(found.voxel_parts().iter().filter_map(cell).collect())
}

/// Vertices and triangles in the types of parry.
pub fn arrays(mesh: &Mesh) -> (Vec<Vector>, Vec<[u32; 3]>) {
    let points = mesh.vertices().iter().map(|p| Vector::new(p.x, p.y, p.z)).collect();
    // A mesh has at most 200 000 triangles.
    let triangles = mesh.triangles().iter().map(|three| three.map(|index| index as u32)).collect();
    (points, triangles)
}

/// Box of the voxels of a part; `None` without voxels. V-HACD cuts along the axes, so that the box
/// contains no voxel of another part.
fn cell(part: &VoxelSet) -> Option<Aabb> {
    let coordinates = || part.voxels().iter().map(|voxel| voxel.coords.as_dvec3());
    let (low, high) = (coordinates().reduce(Vector::min)?, coordinates().reduce(Vector::max)?);
    let at = |place: Vector| part.origin + place * part.scale;
    Some(Aabb::new(at(low - 0.5), at(high + 0.5)))
}
