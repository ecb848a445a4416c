//! Terrain of a model: height fields and surfaces of triangles.

use crate::groups::GroupsModel;
use crate::packed::{pack_floats, pack_indices, unpack_floats, unpack_indices};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::sync::Arc;
use tumble_core::geometry::Terrain;
use tumble_core::geometry::terrain::{HeightField, Surface, TerrainShape};

/// Terrain in the world.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct TerrainModel {
    /// Name.
    pub name: String,
    /// Geometry.
    #[serde(serialize_with = "written", deserialize_with = "read")]
    pub terrain: Arc<Terrain>,
    /// Coefficient of friction; null for the world's.
    pub friction: Option<f64>,
    /// Collision groups.
    #[serde(default, skip_serializing_if = "GroupsModel::are_usual")]
    pub groups: GroupsModel,
}

/// Geometry of a terrain in run.json. Long lists of numbers are packed as text: little-endian bytes,
/// compressed by deflate, in Base64.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum StoredTerrain {
    /// Heights over a rectangular grid.
    Field {
        /// Number of heights in a row along x.
        columns: usize,
        /// Distances of columns and rows (m).
        spacing: [f64; 2],
        /// Place of the first height's grid point (m, world).
        position: [f64; 3],
        /// Rows of the rotation matrix, frame of the field → world.
        rotation: [[f64; 3]; 3],
        /// Heights (m) row by row, 8 bytes each.
        heights: String,
    },
    /// Triangles.
    Mesh {
        /// Vertices (m, world), three numbers of 8 bytes each.
        vertices: String,
        /// Triangles as vertex indices, three numbers of 4 bytes each.
        triangles: String,
    },
}

fn written<S: Serializer>(terrain: &Arc<Terrain>, serializer: S) -> Result<S::Ok, S::Error> {
    stored(terrain).map_err(serde::ser::Error::custom)?.serialize(serializer)
}

fn stored(terrain: &Terrain) -> Result<StoredTerrain, String> {
    Ok(match terrain.shape() {
        TerrainShape::Field(field) => StoredTerrain::Field {
            columns: field.columns(),
            spacing: field.spacing(),
            position: (*field.position()).into(),
            rotation: field.rotation().transpose().into(),
            heights: pack_floats(field.heights().iter().copied())?,
        },
        TerrainShape::Mesh(mesh) => StoredTerrain::Mesh {
            vertices: pack_floats(mesh.vertices().iter().flatten().copied())?,
            triangles: pack_indices(mesh.triangles().iter().flatten().copied())?,
        },
    })
}

fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Arc<Terrain>, D::Error> {
    let stored = StoredTerrain::deserialize(deserializer)?;
    restored(stored).map(Arc::new).map_err(serde::de::Error::custom)
}

fn restored(stored: StoredTerrain) -> Result<Terrain, String> {
    let terrain = match stored {
        StoredTerrain::Field { columns, spacing, position, rotation, heights } => {
            let heights = unpack_floats(&heights).map_err(|why| format!("heights: {why}"))?;
            let rotation = Matrix3::from(rotation).transpose();
            let field = HeightField::new(heights, columns, spacing);
            let field = field.and_then(|field| field.moved_by(&rotation, &position.into()));
            field.map(Terrain::from)
        }
        StoredTerrain::Mesh { vertices, triangles } => {
            let vertices = unpack_floats(&vertices).map_err(|why| format!("vertices: {why}"))?;
            let triangles =
                unpack_indices(&triangles).map_err(|why| format!("triangles: {why}"))?;
            let vertices = vertices.as_chunks::<3>().0.iter().copied().map(Vector3::from);
            let triangles = triangles.as_chunks::<3>().0.to_vec();
            Surface::new(vertices.collect(), triangles).map(Terrain::from)
        }
    };
    terrain.map_err(|error| error.to_string())
}
