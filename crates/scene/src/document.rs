//! The scene as people write it: one document of names.
//!
//! Scenario files, the tutorial's scenes, flags and Python keywords all end in this type. The short form
//! `[body]` becomes an entry of `[[bodies]]` when the document is built.

use super::bodies::build::build;
use super::bodies::driven::{DrivenEntry, SurfaceEntry};
use super::bodies::entries::{ApartEntry, BodyEntry, Files, FixedEntry, PairEntry};
use super::bodies::gears::GearEntry;
use super::bodies::joints::{JointEntry, MotorEntry};
use super::bodies::robots::RobotEntry;
use super::bodies::terrain::TerrainEntry;
use super::choices::SolverName;
use super::coefficients::{table, with_coefficients};
use super::overrides::FieldOverride;
use super::tables::{BodyTable, GroundTable, LoadTable, SolverTable, StartTable};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use std::io;
use std::path::Path;
use toml::{Table, Value};
use tumble_core::mechanics::Rotation;
use tumble_core::world::{Impacts, Integrator};
use tumble_model::Model;
use tumble_model::failure::Failure;
use tumble_model::fields::{self, Gravity, table_if_any};

/// Default seed.
pub const USUAL_SEED: u32 = 42;

/// Largest start index k. The times k h of all later steps are still distinct doubles.
pub const LARGEST_START: u64 = 9_000_000_000_000_000;

/// Name of the body of the short form, and its place in error messages.
pub const BODY: &str = "body";

/// Fields of a floating body, which has no contact, that flags can set.
const OF_FLOATING: [&str; 5] = ["steps", "start_index", "seed", "time_step", "gravity"];

/// Reads a start index, see [`LARGEST_START`].
fn start_index<'de, D: Deserializer<'de>>(reader: D) -> Result<u64, D::Error> {
    let index =
        Value::deserialize(reader)?.as_integer().and_then(|index| u64::try_from(index).ok());
    let why = || D::Error::custom(format!("a whole number from 0 to {LARGEST_START} is needed"));
    index.filter(|index| *index <= LARGEST_START).ok_or_else(why)
}

// Scenario file: `[[bodies]]` and its related tables, or `[body]`, `[start]` and `[load]` for one body.
with_coefficients!(table, Vec<PairEntry>, Document, "a scenario" {
    pub name: Option<String>,
    /// Number of rows of a run, one more than steps.
    #[serde(default = "usual_rows")]
    pub steps: u64,
    #[serde(default, deserialize_with = "start_index")]
    pub start_index: u64,
    #[serde(default = "usual_time_step")]
    pub time_step: f64,
    rotation: Option<Rotation>,
    integrator: Option<Integrator>,
    pub accuracy: Option<f64>,
    pub impacts: Option<Impacts>,
    seed: Option<u32>,
    #[serde(default = "usual_gravity")]
    pub gravity: Gravity,
    #[serde(default, deserialize_with = "table_if_any")]
    pub ground: Option<GroundTable>,
    #[serde(default, deserialize_with = "table_if_any")]
    solver: Option<SolverTable>,
    #[serde(default, deserialize_with = "table_if_any")]
    pub body: Option<BodyTable>,
    #[serde(default, deserialize_with = "table_if_any")]
    pub start: Option<StartTable>,
    #[serde(default, deserialize_with = "table_if_any")]
    pub load: Option<LoadTable>,
    /// Collision groups that no object may have.
    pub groups: Option<Vec<String>>,
    pub bodies: Option<Vec<BodyEntry>>,
    pub fixed: Option<Vec<FixedEntry>>,
    pub terrain: Option<Vec<TerrainEntry>>,
    pub friction: Option<Vec<PairEntry>>,
    pub restitution: Option<Vec<PairEntry>>,
    pub joints: Option<Vec<JointEntry>>,
    pub motors: Option<Vec<MotorEntry>>,
    pub gears: Option<Vec<GearEntry>>,
    pub driven: Option<Vec<DrivenEntry>>,
    pub surfaces: Option<Vec<SurfaceEntry>>,
    pub apart: Option<Vec<ApartEntry>>,
    pub robots: Option<Vec<RobotEntry>>,
});

fn usual_rows() -> u64 {
    1000
}

fn usual_time_step() -> f64 {
    0.002
}

fn usual_gravity() -> Gravity {
    Gravity::Downwards(9.81)
}

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

    /// Model of a document without files.
    ///
    /// # Errors
    /// The first invalid value.
    pub fn model(mut self) -> Result<Model, Failure> {
        self.check().map_err(Failure::Input)?;
        let none = |_: &Path, _: u64| Err(io::Error::other("files cannot be read here"));
        let files = Files { folder: Path::new(""), read: &none };
        build(&mut self, files).map(|built| built.model).map_err(Failure::Input)
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
    fn check(&self) -> Result<(), String> {
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

    /// Rejects numbers of steps out of range, and settings of substeps that contradict each other.
    fn check_head(&self) -> Result<(), Failure> {
        if !(1..=10_000_000).contains(&self.steps) {
            let why = format!("it is {}; allowed: 1 to 10000000", self.steps);
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
