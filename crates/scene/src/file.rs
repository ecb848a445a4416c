//! Scenario file as deserialised, and its conversion. The short form `[body]` becomes an entry of
//! `[[bodies]]` here.

use super::bodies::driven::{DrivenEntry, SurfaceEntry};
use super::bodies::entries::{ApartEntry, BodyEntry, FixedEntry, PairEntry};
use super::bodies::gears::GearEntry;
use super::bodies::joints::{JointEntry, MotorEntry};
use super::bodies::robots::RobotEntry;
use super::bodies::scene_entries::SceneEntries;
use super::bodies::terrain::TerrainEntry;
use super::coefficients::{table, with_coefficients};
use super::settings::{LARGEST_START, Settings};
use super::tables::{BodyTable, GroundTable, LoadTable, SolverTable, StartTable};
use super::tutorial::BODY;
use nalgebra::Vector3;
use serde::Deserialize;
use tumble_core::mechanics::Rotation;
use tumble_core::world::{Impacts, Integrator};
use tumble_model::fields::{Gravity, table_if_any};

// Scenario file: `[[bodies]]` and its related tables, or `[body]`, `[start]` and `[load]` for one body.
with_coefficients!(table, Vec<PairEntry>, ScenarioFile, "a scenario" {
    pub name: Option<String>,
    steps: Option<u64>,
    start_index: Option<u64>,
    time_step: Option<f64>,
    rotation: Option<Rotation>,
    integrator: Option<Integrator>,
    accuracy: Option<f64>,
    impacts: Option<Impacts>,
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
});

/// Content of a file without its name.
pub struct ParsedScene {
    /// Settings that are also flags.
    pub settings: Settings,
    /// True if the file has no table `[ground]`. Its only body floats.
    pub floats: bool,
    /// Tables of bodies, fixed geometry and joints.
    pub entries: SceneEntries,
}

impl ScenarioFile {
    /// Converts the fields. Settings of the ground stay `None` without a `[ground]` table.
    pub fn into_parsed(mut self) -> Result<ParsedScene, String> {
        self.refuse_idle_and_missing()?;
        let coefficients = self.take_coefficients().map(Option::unwrap_or_default);
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
            solver: self.solver.unwrap_or_default(),
            ..Settings::default()
        };
        let floats = self.ground.is_none();
        if let Some(table) = self.ground {
            settings.rotation = Some(self.rotation.unwrap_or(Rotation::Momentum));
            settings.integrator = self.integrator;
            settings.accuracy = self.accuracy;
            settings.impacts = self.impacts;
            table.set(&mut settings)?;
        }
        let at = if self.body.is_some() { BODY } else { "" };
        let mut bodies = self.bodies.unwrap_or_default();
        if let (Some(body), Some(start)) = (self.body, self.start) {
            bodies.push(body.entry(start, self.load));
        }
        let entries = SceneEntries {
            at,
            bodies,
            fixed: self.fixed.unwrap_or_default(),
            terrain: self.terrain.unwrap_or_default(),
            friction: self.friction.unwrap_or_default(),
            coefficients,
            restitution: self.restitution.unwrap_or_default(),
            joints: self.joints.unwrap_or_default(),
            motors: self.motors.unwrap_or_default(),
            gears: self.gears.unwrap_or_default(),
            driven: self.driven.unwrap_or_default(),
            surfaces: self.surfaces.unwrap_or_default(),
            apart: self.apart.unwrap_or_default(),
            robots: self.robots.unwrap_or_default(),
        };
        Ok(ParsedScene { settings, floats, entries })
    }

    /// Rejects missing tables and tables without effect.
    fn refuse_idle_and_missing(&self) -> Result<(), String> {
        let (no_body, no_ground) = (self.body.is_none(), self.ground.is_none());
        let others = [
            ("[[bodies]]", self.bodies.is_some()),
            ("[[robots]]", self.robots.is_some()),
            ("[[fixed]]", self.fixed.is_some()),
            ("[[terrain]]", self.terrain.is_some()),
        ];
        let other = others.iter().find(|(_, given)| *given).map(|(table, _)| *table);
        if let (false, Some(other)) = (no_body, other) {
            return Err(format!(
                "body has no meaning with {other}; describe the body in [[bodies]]"
            ));
        }
        let idle = [
            ("start", "without [body]", no_body && self.start.is_some()),
            ("load", "without [body]", no_body && self.load.is_some()),
            ("rotation", "without a [ground] table", no_ground && self.rotation.is_some()),
            ("integrator", "without a [ground] table", no_ground && self.integrator.is_some()),
            ("accuracy", "without a [ground] table", no_ground && self.accuracy.is_some()),
            ("impacts", "without a [ground] table", no_ground && self.impacts.is_some()),
            ("solver", "without a [ground] table", no_ground && self.solver.is_some()),
        ];
        if let Some((field, place, _)) = idle.into_iter().find(|(.., idle)| *idle) {
            return Err(format!("{field} has no meaning {place}; leave it out"));
        }
        if !no_body && self.start.is_none() {
            return Err("missing field `start`: a table [start] is needed with [body]".to_owned());
        }
        Ok(())
    }
}
