//! A scenario file as it is written, and what it says.

use super::bodies::SceneEntries;
use super::bodies::driven::{DrivenEntry, SurfaceEntry};
use super::bodies::entries::{ApartEntry, BodyEntry, FixedEntry, PairEntry};
use super::bodies::gears::GearEntry;
use super::bodies::joints::{JointEntry, MotorEntry};
use super::bodies::robots::RobotEntry;
use super::settings::Settings;
use super::tables::{BodyTable, GroundTable, LoadTable, SolverTable, StartTable};
use nalgebra::Vector3;
use serde::Deserialize;
use tumble_core::mechanics::Rotation;
use tumble_model::fields::{Gravity, table_if_any};

/// A file in either notation: one body's tables `[body]`, `[start]` and `[load]`, whose fields are
/// settings, or `[[bodies]]` with all that goes with them.
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

/// The largest k of a start: times k h of all steps after it are doubles that can be told apart.
pub const LARGEST_START: u64 = 9_000_000_000_000_000;

/// What a file says besides its name.
pub struct ParsedScene {
    /// All that flags can say too.
    pub settings: Settings,
    /// Whether there is a table `[ground]`.
    pub ground: bool,
    /// The tables of `[[bodies]]`; `None` of one body, whose tables are settings.
    pub entries: Option<SceneEntries>,
}

impl ScenarioFile {
    /// What the fields say. Those of a ground are open where there is none.
    pub fn said(mut self) -> Result<ParsedScene, String> {
        let is_of_bodies = self.bodies.is_some()
            || self.robots.is_some()
            || (self.fixed.is_some() && self.body.is_none());
        self.refuse_idle_and_missing(is_of_bodies)?;
        let steps = self.steps.unwrap_or(1000);
        if !(1..=10_000_000).contains(&steps) {
            return Err(format!("steps is {steps}; allowed is 1 to 10000000"));
        }
        if let Some(index) = self.start_index.filter(|index| *index > LARGEST_START) {
            return Err(format!("start_index is {index}; allowed is 0 to {LARGEST_START}"));
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

    /// A field that would do nothing, as one of the other notation, is refused rather than ignored,
    /// and one that is missing.
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
                "ground: a table [ground] is needed with [[bodies]]; with `none = true` in \
                        it there is none, and the friction is that of all bodies"
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
