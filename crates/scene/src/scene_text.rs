//! Scenes from text: scenario files and robot files.

use super::bodies;
use super::bodies::entries::Files;
use super::file::ParsedScene;
use super::scene::Scene;
use super::settings::Settings;
use std::path::Path;
use tumble_core::geometry::Piece;
use tumble_model::ReadFile;
use tumble_model::failure::{Failure, refuse_flags};
use tumble_model::names::FileKind;

impl Scene {
    /// Scene of the scenario file `path` with the content `text`; `flags` take precedence.
    ///
    /// `read` reads mesh files.
    ///
    /// # Errors
    /// The first invalid value; a seed for a scene without random parts.
    pub fn from_text(
        text: &str,
        path: &Path,
        flags: Settings,
        read: ReadFile<'_>,
    ) -> Result<Self, Failure> {
        Self::parse_with(text, path, flags, &[], read)
    }

    /// Scene of the scenario file `path` with the content `text`, for the command line.
    ///
    /// Values in `flags` override those of the file. `given` names the flags on the command line,
    /// so that an error about such a value names its flag.
    ///
    /// # Errors
    /// The errors of [`Scene::from_text`].
    pub fn parse_with(
        text: &str,
        path: &Path,
        flags: Settings,
        given: &[&str],
        read: ReadFile<'_>,
    ) -> Result<Self, Failure> {
        if super::is_robot(text, path) {
            return Self::from_robot(text, path, flags, given, read);
        }
        flags.robot.refuse()?;
        let (name, ParsedScene { settings: below, floats, entries }) = super::read(text, path)?;
        if floats {
            bodies::refuse_contact_settings(&flags)?;
        }
        let (changed, seed_given) = (flags.changed(&below), flags.seed.is_some());
        let settings = flags.over(below);
        let scene = bodies::scene(name, floats, &settings, entries, Files::beside(path, read));
        let scene = scene.map_err(|failure| failure.in_file(path, FileKind::Scenario, given))?;
        let idle_seed = seed_given && !scene.drawn;
        refuse_flags("a scene without random values", &[("--seed", idle_seed)])?;
        Ok(Self { changed, ..scene })
    }

    /// Scene of a single robot file: with the file's world, or else on level ground.
    fn from_robot(
        text: &str,
        path: &Path,
        flags: Settings,
        given: &[&str],
        read: ReadFile<'_>,
    ) -> Result<Self, Failure> {
        let (robot, name) = bodies::robots::read_alone(text, path, &flags.robot, read)?;
        let place = "MJCF, which has all friction coefficients";
        refuse_flags(place, &[("--mu", flags.mu.is_some() && robot.options.has_world)])?;
        refuse_flags("a scene without random values", &[("--seed", flags.seed.is_some())])?;
        let below = bodies::robots::settings_of(&robot);
        let changed = flags.changed(&below);
        let scene = bodies::scene_from_robot(name, &flags.over(below), &robot);
        let scene = scene.map_err(|failure| failure.in_file(path, FileKind::Scenario, given))?;
        Ok(Self { changed, ..scene })
    }

    /// This scene with one more body at the end of the list.
    ///
    /// `text` is the content of one `[[bodies]]` table. Its meshes are relative to the folder of
    /// `path`, and `read` reads them. Overlap with other bodies is not checked.
    ///
    /// # Errors
    /// The first invalid value.
    pub fn with_body(&self, text: &str, path: &Path, read: ReadFile<'_>) -> Result<Self, Failure> {
        let entry = super::parse(text).map_err(Failure::Input)?;
        bodies::with_body(self, entry, Files::beside(path, read))
    }

    /// Convex piece that the fields of a piece in `pieces` describe, for queries. Its mesh is
    /// relative to `path`.
    ///
    /// # Errors
    /// The first invalid value.
    pub fn piece_from_text(text: &str, path: &Path, read: ReadFile<'_>) -> Result<Piece, Failure> {
        let entry = super::parse(text).map_err(Failure::Input)?;
        bodies::piece(entry, Files::beside(path, read))
    }

    /// This scene without the body `index` and its joints. The indices of later bodies decrease by
    /// one.
    ///
    /// # Errors
    /// The only body.
    pub fn without_body(&self, index: usize) -> Result<Self, Failure> {
        bodies::without_body(self, index)
    }
}
