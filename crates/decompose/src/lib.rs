//! Convex decomposition of closed meshes.
//!
//! A prism is cut along its axis, and a mesh with few planar faces along them, exactly. For others,
//! V-HACD (Mamou) cuts the voxels of a mesh by planes until every part is nearly convex. Each part lies in
//! a box. A piece is the convex hull of the mesh's solid within such a box, so that its vertices lie on the surface or inside. Pieces
//! are merged while their common hull is nearly convex and while there are too many.
//!
//! ```
//! use tumble_core::geometry::mesh::Mesh;
//! use tumble_decompose::{DecompositionSettings, decompose};
//!
//! let corners = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
//! let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
//! let mesh = Mesh::new(corners.map(Into::into).to_vec(), triangles)?;
//! let pieces = decompose(&mesh, &DecompositionSettings::default())?;
//! assert_eq!(pieces.len(), 1);
//! # Ok::<(), tumble_core::error::Error>(())
//! ```
//!
//! Equal meshes and settings give equal pieces, bit by bit, on one machine.

mod crossing;
mod faces;
mod fit;
mod merging;
mod parts;
mod prism;
mod reduced;
mod settings;
mod shells;
mod solid;

pub use fit::Fit;
pub use reduced::{LEAST_CORNERS, grown, reduced};
pub use settings::DecompositionSettings;

use nalgebra::Vector3;
use solid::Solid;
use tumble_core::error::Error;
use tumble_core::geometry::mesh::Mesh;
use tumble_core::geometry::{MassProperties, Piece};

/// Maximum number of vertices of one piece.
const MOST_CORNERS: usize = 64;
/// Maximum number of vertices of all pieces together, the limit of a body's contact points.
const MOST_CORNERS_OF_ALL: usize = 1000;

/// Volume by which exact pieces may exceed their parts, relative to the convex hull of the mesh.
const ROUNDING: f64 = 1e-7;
/// Volume that exact parts may lack, relative to the mesh.
const LOST: f64 = 1e-4;

/// Convex pieces that together are the solid of a closed mesh, exactly if it has few planar faces. Others
/// approximate it, can overlap, and fill cavities without an opening.
///
/// A piece has at most 64 vertices, and all pieces together have at most 1000.
///
/// # Errors
/// A setting out of range; a mesh that intersects itself, has a surface inside its solid, or is too
/// thin for its pieces to have a volume.
pub fn decompose(mesh: &Mesh, settings: &DecompositionSettings) -> Result<Vec<Piece>, Error> {
    settings.check()?;
    crossing::refuse(mesh)?;
    shells::refuse(mesh)?;
    let solid = Solid::new(mesh)?;
    let (whole, _) = reduced(mesh.vertices(), MOST_CORNERS)?;
    if let Some(pieces) = exact_prism(mesh, &solid, settings) {
        return Ok(pieces);
    }
    if let Some(pieces) = exact(mesh, &solid, &whole, settings) {
        return Ok(pieces);
    }
    let mut parts = Vec::new();
    let mut flat = Vec::new();
    for cell in parts::cells(mesh, settings)? {
        let points = solid.points_in(&cell);
        match reduced(&points, MOST_CORNERS) {
            Ok((piece, _)) => parts.push(piece),
            Err(error) => flat.push((points, error)),
        }
    }
    // A flat part adds nothing where others reach it to a voxel; a wall without a volume would be lost.
    let voxel = solid.extent() / f64::from(settings.resolution);
    let is_lost = |point: &Vector3<f64>| {
        let height = |part: &Piece| {
            part.core().faces().iter().fold(f64::NEG_INFINITY, |most, face| {
                most.max(face.normal.dot(point) - face.offset)
            })
        };
        parts.iter().all(|part| height(part) > voxel)
    };
    if let Some((_, error)) = flat.into_iter().find(|(points, _)| points.iter().any(is_lost)) {
        return Err(error);
    }
    let pieces = merging::merged(parts, &whole, settings)?;
    let most = MOST_CORNERS.min(MOST_CORNERS_OF_ALL / pieces.len().max(1));
    let fitted = |piece: Piece| match piece.core().vertices() {
        corners if corners.len() > most => Ok(reduced(corners, most)?.0),
        _ => Ok(piece),
    };
    pieces.into_iter().map(fitted).collect()
}

/// Pieces that fill a prism exactly, if the limits of `settings` and of corners allow it.
fn exact_prism(mesh: &Mesh, solid: &Solid, settings: &DecompositionSettings) -> Option<Vec<Piece>> {
    let parts = prism::parts(mesh, solid.extent())?;
    let corners: usize = parts.iter().map(Vec::len).sum();
    if parts.len() > settings.pieces as usize || corners > MOST_CORNERS_OF_ALL {
        return None;
    }
    let pieces = parts.iter().map(|part| Piece::hull(part, 0.0).ok());
    let pieces: Vec<_> = pieces.collect::<Option<_>>()?;
    is_filled(mesh, &pieces).then_some(pieces)
}

/// True if the volumes of parts of the solid add up to its own, but for walls as thin as the distance at
/// which points count as equal.
fn is_filled(mesh: &Mesh, parts: &[Piece]) -> bool {
    let volume = MassProperties::from_mesh(mesh).volume;
    let filled: f64 = parts.iter().map(|part| MassProperties::from_piece(part).volume).sum();
    (filled - volume).abs() <= LOST * volume
}

/// Pieces that fill the solid exactly, if few planar faces allow it within the limits of `settings` and
/// of corners.
fn exact(
    mesh: &Mesh,
    solid: &Solid,
    whole: &Piece,
    settings: &DecompositionSettings,
) -> Option<Vec<Piece>> {
    let parts = faces::parts(mesh, solid)?;
    let parts = parts.iter().map(|corners| reduced(corners, MOST_CORNERS).ok());
    let parts: Vec<_> = parts.map(|part| Some(part?.0)).collect::<Option<_>>()?;
    if !is_filled(mesh, &parts) {
        return None;
    }
    let exact = DecompositionSettings { concavity: ROUNDING, pieces: u32::MAX, ..*settings };
    let pieces = merging::merged(parts, whole, &exact).ok()?;
    let corners = |piece: &Piece| piece.core().vertices().len();
    let fits = pieces.len() <= settings.pieces as usize
        && pieces.iter().all(|piece| corners(piece) < MOST_CORNERS)
        && pieces.iter().map(corners).sum::<usize>() <= MOST_CORNERS_OF_ALL;
    (!pieces.is_empty() && fits).then_some(pieces)
}

fn refused(why: String) -> Error {
    Error::Shape { shape: "the mesh", why }
}
