//! Reader of robot files: URDF, SDF and MJCF.
//!
//! The crate works on text. The caller supplies the text and a function that reads the files it
//! refers to ([`Reading`]). The result is a [`Robot`]: a tree of links with joints, shapes and
//! motors. `tumble_scene` places it in a scene. Module [`motion`] describes its
//! coordinates, which are those of the file.
//!
//! ```
//! use tumble_robot::{Reading, read};
//!
//! let text = r#"<mujoco><worldbody><body name="ball"><freejoint/><geom size="0.1"/></body></worldbody></mujoco>"#;
//! let robot = read(text, &Reading::none())?;
//! assert_eq!(robot.counts(), (7, 6));
//! # Ok::<(), String>(())
//! ```
//!
//! An error is one sentence that names the line and the element.

mod between;
mod coarsening;
mod collada;
pub mod frame;
mod gltf;
pub mod joining;
mod left_out;
mod mass;
mod meshes;
mod mjcf;
pub mod model;
pub mod motion;
mod msh;
mod notes;
mod painted;
mod sdf;
pub mod sensors;
mod urdf;
mod xml;

pub use frame::LinkFrame;
pub use xml::LARGEST_FILE;

use model::Robot;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io;
use std::path::{Component, Path, PathBuf};
use tumble_decompose::DecompositionSettings;
use tumble_model::ReadFile;
use tumble_model::shown;
use xml::Element;

/// Convex pieces that replace a mesh, by the name of the mesh.
pub type MeshPieces = BTreeMap<String, PiecesOfMesh>;

/// Source of the convex pieces of a mesh.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(
    untagged,
    expecting = "a list of files or { pieces = …, resolution = …, concavity = … } is needed"
)]
pub enum PiecesOfMesh {
    /// A file for each piece.
    Files(Vec<String>),
    /// The mesh itself, which is decomposed.
    Decomposed(DecompositionSettings),
}

static NO_PIECES: MeshPieces = BTreeMap::new();

/// Access to the files that a robot's file refers to, and options beyond the file.
#[derive(Clone, Copy)]
pub struct Reading<'a> {
    /// Folder of the robot's file.
    pub folder: &'a Path,
    /// Function that reads a file up to a maximum number of bytes.
    pub read: ReadFile<'a>,
    /// Folder of the packages: `package://name/rest` is `name/rest` in it. Without it, packages are
    /// searched beside the robot's file and then in the folders above, the nearest first.
    pub packages: Option<&'a Path>,
    /// Convex pieces of URDF and SDF meshes, by the mesh's name in the file. Other meshes collide as their
    /// convex hull.
    pub pieces: &'a MeshPieces,
    /// Parts of the file to ignore: `tag` or `name` of elements, `tag:name` of one element,
    /// `@attribute` of all elements.
    pub left_out: &'a [String],
    /// True to fix the root of a URDF and the links without parent of an SDF to the world.
    /// Otherwise they float, unless the name of the root is `world`.
    pub is_fixed: bool,
    /// True to reduce MJCF contacts with torsional and rolling friction (`condim` 4 and 6) to point
    /// contacts with sliding friction only.
    pub points_rub: bool,
}

/// Number of parent folders to search for packages above a relative path or one with `..`.
const ABOVE: usize = 8;

impl Reading<'_> {
    /// Reading of a file that refers to no others.
    pub fn none() -> Self {
        Reading {
            folder: Path::new(""),
            read: &no_files,
            packages: None,
            pieces: &NO_PIECES,
            left_out: &[],
            is_fixed: false,
            points_rub: false,
        }
    }

    /// Reads a file of at most `most` bytes.
    fn bytes(&self, name: &str, most: u64) -> Result<Vec<u8>, String> {
        let Some(rest) = name.strip_prefix("package://").or(name.strip_prefix("model://")) else {
            let path = self.folder.join(name.strip_prefix("file://").unwrap_or(name));
            return (self.read)(&path, most)
                .map_err(|error| format!("{}: {error}", shown::path(&path)));
        };
        let folders = match self.packages {
            Some(packages) => vec![packages.to_owned()],
            None => self.folders_above(),
        };
        let is_within =
            |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
        if !Path::new(rest).components().all(is_within) {
            let name = shown::line(name);
            return Err(format!("{name}: it leaves its package; use a path without .."));
        }
        for path in folders.iter().map(|folder| folder.join(rest)) {
            match (self.read)(&path, most) {
                Err(error) if is_missing(&error) => {}
                Err(error) => return Err(format!("{}: {error}", shown::path(&path))),
                Ok(bytes) => return Ok(bytes),
            }
        }
        let name = shown::line(name);
        Err(match self.packages {
            Some(packages) => format!("{name}: it is not in {}", shown::path(packages)),
            None => format!(
                "{name}: it is neither in the folder of the robot file nor in one above; give the \
                 folder of its packages with `packages` or --packages"
            ),
        })
    }

    /// Folder of the file and its ancestors, the nearest first.
    fn folders_above(&self) -> Vec<PathBuf> {
        let mut folders = Vec::new();
        let mut last = self.folder;
        for folder in self.folder.ancestors() {
            folders.push(folder.to_owned());
            last = folder;
            // A component before `..` lies below that folder.
            if folder.ends_with("..") {
                break;
            }
        }
        if !last.has_root() || last.ends_with("..") {
            folders.extend((1..=ABOVE).map(|count| last.join("../".repeat(count))));
        }
        folders
    }

    /// Reads a text file.
    fn text(&self, name: &str, most: u64) -> Result<String, String> {
        let bytes = self.bytes(name, most)?;
        String::from_utf8(bytes)
            .map_err(|_| format!("{}: it is not UTF-8 text; save it as UTF-8", shown::line(name)))
    }
}

/// True if the error says that a file does not exist.
fn is_missing(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory)
}

fn no_files(_: &Path, _: u64) -> io::Result<Vec<u8>> {
    Err(io::Error::new(io::ErrorKind::Unsupported, "reading other files is not supported here"))
}

/// Parses the text of a URDF, SDF or MJCF file.
///
/// # Errors
/// The first fault, as one sentence with its line.
pub fn read(text: &str, reading: &Reading<'_>) -> Result<Robot, String> {
    if text.len() as u64 > LARGEST_FILE {
        return Err(format!("it is longer than {LARGEST_FILE} bytes"));
    }
    let root = Element::parse(text, None)?;
    let mut robot = match &*root.tag {
        "mujoco" => mjcf::read(&root, reading)?,
        "robot" => urdf::read(&root, reading)?,
        "sdf" => sdf::read(&root, reading)?,
        _ => return Err(root.wrong("<robot> (URDF), <sdf> or <mujoco> (MJCF) is needed")),
    };
    for link in 1..robot.links.len() {
        let joints = robot.joints_of(link);
        let turns = |joint: &model::RobotJoint| {
            matches!(joint.moves, model::Moves::Free | model::Moves::Ball)
        };
        if let (Some(hinge), 2..) = (joints.iter().find(|joint| turns(joint)), joints.len()) {
            return Err(format!(
                "{}: a ball or free joint must be the only joint of its body",
                hinge.at
            ));
        }
    }
    between::put(&mut robot);
    Ok(robot)
}
