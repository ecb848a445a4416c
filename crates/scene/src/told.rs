//! Scenes from what is written: a scenario in either notation, a robot's file, the tutorial's scenes.

use super::bodies::entries::Files;
use super::choices::{SceneName, SolverName};
use super::file::ParsedScene;
use super::scene::Scene;
use super::settings::Settings;
use super::{bodies, body};
use std::path::Path;
use tumble_model::ReadFile;
use tumble_model::failure::{Failure, refuse_flags};
use tumble_model::names::FileKind;

impl Scene {
    /// The scene of the scenario `path`, whose text is `text`, under `flags`. The native solver
    /// solves it where neither says who does. The files of meshes are read by `read`.
    ///
    /// # Errors
    /// The first thing that cannot be; a seed where nothing is random.
    pub fn of_text(
        text: &str,
        path: &Path,
        flags: Settings,
        read: ReadFile<'_>,
    ) -> Result<Self, Failure> {
        Self::told(text, path, flags, &[], SolverName::Native, read)
    }

    /// The same under `flags` that have the names `given`, and are called so where one is refused.
    /// Of `[body]`, `usual` solves where neither says who does.
    ///
    /// # Errors
    /// As [`Scene::of_text`].
    pub fn told(
        text: &str,
        path: &Path,
        flags: Settings,
        given: &[&str],
        usual: SolverName,
        read: ReadFile<'_>,
    ) -> Result<Self, Failure> {
        if super::is_robot(text, path) {
            return Self::of_robot(text, path, flags, given, read);
        }
        flags.robot.refuse()?;
        let (name, ParsedScene { settings: below, ground, entries }) = super::read(text, path)?;
        match entries {
            None => body::refuse_idle_settings(ground, &flags)?,
            Some(_) => bodies::refuse_idle_settings(&flags)?,
        }
        let (changed, seed_given) = (flags.changed(&below), flags.seed.is_some());
        let settings = flags.over(below);
        let scene = match entries {
            None => body::scene(name, ground, &settings, usual),
            Some(entries) => {
                let folder = path.parent().unwrap_or(Path::new(""));
                bodies::scene(name, &settings, entries, Files { folder, read })
            }
        };
        let scene = scene.map_err(|failure| failure.in_file(path, FileKind::Scenario, given))?;
        let idle_seed = seed_given && !scene.drawn;
        refuse_flags("a scene of which nothing is random", &[("--seed", idle_seed)])?;
        Ok(Self { changed, ..scene })
    }

    /// The scene of a robot's file alone: its own world, or level ground under one that has none.
    fn of_robot(
        text: &str,
        path: &Path,
        flags: Settings,
        given: &[&str],
        read: ReadFile<'_>,
    ) -> Result<Self, Failure> {
        bodies::refuse_idle_settings(&flags)?;
        let (robot, name) = bodies::robots::read_alone(text, path, &flags.robot, read)?;
        let place = "MJCF, which has the friction of everything";
        refuse_flags(place, &[("--mu", flags.mu.is_some() && robot.options.has_world)])?;
        refuse_flags("a scene of which nothing is random", &[("--seed", flags.seed.is_some())])?;
        let below = bodies::robots::settings_of(&robot);
        let changed = flags.changed(&below);
        let scene = bodies::scene_of_robot(name, &flags.over(below), &robot);
        let scene = scene.map_err(|failure| failure.in_file(path, FileKind::Scenario, given))?;
        Ok(Self { changed, ..scene })
    }

    /// A scene of the tutorial under `flags`, solved by `usual` where they name no solver.
    ///
    /// # Errors
    /// The first thing that cannot be.
    pub fn of_tutorial(
        name: SceneName,
        flags: Settings,
        usual: SolverName,
    ) -> Result<Self, Failure> {
        let ground = name == SceneName::Drop;
        flags.robot.refuse()?;
        body::refuse_idle_settings(ground, &flags)?;
        let below = Settings::of_scene(name);
        let changed = flags.changed(&below);
        let scene = body::scene(name.scene().name.to_owned(), ground, &flags.over(below), usual)?;
        Ok(Self { changed, ..scene })
    }

    /// This scene with one body more, the last: `text` is that of a table `[[bodies]]`, whose meshes are beside
    /// `path`, and are read by `read`. Where it starts is not held against the other bodies.
    ///
    /// # Errors
    /// The first thing that cannot be; a scene of `[body]`.
    pub fn with_body(&self, text: &str, path: &Path, read: ReadFile<'_>) -> Result<Self, Failure> {
        let entry = super::parse(text).map_err(Failure::Input)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        bodies::with_body(self, entry, Files { folder, read })
    }

    /// This scene without the body `index`, and without the joints that tie it; those after it move up by one.
    ///
    /// # Errors
    /// The only body; a scene of `[body]`.
    pub fn without_body(&self, index: usize) -> Result<Self, Failure> {
        bodies::without_body(self, index)
    }
}
