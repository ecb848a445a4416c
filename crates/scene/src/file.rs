//! Scenario file as deserialised, and its conversion.

use super::bodies::SceneEntries;
use super::bodies::driven::{DrivenEntry, SurfaceEntry};
use super::bodies::entries::{ApartEntry, BodyEntry, FixedEntry, PairEntry};
use super::bodies::gears::GearEntry;
use super::bodies::joints::{JointEntry, MotorEntry};
use super::bodies::robots::RobotEntry;
use super::bodies::terrain::TerrainEntry;
use super::settings::Settings;
use super::tables::{BodyTable, GroundTable, LoadTable, SolverTable, StartTable};
use nalgebra::Vector3;
use serde::Deserialize;
use tumble_core::mechanics::Rotation;
use tumble_model::fields::{Gravity, table_if_any};

/// Scenario file in either notation.
///
/// The first has the tables `[body]`, `[start]` and `[load]`, whose fields are settings. The second
/// has `[[bodies]]` and its related tables.
#[derive(Deserialize)]
#[serde(expecting = "a scenario")]
#[serde(deny_unknown_fields)]
pub struct ScenarioFile {
    pub name: Option<String>,
    steps: Option<u64>,
    start_index: Option<u64>,
    time_step: Option<f64>,
    rotation: Option<Rotation>,
    seed: Option<u32>,
    gravity: Option<Gravity>,
    #[serde(default, deserialize_with = "table_if_any")]
    ground: Option<GroundTable>,
    #[serde(default, deserialize_with = "table_if_any")]
    solver: Option<SolverTable>,
    #[serde(default, deserialize_with = "table_if_any")]
    body: Option<BodyTable>,
    #[serde(default, deserialize_with = "table_if_any")]
    start: Option<StartTable>,
    #[serde(default, deserialize_with = "table_if_any")]
    load: Option<LoadTable>,
    bodies: Option<Vec<BodyEntry>>,
    fixed: Option<Vec<FixedEntry>>,
    terrain: Option<Vec<TerrainEntry>>,
    friction: Option<Vec<PairEntry>>,
    restitution: Option<Vec<PairEntry>>,
    joints: Option<Vec<JointEntry>>,
    motors: Option<Vec<MotorEntry>>,
    gears: Option<Vec<GearEntry>>,
    driven: Option<Vec<DrivenEntry>>,
    surfaces: Option<Vec<SurfaceEntry>>,
    apart: Option<Vec<ApartEntry>>,
    robots: Option<Vec<RobotEntry>>,
}

/// Largest start index k. The times k h of all later steps are still distinct doubles.
pub const LARGEST_START: u64 = 9_000_000_000_000_000;

/// Content of a file without its name.
pub struct ParsedScene {
    /// Settings that are also flags.
    pub settings: Settings,
    /// True if the file has a table `[ground]`.
    pub ground: bool,
    /// Tables of the notation `[[bodies]]`; `None` for the notation `[body]`.
    pub entries: Option<SceneEntries>,
}

impl ScenarioFile {
    /// Converts the fields. Settings of the ground stay `None` without a `[ground]` table.
    pub fn said(mut self) -> Result<ParsedScene, String> {
        let is_of_bodies = self.bodies.is_some()
            || self.robots.is_some()
            || ((self.fixed.is_some() || self.terrain.is_some()) && self.body.is_none());
        self.refuse_idle_and_missing(is_of_bodies)?;
        let steps = self.steps.unwrap_or(1000);
        if !(1..=10_000_000).contains(&steps) {
            return Err(format!("steps is {steps}; allowed: 1 to 10000000"));
        }
        if let Some(index) = self.start_index.filter(|index| *index > LARGEST_START) {
            return Err(format!("start_index is {index}; allowed: 0 to {LARGEST_START}"));
        }
        let mut settings = Settings {
            steps: Some(steps),
            start_index: self.start_index,
            seed: self.seed,
            dt: Some(self.time_step.unwrap_or(0.002)),
            gravity: Some(self.gravity.map_or(Vector3::new(0.0, 0.0, -9.81), Gravity::vector)),
            ..Settings::default()
        };
        let ground = self.ground.is_some();
        if let Some(table) = self.ground {
            settings.rotation = Some(self.rotation.unwrap_or(Rotation::Momentum));
            table.set(&mut settings, is_of_bodies)?;
        }
        if let Some(table) = self.body.take() {
            table.set(&mut settings)?;
        }
        if let Some(table) = self.start.take() {
            table.set(&mut settings)?;
        }
        if let Some(table) = self.load.take() {
            table.set(&mut settings)?;
        }
        if let Some(table) = self.solver {
            table.set(&mut settings);
        }
        let entries = is_of_bodies.then(|| SceneEntries {
            bodies: self.bodies.unwrap_or_default(),
            fixed: self.fixed.unwrap_or_default(),
            terrain: self.terrain.unwrap_or_default(),
            friction: self.friction.unwrap_or_default(),
            restitution: self.restitution.unwrap_or_default(),
            joints: self.joints.unwrap_or_default(),
            motors: self.motors.unwrap_or_default(),
            gears: self.gears.unwrap_or_default(),
            driven: self.driven.unwrap_or_default(),
            surfaces: self.surfaces.unwrap_or_default(),
            apart: self.apart.unwrap_or_default(),
            robots: self.robots.unwrap_or_default(),
        });
        Ok(ParsedScene { settings, ground, entries })
    }

    /// Rejects missing fields and fields without effect, such as fields of the other notation.
    fn refuse_idle_and_missing(&self, of_bodies: bool) -> Result<(), String> {
        let (of_body, no_ground) = (!of_bodies, self.ground.is_none());
        let floating = of_body && no_ground;
        let placed = self.load.as_ref().is_some_and(LoadTable::has_idle_point);
        let in_ground = self.start.as_ref().is_some_and(StartTable::is_in_ground);
        let idle = [
            ("body", "with [[bodies]]", of_bodies && self.body.is_some()),
            ("start", "with [[bodies]]", of_bodies && self.start.is_some()),
            ("load", "with [[bodies]]", of_bodies && self.load.is_some()),
            ("fixed", "without [[bodies]]", of_body && self.fixed.is_some()),
            ("terrain", "without [[bodies]]", of_body && self.terrain.is_some()),
            ("friction", "without [[bodies]]", of_body && self.friction.is_some()),
            ("restitution", "without [[bodies]]", of_body && self.restitution.is_some()),
            ("joints", "without [[bodies]]", of_body && self.joints.is_some()),
            ("motors", "without [[bodies]]", of_body && self.motors.is_some()),
            ("gears", "without [[bodies]]", of_body && self.gears.is_some()),
            ("driven", "without [[bodies]]", of_body && self.driven.is_some()),
            ("surfaces", "without [[bodies]]", of_body && self.surfaces.is_some()),
            ("apart", "without [[bodies]]", of_body && self.apart.is_some()),
            ("rotation", "without a [ground] table", floating && self.rotation.is_some()),
            ("solver", "without a [ground] table", floating && self.solver.is_some()),
            ("start.frame \"ground\"", "without a [ground] table", floating && in_ground),
            ("load.at", "without load.force", placed),
        ];
        if let Some((field, place, _)) = idle.into_iter().find(|(.., idle)| *idle) {
            return Err(format!("{field} has no meaning {place}; leave it out"));
        }
        if of_bodies && no_ground {
            return Err(
                "ground: a table [ground] is needed with [[bodies]]; set `none = true` in it for \
                 no ground, with `friction` for all bodies"
                    .to_owned(),
            );
        }
        let missing = [("body", self.body.is_none()), ("start", self.start.is_none())];
        match missing.into_iter().find(|(_, missing)| of_body && *missing) {
            Some((field, _)) => Err(format!(
                "missing field `{field}`: tables [body] and [start] are needed, or [[bodies]] and [ground]"
            )),
            None => Ok(()),
        }
    }
}
