//! Approximate convex decomposition of closed meshes.
//!
//! V-HACD (Mamou) cuts the voxels of a mesh by planes until every part is nearly convex. Each part
//! lies in a box. A piece is the convex hull of the mesh's solid within such a box, so that its
//! vertices lie on the surface or inside. Pieces are merged while their
//! common hull is nearly convex and while there are too many.
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
mod fit;
mod merging;
mod parts;
mod reduced;
mod settings;
mod shells;
mod solid;

pub use fit::Fit;
pub use reduced::{LEAST_CORNERS, grown, reduced};
pub use settings::DecompositionSettings;

use solid::Solid;
use tumble_core::error::Error;
use tumble_core::geometry::Piece;
use tumble_core::geometry::mesh::Mesh;

/// Maximum number of vertices of one piece.
const MOST_CORNERS: usize = 64;
/// Maximum number of vertices of all pieces together, the limit of a body's contact points.
const MOST_CORNERS_OF_ALL: usize = 1000;

/// Convex pieces that together approximate the solid of a closed mesh. They can overlap. Cavities
/// without an opening are filled.
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
    let mut parts = Vec::new();
    let mut thin = None;
    for cell in parts::cells(mesh, settings)? {
        // A part without a volume adds nothing to the solid.
        match reduced(&solid.points_in(&cell), MOST_CORNERS) {
            Ok((piece, _)) => parts.push(piece),
            Err(error) => thin = Some(error),
        }
    }
    if let (true, Some(error)) = (parts.is_empty(), thin) {
        return Err(error);
    }
    let (whole, _) = reduced(mesh.vertices(), MOST_CORNERS)?;
    let pieces = merging::merged(parts, &whole, settings)?;
    let most = MOST_CORNERS.min(MOST_CORNERS_OF_ALL / pieces.len().max(1));
    let fitted = |piece: Piece| match piece.core().vertices() {
        corners if corners.len() > most => Ok(reduced(corners, most)?.0),
        _ => Ok(piece),
    };
    pieces.into_iter().map(fitted).collect()
}

fn refused(why: String) -> Error {
    Error::Shape { shape: "the mesh", why }
}
