//! Scenario files: simulations described in TOML. `scenarios/README.md` describes every field.
//!
//! A file is passed as text. The caller reads it and provides a function that reads mesh files.
//! Flags and keywords are fields of the document ([`overrides`]). The tutorial's scenes are documents of
//! the program (`tutorial.rs`):
//!
//! ```text
//! text, fields ─► Document ─► Document in exact form ─► Scene with its World
//!                 document.rs bodies/build/             bodies/world.rs
//! ```
//!
//! An *entry* is one table of the file, such as a `[[bodies]]` table. It can describe several
//! bodies by `copies`. The exact form has an entry for each body.

mod bodies;
pub mod choices;
mod coefficients;
mod document;
pub mod joints_summary;
pub mod label;
mod locks;
mod naming;
mod notes;
pub mod output;
pub mod overrides;
mod robots;
pub mod row_counts;
pub mod row_selection;
pub mod run_file;
pub mod scene;
mod scene_text;
#[cfg(feature = "schema")]
mod schema;
pub mod settings;
mod short_form;
pub mod solver_choice;
#[cfg(feature = "statics")]
pub mod statics;
mod tables;
pub mod tutorial;
pub mod written;

pub use bodies::entries::AttitudeEntry;
pub use bodies::masses::LARGEST_PART;

pub use document::{Document, LARGEST_START};
pub use robots::Assembled;
use serde::de::DeserializeOwned;
use std::path::Path;
pub use tables::{InertiaValue, Random, SolidInertia};
use tumble_core::geometry::mesh::Mesh;
use tumble_model::ReadFile;
use tumble_model::failure::Failure;
use tumble_model::{fields, shown};

/// Maximum size of a scenario file (bytes).
pub const LARGEST_FILE: u64 = 4 << 20;

/// Closed mesh of an OBJ or STL file, with its lengths multiplied by `scale`.
///
/// # Errors
/// A file that cannot be read; a mesh that is not closed; a name that is not Unicode.
pub fn read_mesh(path: &Path, scale: f64, read: ReadFile<'_>) -> Result<Mesh, Failure> {
    let name = path.to_str().ok_or_else(|| {
        let path = shown::path(path);
        Failure::Input(format!("{path}: the name is not Unicode; rename the file"))
    })?;
    let files = bodies::entries::Files { folder: Path::new(""), read };
    bodies::entries::read_mesh(&files, name, scale).map_err(Failure::Input)
}

/// Ending of a file in lower case; empty without one.
pub(crate) fn ending(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// Remedy for a file that is neither a scene nor a robot, by its ending.
pub fn remedy(path: &Path) -> Option<&'static str> {
    match &*ending(path) {
        "obj" | "stl" => Some("it is a mesh; `tumble convert` makes a scene of it"),
        "step" | "stp" | "iges" | "igs" | "fcstd" | "sldprt" => Some(
            "CAD files are not read; export the part as .stl, or convert it by \
                  `gmsh -2 FILE -o PART.stl` (Debian package gmsh)",
        ),
        "ply" | "glb" | "gltf" | "dae" | "3mf" | "off" | "fbx" | "msh" => Some(
            "this mesh format is not read; convert it by `assimp export FILE PART.stl` (Debian \
             package assimp-utils)",
        ),
        _ => None,
    }
}

/// True if the file is a robot's: its extension is `urdf`, `sdf` or `xml`, or the text begins as XML.
fn is_robot(text: &str, path: &Path) -> bool {
    let is_called_so = path
        .extension()
        .is_some_and(|end| ["urdf", "sdf", "xml"].contains(&&*end.to_string_lossy()));
    is_called_so || text.trim_start_matches('\u{feff}').trim_start().starts_with('<')
}

/// Parses a TOML text.
///
/// # Errors
/// A sentence with the field and the line.
pub fn parse<T: DeserializeOwned>(text: &str) -> Result<T, String> {
    let deserializer =
        toml::Deserializer::parse(text).map_err(|error| sentence(text, ".", &error))?;
    serde_path_to_error::deserialize(deserializer)
        .map_err(|error| sentence(text, &error.path().to_string(), error.inner()))
}

/// Error message with the field, the line number and the start of the line.
fn sentence(text: &str, field: &str, error: &toml::de::Error) -> String {
    let message = fields::named(field, error.message());
    let Some(span) = error.span() else { return message };
    let before = &text.as_bytes()[..span.start.min(text.len())];
    let line = before.iter().filter(|byte| **byte == b'\n').count();
    let shown: String = text.lines().nth(line).unwrap_or("").trim().chars().take(60).collect();
    if shown.is_empty() {
        return message;
    }
    format!("line {}, `{shown}`: {message}", line + 1)
}

/// Compiles the programs of `docs/robots.md`.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/robots.md")]
struct Robots;
