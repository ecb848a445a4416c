//! Meshes of robots: of their vertices the convex hull counts; for the eye their triangles.

use super::Reading;
use super::model::{Look, Surface};
use crate::geometry::Piece;
use crate::geometry::mesh::{Mesh, facets_of_obj, facets_of_stl};
use crate::scenario::shown;
use nalgebra::Vector3;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// More bytes than this are not read.
const LARGEST_MESH: u64 = 32 << 20;

/// Triangles of all looks of a robot, so that a page stays small.
pub const MOST_SEEN: usize = 20_000;

/// The corners of the convex hull of a mesh, and whether the mesh is as large as it, so that its mass is known.
#[derive(Debug, Clone)]
pub struct Hulled {
    /// m.
    pub corners: Vec<[f64; 3]>,
    /// Whether the mesh is closed and convex.
    pub is_whole: bool,
}

/// The facets of a file, their lengths along x, y and z multiplied.
fn facets(
    reading: &Reading<'_>,
    name: &str,
    scale: [f64; 3],
) -> Result<Vec<[Vector3<f64>; 3]>, String> {
    let odd = |why: &dyn std::fmt::Display| odd(name, why);
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
    Ok(facets.into_iter().map(scaled).collect())
}

fn odd(name: &str, why: &dyn std::fmt::Display) -> String {
    format!("mesh {:?}: {why}", shown::line(name))
}

/// The hull of the mesh of a file.
pub fn read(reading: &Reading<'_>, name: &str, scale: [f64; 3]) -> Result<Hulled, String> {
    let facets = facets(reading, name, scale)?;
    let is_whole = Mesh::from_facets(&facets).and_then(|mesh| mesh.hull()).is_ok();
    let corners = facets.into_iter().flatten().map(|corner| corner.into());
    Ok(Hulled { is_whole, ..hull(corners).map_err(|why| odd(name, &why))? })
}

/// The triangles of the mesh of a file, with those of the `others` no more than there may be.
pub fn surface(
    reading: &Reading<'_>,
    name: &str,
    scale: [f64; 3],
    others: &[Look],
) -> Result<Surface, String> {
    let facets = facets(reading, name, scale)?;
    let count = facets.len() + others.iter().map(Look::triangles).sum::<usize>();
    if count > MOST_SEEN {
        let why = format!("with its {} triangles there are more than {MOST_SEEN}", facets.len());
        return Err(odd(name, &why));
    }
    // A mirror turns triangles over.
    let is_mirrored = scale.iter().product::<f64>() < 0.0;
    let mut numbers = HashMap::new();
    let mut surface = Surface::default();
    for [a, b, c] in facets {
        let corners = if is_mirrored { [a, c, b] } else { [a, b, c] };
        surface.triangles.push(corners.map(|corner| {
            let corner = <[f64; 3]>::from(corner);
            *numbers.entry(bits(&corner)).or_insert_with(|| {
                surface.vertices.push(corner);
                surface.vertices.len() - 1
            })
        }));
    }
    Ok(surface)
}

/// Equal numbers have equal bits: adding 0 turns −0 into 0.
fn bits(point: &[f64; 3]) -> [u64; 3] {
    point.map(|x| (x + 0.0).to_bits())
}

/// The convex hull of points (m).
pub fn hull(points: impl Iterator<Item = [f64; 3]>) -> Result<Hulled, String> {
    let mut known = HashSet::new();
    let points = points.filter(|point| known.insert(bits(point)));
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
