//! Tables `[[terrain]]`: height fields and surfaces of triangles.

use super::entries::{AttitudeEntry, Files, in_mesh, read_triangles};
use crate::coefficients::{table, with_coefficients};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use tumble_core::error::Error;
use tumble_core::geometry::Terrain;
use tumble_core::geometry::mesh::{facets_of_obj, facets_of_stl};
use tumble_core::geometry::terrain::{HeightField, Surface, TerrainShape};
use tumble_core::mechanics::quaternion::rotation;
use tumble_model::fields::{Exactly, Numbers, matrix, numbers, table_if_any};
use tumble_model::heights::HeightGrid;
use tumble_model::packed::{pack_floats, pack_indices, unpack_floats, unpack_indices};
use tumble_model::shown;

/// Maximum size of a file of heights or triangles (bytes).
const LARGEST_FILE: u64 = 1 << 29;

with_coefficients!(table, f64, TerrainEntry, "a table [[terrain]]" {
    /// Name.
    name: Option<String>,
    /// Heights of a grid (m).
    heights: Option<HeightsEntry>,
    /// Distance of columns and rows (m).
    spacing: Option<SpacingEntry>,
    /// File of a surface.
    mesh: Option<String>,
    /// Triangles of a surface.
    #[serde(default, deserialize_with = "table_if_any")]
    surface: Option<TrianglesTable>,
    /// Factor of the heights, or of all lengths of a surface.
    scale: Option<f64>,
    /// Position (m).
    position: Option<Numbers<3>>,
    /// Place of the first height, instead of the middle of the field.
    corner: Option<Numbers<3>>,
    /// Attitude.
    attitude: Option<AttitudeEntry>,
    /// Rows of the rotation matrix, as a run has it.
    turned: Option<Exactly<Numbers<3>, 3>>,
    /// Coefficient of friction.
    friction: Option<f64>,
    /// Collision groups.
    groups: Option<Vec<String>>,
    /// Collision groups that it collides with.
    collides_with: Option<Vec<String>>,
    /// Terrain of an entry in exact form.
    #[serde(skip)]
    made: Option<Arc<Terrain>>,
});

/// Heights of a field.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "rows of numbers, or the name of a file that ends in .png, .npy or .csv, are needed"
)]
pub enum HeightsEntry {
    File(String),
    Rows(Vec<Vec<f64>>),
    Packed(PackedTable),
}

/// Heights as little-endian bytes, compressed by deflate, in Base64. The Python package writes them.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct PackedTable {
    /// Number of columns.
    columns: usize,
    /// Heights.
    packed: String,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "one number or two are needed")]
pub enum SpacingEntry {
    Same(f64),
    Each(Numbers<2>),
}

/// Triangles, listed.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    deny_unknown_fields,
    expecting = "{ vertices = [[x, y, z], …], triangles = [[i, j, k], …] }"
)]
pub struct TrianglesTable {
    /// Vertices (m).
    vertices: VerticesEntry,
    /// Indices of the vertices of each triangle.
    triangles: TrianglesEntry,
}

/// Vertices (m), or packed numbers of 8 bytes.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "a list of [x, y, z] is needed")]
pub enum VerticesEntry {
    Packed(String),
    List(Vec<Numbers<3>>),
}

/// Indices of vertices, or packed numbers of 4 bytes.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "a list of [i, j, k] is needed")]
pub enum TrianglesEntry {
    Packed(String),
    List(Vec<Exactly<u32, 3>>),
}

impl TrianglesTable {
    fn vertices(&self) -> Result<Vec<Vector3<f64>>, String> {
        match &self.vertices {
            VerticesEntry::List(list) => Ok(list.iter().map(|at| at.0.into()).collect()),
            VerticesEntry::Packed(text) => {
                let numbers = unpack_floats(text).map_err(|why| format!("vertices: {why}"))?;
                Ok(numbers.as_chunks::<3>().0.iter().copied().map(Vector3::from).collect())
            }
        }
    }

    fn triangles(&self) -> Result<Vec<[u32; 3]>, String> {
        match &self.triangles {
            TrianglesEntry::List(list) => Ok(list.iter().map(|three| three.0).collect()),
            TrianglesEntry::Packed(text) => {
                let numbers = unpack_indices(text).map_err(|why| format!("triangles: {why}"))?;
                Ok(numbers.as_chunks::<3>().0.to_vec())
            }
        }
    }
}

impl TerrainEntry {
    /// Entry of a `terrain` in exact form.
    pub fn made(name: String, terrain: Terrain) -> Self {
        Self { name: Some(name), made: Some(Arc::new(terrain)), ..Self::default() }
    }

    /// Exact form of this entry, whose terrain is `terrain`.
    pub fn exact(self, name: String, terrain: Arc<Terrain>) -> Self {
        Self {
            name: Some(name),
            made: Some(terrain),
            heights: None,
            spacing: None,
            mesh: None,
            surface: None,
            scale: None,
            position: None,
            corner: None,
            attitude: None,
            turned: None,
            ..self
        }
    }

    /// Writes the terrain of an entry in exact form into its fields, packed.
    ///
    /// # Errors
    /// Too many numbers for the memory.
    pub fn pack(&mut self) -> Result<(), String> {
        match self.made.as_ref().map(|terrain| terrain.shape()) {
            Some(TerrainShape::Field(field)) => {
                let turned: [[f64; 3]; 3] = field.rotation().transpose().into();
                let packed = pack_floats(field.heights().iter().copied())?;
                let columns = field.columns();
                self.heights = Some(HeightsEntry::Packed(PackedTable { columns, packed }));
                self.spacing = Some(SpacingEntry::Each(Exactly(field.spacing())));
                self.corner = Some(numbers(field.position()));
                self.turned = Some(Exactly(turned.map(Exactly)));
            }
            Some(TerrainShape::Mesh(mesh)) => {
                let vertices = pack_floats(mesh.vertices().iter().flatten().copied())?;
                let triangles = pack_indices(mesh.triangles().iter().flatten().copied())?;
                let vertices = VerticesEntry::Packed(vertices);
                let triangles = TrianglesEntry::Packed(triangles);
                self.surface = Some(TrianglesTable { vertices, triangles });
            }
            None => {}
        }
        Ok(())
    }

    /// Makes the terrain. The sentence of an error begins with the field.
    pub fn terrain(&self, files: &Files<'_>) -> Result<Arc<Terrain>, String> {
        if let Some(terrain) = &self.made {
            return Ok(Arc::clone(terrain));
        }
        let exact = self.turned.as_ref().map(matrix);
        let turn = match self.attitude.as_ref().map(AttitudeEntry::quaternion).transpose() {
            Err(why) => return Err(format!("attitude: {why}")),
            Ok(Some(None)) => {
                return Err("attitude: a terrain cannot be turned at random; give numbers".into());
            }
            Ok(Some(Some(quaternion))) => rotation(&quaternion.into()),
            Ok(None) => exact.unwrap_or_else(Matrix3::identity),
        };
        if self.corner.is_some() && (self.position.is_some() || self.heights.is_none()) {
            return Err("corner: it is for `heights`, instead of `position`".to_owned());
        }
        let place = self.position.as_ref().or(self.corner.as_ref());
        let place = place.map_or(Vector3::zeros(), |place| place.0.into());
        let scale = self.scale.unwrap_or(1.0);
        if !(1e-9..=1e9).contains(&scale.abs()) {
            return Err(format!("scale is {scale}; allowed: 1e-9 to 1e9"));
        }
        if self.heights.is_none() && self.spacing.is_some() {
            return Err("spacing: it has no meaning without `heights`".to_owned());
        }
        let terrain = match (&self.heights, &self.mesh, &self.surface) {
            (Some(heights), None, None) => self.field(heights, scale, &turn, &place, files)?,
            (None, Some(name), None) => {
                let mut facets =
                    read_triangles(files, name, LARGEST_FILE, facets_of_obj, facets_of_stl)?;
                facets.iter_mut().flatten().for_each(|corner| *corner *= scale);
                let mesh = Surface::from_facets(&facets);
                let mesh = mesh.and_then(|mesh| mesh.moved_by(&turn, &place));
                mesh.map(Terrain::from).map_err(|error| in_mesh(files, name, &error))?
            }
            (None, None, Some(table)) => {
                let named = |why| format!("surface.{why}");
                let vertices = table.vertices().map_err(named)?;
                let triangles = table.triangles().map_err(named)?;
                let mesh = Surface::new(vertices.iter().map(|at| at * scale).collect(), triangles);
                let mesh = mesh.and_then(|mesh| mesh.moved_by(&turn, &place));
                mesh.map(Terrain::from).map_err(|error| format!("surface: {error}"))?
            }
            _ => return Err("one of heights, mesh and surface is needed".to_owned()),
        };
        Ok(Arc::new(terrain))
    }

    /// Height field whose middle is at `place` (m).
    fn field(
        &self,
        heights: &HeightsEntry,
        scale: f64,
        turn: &Matrix3<f64>,
        place: &Vector3<f64>,
        files: &Files<'_>,
    ) -> Result<Terrain, String> {
        let spacing = match self.spacing {
            Some(SpacingEntry::Same(spacing)) => [spacing; 2],
            Some(SpacingEntry::Each(spacing)) => spacing.0,
            None => return Err("spacing: the distance of the heights (m) is needed".to_owned()),
        };
        let grid = match heights {
            HeightsEntry::Rows(rows) => {
                HeightGrid::from_rows(rows).map_err(|why| format!("heights: {why}"))?
            }
            HeightsEntry::Packed(PackedTable { columns, packed }) => {
                HeightGrid::from_packed(packed, *columns)
                    .map_err(|why| format!("heights: {why}"))?
            }
            HeightsEntry::File(name) => {
                let path = files.folder.join(name);
                let invalid =
                    |why: &dyn std::fmt::Display| format!("heights: {}: {why}", shown::path(&path));
                let bytes = (files.read)(&path, LARGEST_FILE).map_err(|error| invalid(&error))?;
                HeightGrid::from_file(name, &bytes).map_err(|why| invalid(&why))?
            }
        };
        let invalid = |error: Error| match &error {
            Error::OutOfRange { field, .. } if field.starts_with("spacing") => {
                format!("spacing: {error}")
            }
            _ => format!("heights: {error}"),
        };
        field_at_origin(grid, spacing, scale, self.corner.is_none())
            .and_then(|field| field.moved_by(turn, place))
            .map(Terrain::from)
            .map_err(invalid)
    }
}

/// Field of a grid with its heights multiplied by `scale`. Its middle or its first height is over the
/// origin.
fn field_at_origin(
    grid: HeightGrid,
    spacing: [f64; 2],
    scale: f64,
    is_middle: bool,
) -> Result<HeightField, Error> {
    let HeightGrid { mut values, columns } = grid;
    if scale != 1.0 {
        values.iter_mut().for_each(|height| *height *= scale);
    }
    let field = HeightField::new(values, columns, spacing)?;
    if !is_middle {
        return Ok(field);
    }
    let wide = (field.columns() - 1) as f64 * spacing[0];
    let deep = (field.rows() - 1) as f64 * spacing[1];
    field.moved_by(&Matrix3::identity(), &Vector3::new(-0.5 * wide, -0.5 * deep, 0.0))
}
