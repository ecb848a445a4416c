//! Scenes from text: scenario files and robot files.

use super::bodies;
use super::bodies::entries::Files;
use super::document::Document;
use super::overrides::{FieldOverride, placed};
use super::scene::Scene;
use super::settings::RobotSettings;
use super::written::toml_text;
use std::path::Path;
use tumble_core::geometry::Piece;
use tumble_model::ReadFile;
use tumble_model::failure::Failure;
use tumble_model::shown;

impl Scene {
    /// Scene of the scenario file `path` with the content `text` and the fields of `overrides`.
    ///
    /// `read` reads mesh files.
    ///
    /// # Errors
    /// The first invalid value; a seed for a scene without random parts.
    pub fn from_text(
        text: &str,
        path: &Path,
        overrides: &[FieldOverride],
        read: ReadFile<'_>,
    ) -> Result<Self, Failure> {
        Self::parse_with(text, path, overrides, &RobotSettings::default(), read)
    }

    /// Scene of a scenario file or, with the settings of `robot`, of a robot file.
    ///
    /// A robot stands in the world of its file, or else on level ground.
    ///
    /// # Errors
    /// The errors of [`Scene::from_text`]. An error about a flag or keyword names it.
    pub fn parse_with(
        text: &str,
        path: &Path,
        overrides: &[FieldOverride],
        robot: &RobotSettings,
        read: ReadFile<'_>,
    ) -> Result<Self, Failure> {
        let in_place = |failure| placed(failure, overrides, path);
        let (scene, changed) = if super::is_robot(text, path) {
            let (read, name) = super::robots::entry::read_alone(text, path, robot, read)?;
            let is_rubbing = |field: &FieldOverride| field.path() == "ground.friction";
            if read.options.has_world && overrides.iter().any(is_rubbing) {
                let place = "MJCF, which has all friction coefficients";
                return Err(in_place(Failure::idle("ground.friction", place)));
            }
            if let Some(field) = overrides.iter().find(|field| !field.is_of_head()) {
                return Err(Failure::Input(format!(
                    "--set: a robot file (XML) has no field {}; name the file under [[robots]] in a \
                     scenario",
                    field.path()
                )));
            }
            let head = super::robots::entry::document_of(&read);
            let (document, mut changed) =
                Document::from_text(&head, overrides).map_err(in_place)?;
            let given = robot.given().into_iter().skip(1).filter(|(_, given)| *given);
            changed.extend(given.map(|(name, _)| name.to_owned()));
            (bodies::scene_from_robot(name, &document, &read), changed)
        } else {
            robot.refuse()?;
            let (mut document, changed) = Document::from_text(text, overrides).map_err(in_place)?;
            let stem = || path.file_stem().map(|stem| stem.to_string_lossy().into_owned());
            let name = document.name.take().or_else(stem).unwrap_or_default();
            if !shown::is_name(&name) {
                let why = "1 to 80 characters in one line are needed";
                return Err(in_place(Failure::setting("name", why)));
            }
            (bodies::scene(name, document, Files::beside(path, read)), changed)
        };
        let scene = scene.map_err(in_place)?;
        if overrides.iter().any(|field| field.path() == "seed") && !scene.drawn {
            return Err(in_place(Failure::idle("seed", "a scene without random values")));
        }
        Ok(Self { changed, ..scene })
    }

    /// Document of the bodies and constants of this scene, for [`Scene::with_text`].
    ///
    /// # Errors
    /// A scene that no text can hold.
    pub fn model_text(&self) -> Result<String, Failure> {
        toml_text(&self.document)
    }

    /// This scene with the bodies and constants of a `text` of [`Scene::model_text`].
    ///
    /// # Errors
    /// The first invalid value.
    pub fn with_text(self, text: &str) -> Result<Self, Failure> {
        let (document, _) = Document::from_text(text, &[])?;
        self.with_document(document.exact()?)
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
