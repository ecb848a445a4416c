//! Meshes of robots: of their vertices the convex hull counts; for the eye their triangles.

use super::coarsening::coarsened;
use super::mass::enclosed;
use super::model::{LinkMass, LookForm, RobotLook, Surface};
use super::{Reading, collada, gltf, msh};
use nalgebra::{Matrix3, Vector3};
use std::collections::{HashMap, HashSet};
use std::path::Path;
use tumble_core::error::Error;
use tumble_core::geometry::Piece;
use tumble_core::geometry::hull::Face;
use tumble_core::geometry::mesh::{Mesh, facets_of_obj, facets_of_stl};
use tumble_model::shown;

/// More bytes than this are not read.
const LARGEST_MESH: u64 = 32 << 20;

/// Triangles of all visual meshes of a robot: a page of about 3 MB.
const MOST_SEEN: usize = 20_000;

/// What the mass of a mesh follows from.
#[derive(Debug, Clone)]
pub enum Volume {
    /// Its hull: it is closed and convex, or points alone.
    Hull,
    /// What its triangles enclose, as [`enclosed`] has it.
    Triangles(Box<[LinkMass; 2]>),
    /// Nothing: its triangles are not read.
    Unknown,
}

/// The corners of the convex hull of a mesh, and what its mass follows from.
#[derive(Debug, Clone)]
pub struct Hulled {
    /// m.
    pub corners: Vec<[f64; 3]>,
    /// What its mass follows from.
    pub volume: Volume,
    /// How far points of the mesh are outside of the planes of the corners' hull, m: more than 0 where the hull of all of
    /// them has more corners than a piece may have.
    pub outside: f64,
    /// How thick its hull was made, m, where all of its points lie in one plane; 0 elsewhere.
    pub thickened: f64,
}

impl Hulled {
    /// What is to be said of the hull of a mesh: where it is not that of its points, all of them and no others.
    pub fn note(&self, name: &str) -> Option<String> {
        let (name, count, outside) = (shown::line(name), self.corners.len(), self.outside);
        if self.thickened > 0.0 {
            return Some(format!(
                "{name}: it is flat, and counts as {:.1e} m thick",
                self.thickened
            ));
        }
        (outside > 0.0).then(|| {
            format!("{name}: a hull of {count} of its corners counts, the others are up to {outside:.1e} m outside")
        })
    }
}

/// What a file's name ends with, in small letters.
fn extension(name: &str) -> String {
    let extension = Path::new(name).extension().and_then(|end| end.to_str()).unwrap_or("");
    extension.to_ascii_lowercase()
}

/// The facets of a file, their lengths along x, y and z multiplied; counter-clockwise seen from outside as before.
fn facets(
    reading: &Reading<'_>,
    name: &str,
    scale: [f64; 3],
) -> Result<Vec<[Vector3<f64>; 3]>, String> {
    let odd = |why: &dyn std::fmt::Display| odd(name, why);
    let facets = match &*extension(name) {
        "stl" => facets_of_stl(&reading.bytes(name, LARGEST_MESH)?),
        "obj" => facets_of_obj(&reading.text(name, LARGEST_MESH)?),
        "msh" => msh::facets(&reading.bytes(name, LARGEST_MESH)?),
        "glb" => Ok(gltf::facets(&reading.bytes(name, LARGEST_MESH)?).map_err(|why| odd(&why))?),
        "dae" => return Err(odd(&"of .dae the corners alone are read, and no triangles")),
        _ => {
            let why = "only .stl, .obj, .msh, .glb and .dae are read; convert it, or give boxes or capsules";
            return Err(odd(&why));
        }
    };
    let facets = facets.map_err(|error| odd(&error))?;
    let by = Vector3::from(scale);
    let scaled = |facet: [Vector3<f64>; 3]| {
        turned_back(facet.map(|corner| corner.component_mul(&by)), scale)
    };
    Ok(facets.into_iter().map(scaled).collect())
}

/// The corners of a facet whose lengths along x, y and z were multiplied: a mirror turns it over.
pub fn turned_back<T>([a, b, c]: [T; 3], scale: [f64; 3]) -> [T; 3] {
    if scale.iter().product::<f64>() < 0.0 { [a, c, b] } else { [a, b, c] }
}

fn odd(name: &str, why: &dyn std::fmt::Display) -> String {
    format!("mesh {:?}: {why}", shown::line(name))
}

/// The hull of the mesh of a file.
pub fn read(reading: &Reading<'_>, name: &str, scale: [f64; 3]) -> Result<Hulled, String> {
    if extension(name) == "dae" {
        let points = collada::points(&reading.text(name, LARGEST_MESH)?);
        let points = points.map_err(|why| odd(name, &why))?.into_iter();
        let points = points.map(|point| point.component_mul(&Vector3::from(scale)).into());
        return Ok(Hulled {
            volume: Volume::Unknown,
            ..hull(points).map_err(|why| odd(name, &why))?
        });
    }
    let facets = facets(reading, name, scale)?;
    of_facets(&facets).map_err(|why| odd(name, &why))
}

/// The hull of triangles, counter-clockwise seen from outside, m.
pub fn of_facets(facets: &[[Vector3<f64>; 3]]) -> Result<Hulled, String> {
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

/// The triangles of the mesh of a file, at most as many as a robot may have.
pub fn surface(reading: &Reading<'_>, name: &str, scale: [f64; 3]) -> Result<Surface, String> {
    let facets = facets(reading, name, scale)?;
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
    Ok(coarsened(surface, MOST_SEEN))
}

/// Makes the meshes of a robot coarser where they have too many triangles together. Returns a sentence about it.
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
    Some(format!("visual meshes are drawn coarser: {drawn} triangles instead of {total}"))
}

/// Triangles of each mesh, `most` in all. Half of them are shared evenly, so that small meshes keep their form. The other
/// half is shared in proportion to what the meshes have beyond that.
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

/// Equal numbers have equal bits: adding 0 turns −0 into 0.
fn bits(point: &[f64; 3]) -> [u64; 3] {
    point.map(|x| (x + 0.0).to_bits())
}

/// The convex hull of points (m).
pub fn hull(points: impl Iterator<Item = [f64; 3]>) -> Result<Hulled, String> {
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

/// The hull of the points, or, of too many, of some of them; how far the others are outside of its planes (m).
fn whole_or_reduced(points: &[Vector3<f64>]) -> Result<(Piece, f64), Error> {
    if points.len() > LEAST_REDUCED && has_too_many(points) {
        return reduced(points, MOST_CORNERS);
    }
    match Piece::hull(points, 0.0) {
        Err(Error::Count { .. }) if points.len() > LEAST_REDUCED => reduced(points, MOST_CORNERS),
        whole => whole.map(|piece| (piece, 0.0)),
    }
}

/// Points within this part of their extent have no inside if they have no hull.
const THIN: f64 = 2e-5;
/// How thick they are made, in parts of their extent.
const THICK: f64 = 1e-4;

/// Has points that lie in one plane be those of a plate; how thick it is (m), 0 of others.
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

/// Fewer points than this have no hull that is too large.
const LEAST_REDUCED: usize = 1000;
/// The most corners of a hull that is reduced for itself: a link may have several, and 1000 corners in all.
const MOST_CORNERS: usize = 200;
/// A hull is reduced to no fewer: those in the 26 directions, and one more.
pub const LEAST_CORNERS: usize = 27;
/// What may be outside of a reduced hull's planes, in parts of its extent.
const OUTSIDE: f64 = 1e-3;

/// Beyond this a point is outside of a hull, and not in one of its planes but for rounding, in parts of its extent.
const SURELY: f64 = 1e-9;
/// A hull that grows by less than this part at a time may have all of its corners soon.
const SURE_GROWTH: f64 = 0.25;

/// Whether the hull of the points surely has more corners than a piece may have: as many of them are corners already where
/// others are outside. Far faster than that hull, which asks each point for each face.
fn has_too_many(points: &[Vector3<f64>]) -> bool {
    let grown = grown(points, LEAST_REDUCED, SURELY, SURE_GROWTH);
    grown.is_ok_and(|(piece, outside)| {
        let core = piece.core();
        core.vertices().len() >= LEAST_REDUCED && outside > SURELY * 2.0 * core.reach()
    })
}

/// The hull of at most `most` of the points, and how far the others are outside of its planes (m).
pub fn reduced(points: &[Vector3<f64>], most: usize) -> Result<(Piece, f64), Error> {
    grown(points, most, OUTSIDE, 0.0)
}

/// The hull of at most `most` of the points, and how far the others are outside of its planes (m), at last `allowed` parts of its
/// extent: from the outermost in the 26 directions of a cube's faces, edges and corners on, the farthest point outside of each face
/// is taken in, as long as that makes it grow by at least this part.
fn grown(
    points: &[Vector3<f64>],
    most: usize,
    allowed: f64,
    growth: f64,
) -> Result<(Piece, f64), Error> {
    let mut chosen: Vec<Vector3<f64>> = Vec::new();
    for number in 0..27 {
        let digit = |place: i32| f64::from(number / place % 3 - 1);
        let direction = Vector3::new(digit(1), digit(3), digit(9));
        let farthest = points.iter().max_by(|a, b| a.dot(&direction).total_cmp(&b.dot(&direction)));
        chosen.extend(farthest.filter(|farthest| !chosen.contains(farthest)));
    }
    let mut left: Vec<_> = points.to_vec();
    loop {
        let piece = Piece::hull(&chosen, 0.0)?;
        let faces = piece.core().faces();
        let mut farthest = vec![(0.0, None); faces.len()];
        left.retain(|point| {
            let above = |face: &Face| face.normal.dot(point) - face.offset;
            let heights = faces.iter().map(above).enumerate();
            let Some((face, height)) = heights.max_by(|a, b| a.1.total_cmp(&b.1)) else {
                return false;
            };
            if height > farthest[face].0 {
                farthest[face] = (height, Some(*point));
            }
            height > 0.0
        });
        let outside = farthest.iter().fold(0.0_f64, |most, (height, _)| most.max(*height));
        let allowed = allowed * 2.0 * piece.core().reach();
        if outside <= allowed || chosen.len() >= most {
            return Ok((piece, outside));
        }
        farthest.retain(|(height, _)| *height > allowed);
        farthest.sort_by(|a, b| b.0.total_cmp(&a.0));
        if (farthest.len() as f64) < growth * chosen.len() as f64 {
            return Ok((piece, outside));
        }
        let room = most - chosen.len();
        chosen.extend(farthest.iter().take(room).filter_map(|(_, point)| *point));
    }
}

/// The name of a file without folder and ending.
pub fn stem(file: &str) -> String {
    let stem = Path::new(file).file_stem();
    stem.map_or(String::new(), |stem| stem.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_are_shared_in_proportion_and_small_meshes_keep_theirs() {
        assert_eq!(shares(&[20_000; 10], 20_000), [2000; 10]);
        assert_eq!(shares(&[12, 100_000], 20_000), [12, 19_988]);
        let three = shares(&[20_000, 40_000, 100], 10_000);
        assert!(three[1] > 3 * three[0] / 2 && three[0] > 1666, "{three:?}");
        assert_eq!(three[2], 100);
        assert!(three.iter().sum::<usize>() <= 10_000, "{three:?}");
        assert_eq!(shares(&[5; 4], 3), [1; 4]);
    }
}
