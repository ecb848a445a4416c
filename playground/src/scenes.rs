//! Scenes of the page, and the files that they read.

use std::io;
use std::path::{Component, Path, PathBuf};
use tumble_core::contact::Detection;
use tumble_model::failure::Failure;
use tumble_scene::run_file;
use tumble_scene::scene::Scene;
use tumble_scene::solver_choice::SolverTable;
use tumble_scene::written;

/// A scene of the page.
#[derive(Debug, Clone, Copy)]
pub struct PageScene {
    /// Title in the list.
    pub title: &'static str,
    /// Text of the scenario file.
    pub text: &'static str,
}

/// Scenes of the page, the first of which it opens.
pub const SCENES: [PageScene; 8] = [
    PageScene { title: "Thrown cube", text: include_str!("../scenes/drop.toml") },
    PageScene { title: "Arch", text: include_str!("../scenes/arch.toml") },
    PageScene { title: "House of cards", text: include_str!("../scenes/card-house.toml") },
    PageScene { title: "Dominoes", text: include_str!("../scenes/dominoes.toml") },
    PageScene { title: "Marbles", text: include_str!("../scenes/marbles.toml") },
    PageScene { title: "Tower", text: include_str!("../scenes/stack.toml") },
    PageScene { title: "Robot", text: include_str!("../scenes/quadruped.toml") },
    PageScene { title: "Conveyor", text: include_str!("../scenes/tray-and-conveyor.toml") },
];

/// Place of all scenes in the tree of the page's files.
const PLACE: &str = "scenarios/scene.toml";

/// Files that scenes of the page can read.
const FILES: [(&str, &[u8]); 1] =
    [("data/robots/quadruped.urdf", include_bytes!("../scenes/quadruped.urdf"))];

/// Scene of a text, with the native solver and the seed of its file.
///
/// # Errors
/// The first fault of the text, as on the command line.
pub fn read(text: &str) -> Result<Scene, Failure> {
    let scene = Scene::from_text(text, Path::new(PLACE), &[], &file)?;
    run_file::refuse_large(&scene.document)?;
    Ok(scene)
}

/// Text of the page for a scene: a table for each body, and the settings of the native solver that
/// differ from the usual ones.
///
/// # Errors
/// A scene that no text can hold.
pub fn text(scene: &Scene) -> Result<String, Failure> {
    let mut scene = scene.clone();
    if let Some(contact) = &scene.contact {
        let detection = Some(contact.detection).filter(|of| *of != Detection::default());
        let settings =
            SolverTable { detection, residual: contact.residual(), ..SolverTable::default() };
        scene.document.solver = Some(settings).filter(|of| *of != SolverTable::default());
    }
    written::text(&scene)
}

/// Content of a file of the page.
fn file(path: &Path, most: u64) -> io::Result<Vec<u8>> {
    let path = plain(path);
    let found = FILES.iter().find(|(name, _)| Path::new(name) == path);
    let (_, bytes) = found.ok_or_else(|| io::Error::other(tumble_model::NO_FILES))?;
    if bytes.len() as u64 > most {
        return Err(io::Error::other("the file is too large"));
    }
    Ok(bytes.to_vec())
}

/// Path without `.` and `..`.
fn plain(path: &Path) -> PathBuf {
    let mut plain = PathBuf::new();
    for part in path.components() {
        match part {
            Component::ParentDir => {
                plain.pop();
            }
            Component::CurDir => {}
            other => plain.push(other),
        }
    }
    plain
}
