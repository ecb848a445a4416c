//! The tutorial's scenes, whose documents are part of the program.

use super::choices::SceneName;
use super::overrides::FieldOverride;
use super::scene::Scene;
use super::settings::RobotSettings;
use std::io;
use std::path::Path;
use tumble_model::failure::Failure;

/// Solver of the thrown cube in a build with Ipopt.
const IPOPT: &str = "[solver]\nname = \"ipopt\"\n";

impl Scene {
    /// Scene of the tutorial with the fields of `overrides`.
    ///
    /// The thrown cube has Ipopt as its solver, in a build with Ipopt and if it does not bounce, which
    /// Ipopt's program does not support.
    ///
    /// # Errors
    /// The first invalid value.
    pub fn from_tutorial(
        name: SceneName,
        overrides: &[FieldOverride],
        robot: &RobotSettings,
    ) -> Result<Self, Failure> {
        let mut text = match name {
            SceneName::Drop => include_str!("tutorial/drop.toml").to_owned(),
            SceneName::Floating => include_str!("tutorial/floating.toml").to_owned(),
        };
        let bounces =
            |field: &FieldOverride| field.path() == "ground.restitution" && field.is_nonzero();
        let takes_ipopt = cfg!(feature = "ipopt") && !overrides.iter().any(bounces);
        if name == SceneName::Drop && takes_ipopt {
            text += IPOPT;
        }
        let none = |_: &Path, _: u64| Err(io::Error::other("there are no files"));
        let path = Path::new("the tutorial's scene");
        let scene = Self::parse_with(&text, path, overrides, robot, &none)?;
        Ok(Self { trajectory: true, ..scene })
    }
}
