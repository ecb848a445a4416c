//! Meshes decomposed into convex pieces while a scene is read.

use super::entries::{Files, MeshValue, PieceEntry, in_mesh, read_mesh, surface};
use crate::bodies::shape::SpecificSolid;
use tumble_core::geometry::MassProperties;
use tumble_decompose::{DecompositionSettings, Fit, decompose};
use tumble_model::{NO_FILES, READS_FILES};

/// Pieces of a mesh, and what is taken from the mesh itself.
pub struct DecomposedMesh {
    /// Convex pieces, which can overlap.
    pub pieces: Vec<PieceEntry>,
    /// Mass properties of the mesh.
    pub solid: SpecificSolid,
    /// Triangles of the mesh, for pictures.
    pub surface: PieceEntry,
    /// Note on pieces that reach outside the mesh.
    pub note: Option<String>,
}

/// Distance outside the mesh that is rounding, relative to the mesh.
const ROUNDING: f64 = 1e-9;

impl DecomposedMesh {
    /// Decomposes the mesh of `fields`.
    pub fn new(
        mut fields: PieceEntry,
        settings: &DecompositionSettings,
        files: &Files<'_>,
    ) -> Result<Self, String> {
        settings.check().map_err(|error| format!("decompose: {error}"))?;
        let name = fields.mesh.take();
        let name = name.as_ref().and_then(MeshValue::file);
        let name =
            name.ok_or_else(|| "decompose: it has no meaning without a `mesh` file".to_owned())?;
        if fields.radius.is_some() {
            return Err("radius: it has no meaning with `decompose`; leave it out".to_owned());
        }
        let scale = fields.scale.take().unwrap_or(1.0);
        if let Some(other) = fields.exact_form(files)? {
            let other = other.field();
            return Err(format!(
                "mesh: only one shape can be given, and there is already `{other}`"
            ));
        }
        if !READS_FILES {
            return Err(in_mesh(files, name, &NO_FILES));
        }
        let mesh = read_mesh(files, name, scale)?;
        let pieces = decompose(&mesh, settings).map_err(|error| in_mesh(files, name, &error))?;
        let Fit { volume_ratio, outside, .. } =
            Fit::new(&pieces, &mesh).map_err(|error| in_mesh(files, name, &error))?;
        let note = (outside > ROUNDING * mesh.volume().cbrt()).then(|| {
            format!(
                "{name}: its pieces reach up to {outside:.1e} m outside it, and their volumes add up \
                 to {volume_ratio:.4} of the mesh's; a larger `resolution` comes closer"
            )
        });
        let pieces = pieces.iter().map(|piece| {
            let corners = piece.core().vertices();
            PieceEntry::from_hull(corners.iter().map(|&corner| corner.into()))
        });
        Ok(Self {
            pieces: pieces.collect(),
            solid: SpecificSolid::from_properties(&MassProperties::from_mesh(&mesh)),
            surface: PieceEntry { surface: Some(surface(&mesh)), ..PieceEntry::default() },
            note,
        })
    }
}
