//! Robots from the files that people have: URDF and MJCF.
//!
//! A file is text here: who reads it, and how those that it names are read, is the caller's business
//! ([`Reading`]). What it says becomes a [`Robot`]: links in a tree, joints, shapes and motors, which is what a scene is
//! made of ([`Assembled`]), and whose coordinates are those of the file ([`motion`]).
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
//! An error is one sentence with the line and the element that it is about.

mod assembly;
mod between;
mod coarsening;
mod collada;
mod frame;
mod gltf;
mod joining;
mod left_out;
mod mass;
mod meshes;
mod mjcf;
pub mod model;
pub mod motion;
mod msh;
mod notes;
pub mod sensors;
mod starts;
mod urdf;
mod xml;

pub use assembly::{Assembled, Placing, USUAL_SIDES};
pub use frame::LinkFrame;
pub use starts::settled;
pub use xml::LARGEST_FILE;

use model::Robot;
use std::collections::BTreeMap;
use std::io;
use std::path::{Component, Path, PathBuf};
use tumble_model::ReadFile;
use tumble_model::shown;
use xml::Element;

/// Files of convex pieces, by the name of the mesh that they are in the place of.
pub type MeshPieces = BTreeMap<String, Vec<String>>;

static NO_PIECES: MeshPieces = BTreeMap::new();

/// How the files are read that a robot's file names, and what it does not say.
#[derive(Clone, Copy)]
pub struct Reading<'a> {
    /// The folder of the robot's file.
    pub folder: &'a Path,
    /// How a file is read, of at most so many bytes.
    pub read: ReadFile<'a>,
    /// Where the packages of `package://` are: `package://name/rest` is `name/rest` in it. Without one they are looked for
    /// beside the file and in the folders above it, the nearest first.
    pub packages: Option<&'a Path>,
    /// Of a mesh of a URDF, by the name that it has there, the files of its convex pieces; the convex hull of others counts.
    pub pieces: &'a MeshPieces,
    /// What of the file is as if it were not there: `tag` or `name` of elements, `tag:name` of one, `@attribute` of all.
    pub left_out: &'a [String],
    /// Whether the root of a URDF is fixed to the world. It flies otherwise, unless it is called `world`.
    pub is_fixed: bool,
    /// Whether contacts that MJCF has resist turning and rolling (`condim` 4 and 6) are contacts in a point, which rub alone.
    pub points_rub: bool,
}

/// How many folders above a relative path, or one with `..`, packages are looked for.
const ABOVE: usize = 8;

impl Reading<'_> {
    /// Of a file that names no others.
    #[must_use]
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

    /// The bytes of a file.
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
            return Err(format!(
                "{name}: it leaves its package; a path within it, without .., is needed"
            ));
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
                "{name}: it is neither beside the robot's file nor in a folder above; name the folder of its packages, \
                 `packages` or --packages"
            ),
        })
    }

    /// The folder of the file and those above it, the nearest first.
    fn folders_above(&self) -> Vec<PathBuf> {
        let mut folders = Vec::new();
        let mut last = self.folder;
        for folder in self.folder.ancestors() {
            folders.push(folder.to_owned());
            last = folder;
            // What stands before `..` is below it.
            if folder.ends_with("..") {
                break;
            }
        }
        if !last.has_root() || last.ends_with("..") {
            folders.extend((1..=ABOVE).map(|count| last.join("../".repeat(count))));
        }
        folders
    }

    /// The text of a file.
    fn text(&self, name: &str, most: u64) -> Result<String, String> {
        let bytes = self.bytes(name, most)?;
        String::from_utf8(bytes).map_err(|_| format!("{}: it is no text", shown::line(name)))
    }
}

/// Whether nothing is where it was looked for.
fn is_missing(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::NotFound | io::ErrorKind::NotADirectory)
}

fn no_files(_: &Path, _: u64) -> io::Result<Vec<u8>> {
    Err(io::Error::new(io::ErrorKind::Unsupported, "no files are read here"))
}

/// The robot of the text of a file, URDF or MJCF.
///
/// # Errors
/// The first thing that is wrong with it, in one sentence with its line.
pub fn read(text: &str, reading: &Reading<'_>) -> Result<Robot, String> {
    if text.len() as u64 > LARGEST_FILE {
        return Err(format!("it is longer than {LARGEST_FILE} bytes"));
    }
    let root = Element::parse(text, None)?;
    let mut robot = match &*root.tag {
        "mujoco" => mjcf::read(&root, reading)?,
        "robot" => urdf::read(&root, reading)?,
        "sdf" => return Err(root.wrong("SDF is not read; URDF and MJCF are")),
        _ => return Err(root.wrong("<robot> (URDF) or <mujoco> (MJCF) is needed")),
    };
    for link in 1..robot.links.len() {
        let joints = robot.joints_of(link);
        let turns = |joint: &model::RobotJoint| {
            matches!(joint.moves, model::Moves::Free | model::Moves::Ball)
        };
        if let (Some(odd), 2..) = (joints.iter().find(|joint| turns(joint)), joints.len()) {
            return Err(format!(
                "{}: a ball or free joint must be the only joint of its body",
                odd.at
            ));
        }
    }
    between::put(&mut robot);
    Ok(robot)
}
