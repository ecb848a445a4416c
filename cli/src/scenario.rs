//! Reading of scenario files.

use super::input;
use super::outcome::Failure;
use std::path::Path;
use tumble_model::shown;
use tumble_scene::LARGEST_FILE;

/// Text of a scenario file or a robot's file.
pub fn read_text(path: &Path) -> Result<String, Failure> {
    let file = shown::path(path);
    if let Some(why) = tumble_scene::remedy(path) {
        return Err(Failure::Input(format!("{file}: {why}")));
    }
    let is_robot = path
        .extension()
        .is_some_and(|end| ["urdf", "sdf", "xml"].contains(&&*end.to_string_lossy()));
    let most = if is_robot { tumble_robot::LARGEST_FILE } else { LARGEST_FILE };
    let unreadable = |error| format!("{file}: cannot be read as a scenario: {error}");
    input::text(path, most).map_err(|error| Failure::Input(unreadable(error)))
}
