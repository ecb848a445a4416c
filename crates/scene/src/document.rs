//! The scene as one document of names: what people write, what a program holds and what run.json has.
//!
//! Scenario files, the tutorial's scenes, flags and Python keywords all end in this type. A document in
//! *exact form* has one entry for each body, object and joint, and no files, copies or defaults
//! ([`Document::exact`]). The world is made of it, and it is written as it is.

use super::bodies::driven::{DrivenEntry, SurfaceEntry};
use super::bodies::entries::{ApartEntry, BodyEntry, FixedEntry, PairEntry};
use super::bodies::gears::GearEntry;
use super::bodies::joints::{JointEntry, MotorEntry};
use super::bodies::terrain::TerrainEntry;
use super::choices::SolverName;
use super::coefficients::{table, with_coefficients};
use super::overrides::FieldOverride;
use super::robots::table::RobotEntry;
use super::short_form::{BodyTable, StartTable};
use super::tables::{GroundTable, LoadTable, SolverTable};
use nalgebra::Vector3;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize};
use toml::{Table, Value};
use tumble_core::mechanics::Rotation;
use tumble_core::world::{Impacts, Integrator};
use tumble_model::failure::Failure;
use tumble_model::fields::{self, Gravity, table_if_any};

/// Default seed.
pub const USUAL_SEED: u32 = 42;

/// Largest start index k. The times k h of all later steps are still distinct doubles.
pub const LARGEST_START: u64 = 9_000_000_000_000_000;

/// Fields of a floating body, which has no contact, that flags can set.
const OF_FLOATING: [&str; 5] = ["steps", "start_index", "seed", "time_step", "gravity"];

/// Reads a start index, see [`LARGEST_START`].
fn start_index<'de, D: Deserializer<'de>>(reader: D) -> Result<Option<u64>, D::Error> {
    let index =
        Value::deserialize(reader)?.as_integer().and_then(|index| u64::try_from(index).ok());
    let why = || D::Error::custom(format!("a whole number from 0 to {LARGEST_START} is needed"));
    index.filter(|index| *index <= LARGEST_START).map(Some).ok_or_else(why)
}

// Scenario file: `[[bodies]]` and its related tables, or `[body]`, `[start]` and `[load]` for one body.
with_coefficients!(table, Vec<PairEntry>, Document, "a scenario" {
    /// Name of the scene.
    name: Option<String>,
    /// Number of rows of a run, one more than steps.
    steps: Option<u64>,
    /// Start index k.
    #[serde(default, deserialize_with = "start_index")]
    start_index: Option<u64>,
    /// Time step h (s).
    time_step: Option<f64>,
    /// Discretisation of the rotational equations of motion.
    rotation: Option<Rotation>,
    /// Meaning of the velocities of a run.
    integrator: Option<Integrator>,
    /// Growth of the error of the time step that a run keeps (m/s).
    accuracy: Option<f64>,
    /// When impacts happen, if there is no accuracy.
    impacts: Option<Impacts>,
    /// Seed of random starts.
    seed: Option<u32>,
    /// Gravitational acceleration (m/s²).
    gravity: Option<Gravity>,
    /// Collision groups that no object may have.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    groups: Vec<String>,
    /// Ground, and coefficients of the world.
    #[serde(default, deserialize_with = "table_if_any")]
    ground: Option<GroundTable>,
    /// Solver of contact steps.
    #[serde(default, deserialize_with = "table_if_any")]
    solver: Option<SolverTable>,
    /// Short form of one body.
    #[serde(default, deserialize_with = "table_if_any")]
    body: Option<BodyTable>,
    /// Initial state of the short form.
    #[serde(default, deserialize_with = "table_if_any")]
    start: Option<StartTable>,
    /// Load of the short form.
    #[serde(default, deserialize_with = "table_if_any")]
    load: Option<LoadTable>,
    /// Bodies, in the order of the states.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    bodies: Vec<BodyEntry>,
    /// Fixed geometry.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    fixed: Vec<FixedEntry>,
    /// Terrains.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    terrain: Vec<TerrainEntry>,
    /// Coefficients of friction of single pairs.
    friction: Option<Vec<PairEntry>>,
    /// Pairs that do not collide, in addition to the pairs joined by joints.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    apart: Vec<ApartEntry>,
    /// Joints between bodies.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    joints: Vec<JointEntry>,
    /// Motors of joints.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    motors: Vec<MotorEntry>,
    /// Gears between joints.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    gears: Vec<GearEntry>,
    /// Bodies with prescribed motions.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    driven: Vec<DrivenEntry>,
    /// Surfaces that move or have an axis of friction.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    surfaces: Vec<SurfaceEntry>,
    /// Robots of files.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    robots: Vec<RobotEntry>,
});

/// Default number of rows.
const USUAL_ROWS: u64 = 1000;

/// Default time step (s).
const USUAL_TIME_STEP: f64 = 0.002;

impl Document {
    /// Document of a `text` with the fields of `overrides`, and the paths of those that differ from the
    /// text and change the motion.
    ///
    /// # Errors
    /// The first fault, with the line of the text or the field.
    pub fn from_text(
        text: &str,
        overrides: &[FieldOverride],
    ) -> Result<(Self, Vec<String>), Failure> {
        let mut document: Self = super::parse(text).map_err(Failure::Input)?;
        let mut changed = Vec::new();
        if !overrides.is_empty() {
            document.refuse_contact(overrides)?;
            let mut table: Table = super::parse(text).map_err(Failure::Input)?;
            for field in overrides {
                if field.apply(&mut table)? && field.changes_motion() {
                    changed.push(field.name().to_owned());
                }
            }
            let given = serde_path_to_error::deserialize(Value::Table(table));
            document = given.map_err(|error| {
                let path = error.path().to_string();
                let why = fields::named(".", error.inner().message());
                if path == "." { Failure::Input(why) } else { Failure::setting(&path, why) }
            })?;
        }
        document.check().map_err(Failure::Input)?;
        document.check_head()?;
        Ok((document, changed))
    }

    /// Rejects flags of contact for a body that floats.
    fn refuse_contact(&self, overrides: &[FieldOverride]) -> Result<(), Failure> {
        let mut flags = overrides.iter().filter(|field| field.label().is_some());
        let idle = flags.find(|field| !OF_FLOATING.contains(&field.path()));
        match idle.filter(|_| self.ground.is_none()) {
            Some(field) => {
                Err(Failure::idle(field.path(), "a floating body, which has no contact"))
            }
            None => Ok(()),
        }
    }

    /// Number of rows of a run.
    pub fn rows(&self) -> u64 {
        self.steps.unwrap_or(USUAL_ROWS)
    }

    /// Time step h (s).
    pub fn time_step(&self) -> f64 {
        self.time_step.unwrap_or(USUAL_TIME_STEP)
    }

    /// Gravitational acceleration (m/s²).
    pub fn gravity(&self) -> Vector3<f64> {
        self.gravity.unwrap_or(Gravity::Downwards(9.81)).vector()
    }

    /// Sets the gravitational acceleration (m/s²).
    pub fn set_gravity(&mut self, gravity: &Vector3<f64>) {
        self.gravity = Some(Gravity::Vector(fields::numbers(gravity)));
    }

    /// Start index k.
    pub fn first_index(&self) -> u64 {
        self.start_index.unwrap_or(0)
    }

    /// Seed of random starts.
    pub fn seed(&self) -> u32 {
        self.seed.unwrap_or(USUAL_SEED)
    }

    /// Discretisation of the rotational equations of motion.
    pub fn rotation(&self) -> Rotation {
        self.rotation.unwrap_or(Rotation::Momentum)
    }

    /// Meaning of the velocities of a run: leapfrog unless another one is given, the rotation is the
    /// tutorial's, the body floats or Ipopt solves the tutorial's program.
    pub fn integrator(&self) -> Integrator {
        let solver = self.solver();
        let is_ipopt = solver.preset.is_some() || solver.name == Some(SolverName::Ipopt);
        let is_tutorials = self.ground.is_none() || is_ipopt;
        let rotation = if is_tutorials { Rotation::Tutorial } else { self.rotation() };
        self.integrator.unwrap_or(Integrator::usual(rotation))
    }

    /// Solver of contact steps.
    pub fn solver(&self) -> SolverTable {
        self.solver.unwrap_or_default()
    }

    /// Rejects missing tables and tables without effect.
    pub(crate) fn check(&self) -> Result<(), String> {
        let (no_body, no_ground) = (self.body.is_none(), self.ground.is_none());
        let others = [
            ("[[bodies]]", !self.bodies.is_empty()),
            ("[[robots]]", !self.robots.is_empty()),
            ("[[fixed]]", !self.fixed.is_empty()),
            ("[[terrain]]", !self.terrain.is_empty()),
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

    /// Rejects numbers of steps out of range, and settings of substeps that contradict each other.
    fn check_head(&self) -> Result<(), Failure> {
        let rows = self.rows();
        if !(1..=10_000_000).contains(&rows) {
            let why = format!("it is {rows}; allowed: 1 to 10000000");
            return Err(Failure::setting("steps", why));
        }
        if self.accuracy.is_some() && self.impacts == Some(Impacts::Stepped) {
            let why =
                "a run with an accuracy has located impacts; leave out impacts, or the accuracy";
            return Err(Failure::setting("impacts", why));
        }
        let is_located = self.impacts == Some(Impacts::Located);
        let substeps = [("accuracy", self.accuracy.is_some()), ("impacts", is_located)];
        let given = substeps.into_iter().find(|(_, given)| *given);
        if let (Some((name, _)), Integrator::Euler) = (given, self.integrator()) {
            let why = "substeps need integrator = \"leapfrog\"; this scene has \"euler\"";
            return Err(Failure::setting(name, why));
        }
        Ok(())
    }
}
