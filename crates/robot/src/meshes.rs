//! Meshes of robots: the convex hull for collision, the triangles for drawing.

use super::coarsening::coarsened;
use super::mass::enclosed;
use super::model::{LinkMass, LookForm, RobotLook, Surface};
use super::painted::{Facet, Painted};
use super::{Reading, collada, gltf, msh};
use crate::xml::Parsed;
use nalgebra::{Matrix3, Vector3};
use std::collections::{HashMap, HashSet};
use std::path::Path;
use tumble_core::error::Error;
use tumble_core::geometry::Piece;
use tumble_core::geometry::mesh::{Mesh, facets_of_obj, facets_of_stl};
use tumble_decompose::{DecompositionSettings, decompose, grown, reduced};
use tumble_model::{NO_FILES, READS_FILES, shown};

/// Maximum size of a mesh file (bytes).
const LARGEST_MESH: u64 = 32 << 20;

/// Maximum number of triangles in all visual meshes of a robot, about 3 MB of a page.
const MOST_SEEN: usize = 20_000;

/// Source of the mass properties of a mesh.
#[derive(Debug, Clone)]
pub enum Volume {
    /// Its hull. The mesh is closed and convex, or consists of points only.
    Hull,
    /// The volume enclosed by its triangles, see [`enclosed`].
    Triangles(Box<[LinkMass; 2]>),
    /// Unknown, since the triangles are not read.
    Unknown,
}

/// Convex hull of a mesh, and source of its mass properties.
#[derive(Debug, Clone)]
pub struct Hulled {
    /// Vertices of the hull (m).
    pub corners: Vec<[f64; 3]>,
    /// Source of the mass properties.
    pub volume: Volume,
    /// Largest distance of mesh points outside the planes of the hull (m). It is positive if the
    /// exact hull exceeds the vertex limit of a piece.
    pub outside: f64,
    /// Thickness added to a planar mesh (m); 0 otherwise.
    pub thickened: f64,
}

/// Extension of a file name, in lower case.
fn extension(name: &str) -> String {
    let extension = Path::new(name).extension().and_then(|end| end.to_str()).unwrap_or("");
    extension.to_ascii_lowercase()
}

/// Triangles of a file, scaled along x, y and z.
fn painted(reading: &Reading<'_>, name: &str, scale: [f64; 3]) -> Parsed<Vec<Painted>> {
    let bad_mesh = |why: &dyn std::fmt::Display| bad_mesh(name, why);
    let plain = |facets| vec![Painted { colour: None, facets }];
    let facets = match &*extension(name) {
        "stl" => facets_of_stl(&reading.bytes(name, LARGEST_MESH)?).map(plain),
        "obj" => facets_of_obj(&reading.text(name, LARGEST_MESH)?).map(plain),
        "msh" => msh::facets(&reading.bytes(name, LARGEST_MESH)?).map(plain),
        "glb" => {
            Ok(gltf::facets(&reading.bytes(name, LARGEST_MESH)?).map_err(|why| bad_mesh(&why))?)
        }
        "dae" => {
            Ok(collada::triangles(&reading.text(name, LARGEST_MESH)?)
                .map_err(|why| bad_mesh(&why))?)
        }
        _ => {
            let why = "only .stl, .obj, .msh, .glb and .dae are supported; convert it, or use \
                       boxes or capsules";
            return Err(bad_mesh(&why));
        }
    };
    let mut groups = facets.map_err(|error| bad_mesh(&error))?;
    let by = Vector3::from(scale);
    for facet in groups.iter_mut().flat_map(|group| &mut group.facets) {
        *facet = turned_back(facet.map(|corner| corner.component_mul(&by)), scale);
    }
    Ok(groups)
}

/// Vertices of a scaled triangle. A mirroring scale reverses their order.
pub fn turned_back<T>([a, b, c]: [T; 3], scale: [f64; 3]) -> [T; 3] {
    if scale.iter().product::<f64>() < 0.0 { [a, c, b] } else { [a, b, c] }
}

fn bad_mesh(name: &str, why: &dyn std::fmt::Display) -> String {
    format!("mesh {:?}: {why}", shown::line(name))
}

/// Reads a mesh file and computes its hull.
pub fn read(reading: &Reading<'_>, name: &str, scale: [f64; 3]) -> Parsed<Hulled> {
    if !READS_FILES {
        return Err(bad_mesh(name, &NO_FILES));
    }
    if extension(name) == "dae" {
        let points = collada::points(&reading.text(name, LARGEST_MESH)?);
        let points = points.map_err(|why| bad_mesh(name, &why))?.into_iter();
        let points = points.map(|point| point.component_mul(&Vector3::from(scale)).into());
        return Ok(Hulled {
            volume: Volume::Unknown,
            ..hull(points).map_err(|why| bad_mesh(name, &why))?
        });
    }
    let groups = painted(reading, name, scale)?;
    let facets: Vec<_> = groups.into_iter().flat_map(|group| group.facets).collect();
    hull_from_facets(&facets).map_err(|why| bad_mesh(name, &why))
}

/// Reads a closed mesh file and decomposes the mesh. Returns the vertices of each piece.
pub fn decomposed(
    reading: &Reading<'_>,
    name: &str,
    scale: [f64; 3],
    settings: &DecompositionSettings,
) -> Parsed<Vec<Vec<[f64; 3]>>> {
    if !READS_FILES {
        return Err(bad_mesh(name, &NO_FILES));
    }
    let groups = painted(reading, name, scale)?;
    let facets: Vec<_> = groups.into_iter().flat_map(|group| group.facets).collect();
    let pieces = Mesh::from_facets(&facets).and_then(|mesh| decompose(&mesh, settings));
    let pieces = pieces.map_err(|error| bad_mesh(name, &error))?;
    let corners =
        |piece: &Piece| piece.core().vertices().iter().map(|&corner| corner.into()).collect();
    Ok(pieces.iter().map(corners).collect())
}

/// Hull of triangles that are counter-clockwise seen from outside. Lengths are in m.
pub fn hull_from_facets(facets: &[[Vector3<f64>; 3]]) -> Parsed<Hulled> {
    let hulled = hull(facets.iter().flatten().map(|corner| (*corner).into()))?;
    if hulled.thickened > 0.0 {
        return Ok(hulled);
    }
    let is_whole =
        hulled.outside == 0.0 && Mesh::from_facets(facets).and_then(|mesh| mesh.hull()).is_ok();
    let volume =
        if is_whole { Volume::Hull } else { Volume::Triangles(Box::new(enclosed(facets))) };
    Ok(Hulled { volume, ..hulled })
}

/// Surface of one colour.
#[derive(Debug, Clone)]
pub struct PaintedSurface {
    pub colour: Option<[u8; 3]>,
    pub surface: Surface,
}

/// Triangles of a mesh file, simplified to the limit of a robot, by colour.
pub fn surfaces(reading: &Reading<'_>, name: &str, scale: [f64; 3]) -> Parsed<Vec<PaintedSurface>> {
    if !READS_FILES {
        return Err(bad_mesh(name, &NO_FILES));
    }
    let mut groups: Vec<Painted> = Vec::new();
    for group in painted(reading, name, scale)? {
        match groups.iter_mut().find(|known| known.colour == group.colour) {
            Some(known) => known.facets.extend(group.facets),
            None => groups.push(group),
        }
    }
    let counts: Vec<_> = groups.iter().map(|group| group.facets.len()).collect();
    let surface = |(group, share): (Painted, usize)| PaintedSurface {
        colour: group.colour,
        surface: coarsened(surface_of(group.facets), share),
    };
    Ok(groups.into_iter().zip(shares(&counts, MOST_SEEN)).map(surface).collect())
}

/// Triangles with common vertices.
fn surface_of(facets: Vec<Facet>) -> Surface {
    let mut numbers = HashMap::new();
    let mut surface = Surface { total: facets.len(), ..Surface::default() };
    for corners in facets {
        surface.triangles.push(corners.map(|corner| {
            let corner = <[f64; 3]>::from(corner);
            *numbers.entry(bits(&corner)).or_insert_with(|| {
                surface.vertices.push(corner);
                surface.vertices.len() - 1
            })
        }));
    }
    surface
}

/// Simplifies the meshes of a robot if their total exceeds the limit. Returns a note in that case.
pub fn share_triangles(looks: &mut [RobotLook]) -> Option<String> {
    let mut surfaces: Vec<_> = looks
        .iter_mut()
        .filter_map(|look| match &mut look.seen {
            LookForm::Mesh(surface) => Some(surface),
            LookForm::Form(_) => None,
        })
        .collect();
    let totals: Vec<_> = surfaces.iter().map(|surface| surface.total).collect();
    let total: usize = totals.iter().sum();
    if total <= MOST_SEEN {
        return None;
    }
    for (surface, share) in surfaces.iter_mut().zip(shares(&totals, MOST_SEEN)) {
        **surface = coarsened(std::mem::take(*surface), share);
    }
    let drawn: usize = surfaces.iter().map(|surface| surface.triangles.len()).sum();
    Some(format!("visual meshes are simplified: {drawn} triangles instead of {total}"))
}

/// Triangle budget of each mesh for a total of `most`. Half of the budget is split evenly, so that
/// small meshes stay unchanged. The rest is proportional to the triangles beyond that share.
fn shares(totals: &[usize], most: usize) -> Vec<usize> {
    let even = (most / 2 / totals.len().max(1)).max(1);
    let rest = most.saturating_sub(totals.iter().map(|total| even.min(*total)).sum());
    let beyond = |total: usize| total.saturating_sub(even);
    let sum = totals.iter().map(|total| beyond(*total)).sum::<usize>().max(1);
    let share = |total: &usize| {
        let part = beyond(*total) as f64 * rest as f64 / sum as f64;
        even.min(*total) + beyond(*total).min(part as usize)
    };
    totals.iter().map(share).collect()
}

/// Bit patterns as keys. Adding 0 turns −0 into 0, so that equal numbers have equal bits.
fn bits(point: &[f64; 3]) -> [u64; 3] {
    point.map(|x| (x + 0.0).to_bits())
}

/// Convex hull of points (m).
pub fn hull(points: impl Iterator<Item = [f64; 3]>) -> Parsed<Hulled> {
    let mut known = HashSet::new();
    let points = points.filter(|point| known.insert(bits(point)));
    let mut points: Vec<_> = points.map(Vector3::from).collect();
    let (found, thickened) = match whole_or_reduced(&points) {
        Err(why) => match thicken(&mut points) {
            0.0 => (Err(why), 0.0),
            thick => (whole_or_reduced(&points), thick),
        },
        found => (found, 0.0),
    };
    let (piece, outside) = found.map_err(|error| error.to_string())?;
    let corners = piece.core().vertices().iter().map(|&corner| corner.into()).collect();
    let volume = if outside == 0.0 { Volume::Hull } else { Volume::Unknown };
    let volume = if thickened > 0.0 { Volume::Unknown } else { volume };
    Ok(Hulled { corners, volume, outside, thickened })
}

/// Hull of the points, reduced if it has too many vertices. Also returns the largest distance of a
/// point outside its planes (m).
fn whole_or_reduced(points: &[Vector3<f64>]) -> Result<(Piece, f64), Error> {
    let Some(outer) = outer_points(points) else { return reduced(points, MOST_CORNERS) };
    match Piece::hull(&outer, 0.0) {
        Err(Error::Count { .. }) if outer.len() > LEAST_REDUCED => reduced(points, MOST_CORNERS),
        whole => whole.map(|piece| (piece, 0.0)),
    }
}

/// Relative thickness below which points without a hull count as planar.
const THIN: f64 = 2e-5;
/// Thickness given to planar points, over their extent.
const THICK: f64 = 1e-4;

/// Replaces planar points by those of a plate and returns its thickness (m); 0 for other points.
fn thicken(points: &mut Vec<Vector3<f64>>) -> f64 {
    if points.len() < 3 {
        return 0.0;
    }
    let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
    let spread: Matrix3<f64> =
        points.iter().map(|point| (point - middle) * (point - middle).transpose()).sum();
    let eigen = spread.symmetric_eigen();
    let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
    let size = points.iter().map(|point| (point - middle).amax()).fold(0.0, f64::max) * 2.0;
    let is_in_plane =
        |point: &Vector3<f64>| (point - middle).dot(&normal).abs() <= 0.5 * THIN * size;
    if !(size > 0.0 && points.iter().all(is_in_plane)) {
        return 0.0;
    }
    let half = normal * (0.5 * THICK * size);
    *points = points.iter().flat_map(|point| [point - half, point + half]).collect();
    THICK * size
}

/// Number of points up to which the exact hull is always within the limit.
const LEAST_REDUCED: usize = 1000;
/// Maximum number of vertices of one reduced hull. The limit of 1000 vertices holds for all pieces
/// of a link together.
const MOST_CORNERS: usize = 200;

/// Number of points of a partial hull. Some of them are on its faces and edges.
const MOST_GROWN: usize = LEAST_REDUCED + LEAST_REDUCED / 4;
/// Relative distance beyond which a point is outside or inside a hull despite rounding.
const SURELY: f64 = 1e-9;
/// Relative growth per round below which the hull may soon be complete.
const SURE_GROWTH: f64 = 0.25;

/// Points that may be vertices of the hull: those that are not inside a partial hull. `None` if
/// the hull certainly exceeds the vertex limit of a piece, since the partial hull exceeds it.
///
/// This is much faster than the hull of all points, which tests each point against each face.
fn outer_points(points: &[Vector3<f64>]) -> Option<Vec<Vector3<f64>>> {
    if points.len() <= LEAST_REDUCED {
        return Some(points.to_vec());
    }
    let (piece, outside) = match grown(points, MOST_GROWN, SURELY, SURE_GROWTH) {
        Ok(found) => found,
        Err(Error::Count { .. }) => return None,
        Err(_) => return Some(points.to_vec()),
    };
    let core = piece.core();
    let surely = SURELY * 2.0 * core.reach();
    if core.vertices().len() >= LEAST_REDUCED && outside > surely {
        return None;
    }
    let is_outer = |point: &&Vector3<f64>| {
        core.faces().iter().any(|face| face.normal.dot(point) - face.offset > -surely)
    };
    Some(points.iter().filter(is_outer).copied().collect())
}

/// File name without folder and extension.
pub fn stem(file: &str) -> String {
    let stem = Path::new(file).file_stem();
    stem.map_or(String::new(), |stem| stem.to_string_lossy().into_owned())
}

#[cfg(test)]
#[path = "tests/meshes.rs"]
mod tests;
