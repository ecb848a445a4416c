//! Tables of the notation `[[bodies]]` as deserialised.

use super::drawn::DrawnModel;
use crate::bodies::place::Place;
use crate::choices::StartFrame;
use crate::coefficients::with_coefficients;
use crate::tables::{InertiaValue, LoadTable, Random, Sides};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::Path;
use tumble_core::error::Error;
use tumble_core::geometry::mesh::{Mesh, parse_obj, parse_stl};
use tumble_core::mechanics::quaternion::unit;
use tumble_decompose::DecompositionSettings;
use tumble_model::colour::{BodyLabel, Colour};
use tumble_model::failure::field_of;
use tumble_model::fields::{Exactly, Numbers, numbers, table_if_any};
use tumble_model::{NO_FILES, READS_FILES, shown};

/// Defines a table that has the fields of a convex form and others.
macro_rules! with_form {
    ($name:ident, $expected:literal { $($(#[$meta:meta])* $field:ident: $type:ty,)* }) => {
        #[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        #[serde(deny_unknown_fields, expecting = $expected)]
        pub struct $name {
            /// Sides of a box (m): one number, a cube, or three.
            #[serde(rename = "box")]
            pub cuboid: Option<Sides>,
            /// Radius of a sphere (m).
            pub sphere: Option<f64>,
            /// Capsule along z.
            #[serde(default, deserialize_with = "table_if_any")]
            pub capsule: Option<TubeTable>,
            /// Cylinder along z.
            #[serde(default, deserialize_with = "table_if_any")]
            pub cylinder: Option<TubeTable>,
            /// Cone along z; the origin is halfway between base and apex.
            #[serde(default, deserialize_with = "table_if_any")]
            pub cone: Option<ConeTable>,
            /// Half axes of an ellipsoid (m).
            pub ellipsoid: Option<Numbers<3>>,
            /// Points of a convex hull (m).
            pub hull: Option<Vec<Numbers<3>>>,
            /// Closed mesh.
            pub mesh: Option<MeshValue>,
            /// Metres per unit of a mesh file.
            pub scale: Option<f64>,
            /// Rounding radius of a hull or mesh (m).
            pub radius: Option<f64>,
            /// Number of corners on which a flat end of a cylinder, cone or ellipsoid stands.
            pub sides: Option<usize>,
            $($(#[$meta])* pub $field: $type,)*
        }

        impl $name {
            /// Takes the fields of the form.
            pub fn take_form(&mut self) -> PieceEntry {
                PieceEntry {
                    cuboid: self.cuboid.take(),
                    sphere: self.sphere.take(),
                    capsule: self.capsule.take(),
                    cylinder: self.cylinder.take(),
                    cone: self.cone.take(),
                    ellipsoid: self.ellipsoid.take(),
                    hull: self.hull.take(),
                    mesh: self.mesh.take(),
                    scale: self.scale.take(),
                    radius: self.radius.take(),
                    sides: self.sides.take(),
                    ..PieceEntry::default()
                }
            }
        }
    };
}

with_coefficients!(with_form, f64, BodyEntry, "a table [[bodies]]" {
    /// Name.
    name: Option<String>,
    /// Name of an earlier body with the same shape, as a run has it.
    shape: Option<String>,
    /// Points that touch only planes (m), from the centre of mass.
    points: Option<Vec<Numbers<3>>>,
    /// True for one point in the centre of mass.
    point_mass: Option<bool>,
    /// Convex pieces.
    pieces: Option<Vec<PieceEntry>>,
    /// Mass (kg).
    mass: Option<f64>,
    /// Density (kg/m³).
    density: Option<f64>,
    /// Inertia about the centre of mass (kg m²).
    inertia: Option<InertiaValue>,
    /// Centre of mass in the shape's frame (m).
    centre: Option<Numbers<3>>,
    /// Coefficient of friction.
    friction: Option<f64>,
    /// False for a body without contacts.
    touches: Option<bool>,
    /// Collision groups.
    groups: Option<Vec<String>>,
    /// Collision groups that it collides with.
    collides_with: Option<Vec<String>>,
    /// Position of the shape's origin (m).
    position: Numbers<3>,
    /// Attitude.
    attitude: Option<AttitudeEntry>,
    /// Velocity of the centre of mass (m/s).
    velocity: Option<Numbers<3>>,
    /// Angular velocity (rad/s), body frame.
    spin: Option<Numbers<3>>,
    /// Frame of position, attitude, velocity and copies.
    frame: Option<StartFrame>,
    /// Largest random offset of the position (m).
    jitter: Option<Jitter>,
    /// Copies in a grid.
    #[serde(default, deserialize_with = "table_if_any")]
    copies: Option<CopiesTable>,
    /// Copies in a ring.
    #[serde(default, deserialize_with = "table_if_any")]
    ring: Option<RingTable>,
    /// External force and torque.
    #[serde(default, deserialize_with = "table_if_any")]
    load: Option<LoadTable>,
    /// Colour in pictures.
    colour: Option<Colour>,
    /// Text above the body in pictures.
    label: Option<BodyLabel>,
    /// Start before the draws of its seed, as a run has it.
    drawn: Option<DrawnModel>,
    /// Shape in pictures.
    look: Option<LookValue>,
    /// Decomposition of the mesh into convex pieces.
    #[serde(default, deserialize_with = "table_if_any")]
    decompose: Option<DecompositionSettings>,
});

with_coefficients!(with_form, f64, FixedEntry, "a table [[fixed]]" {
    /// Name.
    name: Option<String>,
    /// Convex pieces.
    pieces: Option<Vec<PieceEntry>>,
    /// Coefficient of friction.
    friction: Option<f64>,
    /// Collision groups.
    groups: Option<Vec<String>>,
    /// Collision groups that it collides with.
    collides_with: Option<Vec<String>>,
    /// Position of the shape's origin (m).
    position: Option<Numbers<3>>,
    /// Attitude.
    attitude: Option<AttitudeEntry>,
    /// Frame of position, attitude and copies.
    frame: Option<StartFrame>,
    /// Copies in a grid.
    #[serde(default, deserialize_with = "table_if_any")]
    copies: Option<CopiesTable>,
    /// Copies in a ring.
    #[serde(default, deserialize_with = "table_if_any")]
    ring: Option<RingTable>,
    /// Decomposition of the mesh into convex pieces.
    #[serde(default, deserialize_with = "table_if_any")]
    decompose: Option<DecompositionSettings>,
});

with_form!(PieceEntry, "a piece, { box = …, position = …, attitude = … }" {
    /// Triangles of a look, which need not be convex.
    #[serde(default, deserialize_with = "table_if_any")]
    surface: Option<SurfaceTable>,
    /// Position in the object's frame (m).
    position: Option<Numbers<3>>,
    /// Attitude in the object's frame.
    attitude: Option<AttitudeEntry>,
});

/// Visual shape of a body: that of another body, or parts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "the name of a body, or a list of parts, is needed")]
pub enum LookValue {
    Of(String),
    Parts(Vec<PieceEntry>),
}

/// Mesh: the name of a file, or triangles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "a file name, or { vertices = …, triangles = … }, is needed")]
pub enum MeshValue {
    File(String),
    Own(SurfaceTable),
}

impl MeshValue {
    /// Name of the file.
    pub fn file(&self) -> Option<&String> {
        if let Self::File(name) = self { Some(name) } else { None }
    }
}

/// Triangles, which need not form a closed surface where they are only visual.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    deny_unknown_fields,
    expecting = "{ vertices = [[x, y, z], …], triangles = [[i, j, k], …] }"
)]
pub struct SurfaceTable {
    /// Vertices (m).
    pub vertices: Vec<Numbers<3>>,
    /// Indices of the vertices of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<Exactly<usize, 3>>,
    /// Colour in pictures; default from the body.
    pub colour: Option<Colour>,
}

/// Maximum number of triangles of a surface.
const MOST_TRIANGLES: usize = 200_000;

impl SurfaceTable {
    /// Checks the surface.
    fn check(&self) -> Result<(), String> {
        let count = self.triangles.len();
        if !(1..=MOST_TRIANGLES).contains(&count) {
            return Err(format!("triangles: {count} given; allowed: 1 to {MOST_TRIANGLES}"));
        }
        let mut numbers = self.vertices.iter().flat_map(|vertex| vertex.0);
        if let Some(invalid) = numbers.find(|number| !(-1e6..=1e6).contains(number)) {
            return Err(format!("vertices: a coordinate is {invalid} m; allowed: -1e6 to 1e6"));
        }
        let mut corners = self.triangles.iter().flat_map(|three| three.0);
        let count = self.vertices.len();
        match corners.find(|index| *index >= count) {
            Some(invalid) => Err(format!(
                "triangles: vertex {invalid} does not exist; there are {count} vertices"
            )),
            None => Ok(()),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "{ between = [\"…\", \"…\"], coefficient = … }")]
pub struct PairEntry {
    /// Names of both objects, or `ground`.
    pub between: Exactly<String, 2>,
    /// Coefficient of the pair.
    pub coefficient: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "{ between = [\"…\", \"…\"] }")]
pub struct ApartEntry {
    /// Names of both objects, or `ground`.
    pub between: Exactly<String, 2>,
}

/// Capsule or cylinder.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "{ length = …, radius = … }")]
pub struct TubeTable {
    /// Length (m); of a capsule, between the centres of its ends.
    pub length: f64,
    /// Radius (m).
    pub radius: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "{ height = …, radius = … }")]
pub struct ConeTable {
    /// Height (m).
    pub height: f64,
    /// Radius of the base (m).
    pub radius: f64,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "{ count = [x, y, z], step = [x, y, z] }")]
pub struct CopiesTable {
    /// Number of copies along x, y and z.
    pub count: Exactly<u32, 3>,
    /// Distances of the copies (m).
    pub step: Numbers<3>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields, expecting = "{ count = …, degrees = …, … }")]
pub struct RingTable {
    /// Number of copies.
    pub count: u32,
    /// Angle from one copy to the next (degrees).
    pub degrees: f64,
    /// Axis of the rotation.
    pub axis: Option<Numbers<3>>,
    /// Point on the axis (m).
    pub about: Option<Numbers<3>>,
}

/// Attitude: random, a quaternion, or a rotation about an axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "\"random\", four numbers (w, x, y, z) or { axis = [x, y, z], degrees = … } are \
                 needed"
)]
pub enum AttitudeEntry {
    /// Drawn from the seed.
    Word(Random),
    /// Quaternion w, x, y, z of any length.
    Quaternion(Numbers<4>),
    /// Rotation about an axis.
    About(AxisTable),
    /// Unit quaternion that keeps its bits.
    Exactly(ExactTable),
}

/// Unit quaternion w, x, y, z as a run had it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct ExactTable {
    /// Quaternion that is not normalised.
    exactly: Numbers<4>,
}

/// Rotation about an axis.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct AxisTable {
    /// Axis of the rotation.
    axis: Numbers<3>,
    /// Angle (degrees).
    degrees: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "one number or three are needed")]
pub enum Jitter {
    Same(f64),
    Each(Numbers<3>),
}

impl AttitudeEntry {
    /// Unit quaternion that keeps its bits when it is read.
    pub fn exact(quaternion: [f64; 4]) -> Self {
        let given = Exactly(quaternion);
        if <[f64; 4]>::from(unit(quaternion.into())) == quaternion {
            return Self::Quaternion(given);
        }
        Self::Exactly(ExactTable { exactly: given })
    }

    /// Unit quaternion w, x, y, z; `None` for a random attitude.
    pub fn quaternion(&self) -> Result<Option<[f64; 4]>, String> {
        match self {
            Self::Word(_) => Ok(None),
            Self::Quaternion(given) => {
                let quaternion = nalgebra::Vector4::from(given.0);
                if quaternion.norm() >= 1e-6 && quaternion.amax() <= 1e6 {
                    Ok(Some(unit(quaternion).into()))
                } else {
                    Err("a quaternion w, x, y, z of a length from 1e-6 to 1e6 is needed".to_owned())
                }
            }
            Self::About(AxisTable { axis, degrees }) => turn(&axis.0, *degrees).map(Some),
            Self::Exactly(ExactTable { exactly }) => {
                let is_unit = (nalgebra::Vector4::from(exactly.0).norm() - 1.0).abs() <= 1e-9;
                let why = || "exactly: a unit quaternion w, x, y, z is needed".to_owned();
                is_unit.then_some(Some(exactly.0)).ok_or_else(why)
            }
        }
    }
}

/// Unit quaternion w, x, y, z of the rotation about `axis` by `degrees`, checked.
pub fn turn(axis: &[f64; 3], degrees: f64) -> Result<[f64; 4], String> {
    let axis = Vector3::from(*axis);
    if !(axis.norm() >= 1e-6 && axis.amax() <= 1e6) {
        return Err("an axis of a length from 1e-6 to 1e6 is needed".to_owned());
    }
    if !(-3600.0..=3600.0).contains(&degrees) {
        return Err(format!("degrees is {degrees}; allowed: -3600 to 3600"));
    }
    Ok(Place::turn(axis, degrees))
}

/// Folder of the meshes of a scenario and the function that reads them.
#[derive(Clone, Copy)]
pub struct Files<'a> {
    /// Folder that mesh names are relative to.
    pub folder: &'a Path,
    /// Function that reads a file.
    pub read: tumble_model::ReadFile<'a>,
}

impl<'a> Files<'a> {
    /// No files.
    pub fn none() -> Self {
        Self {
            folder: Path::new(""),
            read: &|_, _| Err(io::Error::other("files cannot be read here")),
        }
    }

    /// Meshes in the folder of the file `path`.
    pub fn beside(path: &'a Path, read: tumble_model::ReadFile<'a>) -> Self {
        Self { folder: path.parent().unwrap_or(Path::new("")), read }
    }
}

impl PieceEntry {
    /// Exact form without its place; `None` without a form. Meshes are in `files`.
    pub fn exact_form(mut self, files: &Files<'_>) -> Result<Option<Self>, String> {
        let forms = self.forms();
        if self.radius.is_some() && !forms.iter().any(|form| ["hull", "mesh"].contains(form)) {
            return Err("radius: it has no meaning without `hull` or `mesh`".to_owned());
        }
        if self.scale.is_some() && self.mesh.is_none() {
            return Err("scale: it has no meaning without `mesh`".to_owned());
        }
        let smooth = ["cylinder", "cone", "ellipsoid"];
        if self.sides.is_some() && !forms.iter().any(|form| smooth.contains(form)) {
            let why = "it has no meaning without `cylinder`, `cone` or `ellipsoid`";
            return Err(format!("sides: {why}"));
        }
        match &self.mesh {
            Some(MeshValue::File(name)) => {
                let mesh = read_mesh(files, name, self.scale.take().unwrap_or(1.0))?;
                // Checks convexity here so that the error has the name of the file.
                mesh.hull().map_err(|error| in_mesh(files, name, &error))?;
                self.mesh = Some(MeshValue::Own(surface(&mesh)));
            }
            Some(MeshValue::Own(_)) if self.scale.is_some() => {
                return Err("scale: it has no meaning without a mesh file".to_owned());
            }
            Some(MeshValue::Own(own)) => own.check().map_err(|why| format!("mesh.{why}"))?,
            None => {}
        }
        match forms[..] {
            [] => Ok(None),
            [_] => Ok(Some(self)),
            [one, .., other] => {
                Err(format!("{other}: only one shape can be given, and there is already `{one}`"))
            }
        }
    }

    /// Exact form. An error begins with a field, or else with `: `.
    pub fn exact(self, files: &Files<'_>) -> Result<Self, String> {
        if self.surface.is_some() {
            return Err(".surface: it has no meaning outside a look; give `mesh`".to_owned());
        }
        let place = placed(self.position, self.attitude.as_ref());
        let exact = self.exact_form(files).map_err(|why| format!(".{why}"))?;
        let exact = exact.ok_or_else(|| format!(": {ONE_SHAPE}"))?;
        let exact = exact.placed_at(&place.map_err(|why| format!(".{why}"))?);
        exact.check()?;
        Ok(exact)
    }

    /// Rejects a piece in exact form that the core does not accept. An error begins with the field.
    pub fn check(&self) -> Result<(), String> {
        self.piece()
            .map(drop)
            .map_err(|error| format!(".{}: {error}", field_of(&error).unwrap_or(self.field())))
    }

    /// Exact form of the part of a look. An error begins with a field, or else with `: `.
    pub fn exact_part(self, files: &Files<'_>) -> Result<Self, String> {
        let place = placed(self.position, self.attitude.as_ref());
        let surface = self.surface.clone();
        surface
            .iter()
            .try_for_each(SurfaceTable::check)
            .map_err(|why| format!(".surface.{why}"))?;
        let exact = self.exact_form(files).map_err(|why| format!(".{why}"))?;
        let place = place.map_err(|why| format!(".{why}"))?;
        match (exact, surface) {
            (Some(form), None) => {
                let part = form.placed_at(&place);
                part.piece().map_err(|error| format!(".{}: {error}", part.field()))?;
                Ok(part)
            }
            (None, surface @ Some(_)) => Ok(Self { surface, ..Self::default() }.placed_at(&place)),
            _ => Err(format!(": {ONE_SHAPE}, or a surface")),
        }
    }

    /// Number of triangles of its surface.
    pub fn triangles(&self) -> usize {
        self.surface.as_ref().map_or(0, |surface| surface.triangles.len())
    }
}

/// Points as plain arrays.
pub fn plain(points: &[Numbers<3>]) -> Vec<[f64; 3]> {
    points.iter().map(|point| point.0).collect()
}

/// Maximum size of a mesh file (bytes).
const LARGEST_MESH: u64 = 32 << 20;

/// Triangles of a mesh.
pub fn surface(mesh: &Mesh) -> SurfaceTable {
    SurfaceTable {
        vertices: mesh.vertices().iter().map(numbers).collect(),
        triangles: mesh.triangles().iter().copied().map(Exactly).collect(),
        colour: None,
    }
}

/// Error message about a mesh file.
pub fn in_mesh(files: &Files<'_>, name: &str, why: &dyn std::fmt::Display) -> String {
    format!("mesh: {}: {why}", shown::path(&files.folder.join(name)))
}

/// Content of an OBJ or STL file of at most `most` bytes, parsed by its ending.
pub fn read_triangles<T>(
    files: &Files<'_>,
    name: &str,
    most: u64,
    parse_obj: fn(&str) -> Result<T, Error>,
    parse_stl: fn(&[u8]) -> Result<T, Error>,
) -> Result<T, String> {
    let path = &files.folder.join(name);
    let invalid = |why: &dyn std::fmt::Display| in_mesh(files, name, why);
    if !READS_FILES {
        return Err(invalid(&NO_FILES));
    }
    let bytes = (files.read)(path, most).map_err(|error| invalid(&error))?;
    let parsed = match &*crate::ending(path) {
        "obj" => {
            let text = String::from_utf8(bytes).map_err(|_| invalid(&"it is not text"))?;
            parse_obj(&text)
        }
        "stl" => parse_stl(&bytes),
        _ => {
            let needed = "a file name that ends in .obj or .stl is needed";
            return Err(invalid(&crate::remedy(path).unwrap_or(needed)));
        }
    };
    parsed.map_err(|error| invalid(&error))
}

/// Closed mesh of a file.
pub fn read_mesh(files: &Files<'_>, name: &str, scale: f64) -> Result<Mesh, String> {
    let mesh = read_triangles(files, name, LARGEST_MESH, parse_obj, parse_stl)?;
    mesh.scaled(scale).map_err(|error| in_mesh(files, name, &error))
}

/// Error message for a missing shape of a fixed object or piece.
pub const ONE_SHAPE: &str =
    "one shape is needed: box, sphere, capsule, cylinder, cone, ellipsoid, hull or mesh";

/// Place of an object, whose attitude must not be random.
pub fn placed(
    position: Option<Numbers<3>>,
    attitude: Option<&AttitudeEntry>,
) -> Result<Place, String> {
    let position = position.map_or([0.0; 3], |position| position.0);
    if !position.iter().all(|coordinate| coordinate.abs() <= 1e4) {
        return Err("position: coordinates from -1e4 to 1e4 m are needed".to_owned());
    }
    let attitude = match attitude.map(AttitudeEntry::quaternion) {
        None => Place::ORIGIN.attitude,
        Some(Ok(Some(quaternion))) => quaternion,
        Some(Ok(None)) => return Err("attitude: only bodies can have a random one".to_owned()),
        Some(Err(why)) => return Err(format!("attitude: {why}")),
    };
    Ok(Place { position, attitude })
}
