//! Meshes of robots: of their vertices the convex hull counts.

use super::Reading;
use crate::geometry::Piece;
use crate::geometry::mesh::{Mesh, facets_of_obj, facets_of_stl};
use crate::scenario::shown;
use nalgebra::Vector3;
use std::collections::HashSet;
use std::path::Path;

/// More bytes than this are not read.
const LARGEST_MESH: u64 = 32 << 20;

/// The corners of the convex hull of a mesh, and whether the mesh is as large as it, so that its mass is known.
#[derive(Debug, Clone)]
pub struct Hulled {
    /// m.
    pub corners: Vec<[f64; 3]>,
    /// Whether the mesh is closed and convex.
    pub is_whole: bool,
}

/// The mesh of a file, its lengths along x, y and z multiplied.
pub fn read(reading: &Reading<'_>, name: &str, scale: [f64; 3]) -> Result<Hulled, String> {
    let odd = |why: &dyn std::fmt::Display| format!("mesh {:?}: {why}", shown::line(name));
    let extension = Path::new(name).extension().and_then(|end| end.to_str()).unwrap_or("");
    let facets = match &*extension.to_ascii_lowercase() {
        "stl" => facets_of_stl(&reading.bytes(name, LARGEST_MESH)?),
        "obj" => facets_of_obj(&reading.text(name, LARGEST_MESH)?),
        _ => {
            return Err(odd(&"only .stl and .obj are read; convert it, or give boxes or capsules"));
        }
    };
    let facets = facets.map_err(|error| odd(&error))?;
    let scale = Vector3::from(scale);
    let scaled = |facet: [Vector3<f64>; 3]| facet.map(|corner| corner.component_mul(&scale));
    let facets: Vec<_> = facets.into_iter().map(scaled).collect();
    let is_whole = Mesh::from_facets(&facets).and_then(|mesh| mesh.hull()).is_ok();
    let corners = facets.into_iter().flatten().map(|corner| corner.into());
    Ok(Hulled { is_whole, ..hull(corners).map_err(|why| odd(&why))? })
}

/// The convex hull of points (m).
pub fn hull(points: impl Iterator<Item = [f64; 3]>) -> Result<Hulled, String> {
    // Adding 0 turns −0 into 0, so that equal numbers have equal bits.
    let key = |point: &[f64; 3]| point.map(|x| (x + 0.0).to_bits());
    let mut known = HashSet::new();
    let points = points.filter(|point| known.insert(key(point)));
    let points: Vec<_> = points.map(Vector3::from).collect();
    let piece = Piece::hull(&points, 0.0).map_err(|error| error.to_string())?;
    let corners = piece.core().vertices().iter().map(|&corner| corner.into()).collect();
    Ok(Hulled { corners, is_whole: true })
}

/// The name of a file without folder and ending.
pub fn stem(file: &str) -> String {
    let stem = Path::new(file).file_stem();
    stem.map_or(String::new(), |stem| stem.to_string_lossy().into_owned())
}
