//! Ground, load and rotation in the form of the files.

use super::failure::Failure;
use super::fields::{Exactly, Numbers, numbers};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};
use tumble_core::error::Error;
use tumble_core::mechanics::Rotation;
use tumble_core::mechanics::load::{Load, Polyline};
use tumble_core::world::{Impacts, Integrator};
use tumble_core::world::{Plane, World};

/// Ground n·x = d.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(expecting = "an object with normal and offset")]
pub struct PlaneParameters {
    /// Unit normal n, world frame.
    pub normal: Numbers<3>,
    /// Offset d (m).
    pub offset: f64,
}

/// External load.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(expecting = "an object with force, torque and at")]
pub struct LoadParameters {
    /// Knots of the force: time (s), then components (N) in the world frame.
    pub force: Vec<Numbers<4>>,
    /// Knots of the torque: time (s), then components (N m) in the body frame.
    pub torque: Vec<Numbers<4>>,
    /// Point where the force acts (m), body frame.
    pub at: Numbers<3>,
}

/// Discretisation of a run.json without the field, as written by the first versions.
pub fn unnamed_rotation() -> Rotation {
    Rotation::Tutorial
}

/// Integrator of a run.json without the field, as written before there was a choice.
pub fn unnamed_integrator() -> Integrator {
    Integrator::Euler
}

/// True if the field is left out of a run.json.
pub fn is_euler(integrator: &Integrator) -> bool {
    *integrator == Integrator::Euler
}

/// True for impacts within a step, which files do not name.
pub fn is_stepped(impacts: &Impacts) -> bool {
    *impacts == Impacts::Stepped
}

impl Default for PlaneParameters {
    fn default() -> Self {
        Self { normal: Exactly([0.0, 0.0, 1.0]), offset: 0.0 }
    }
}

impl LoadParameters {
    /// Parameters of a `load`.
    pub fn from_load(load: &Load) -> Self {
        let knots = |line: &Polyline| {
            line.knots().iter().map(|(time, v)| Exactly([*time, v[0], v[1], v[2]])).collect()
        };
        let at = numbers(load.point());
        Self { force: knots(&load.force), torque: knots(&load.torque), at }
    }

    /// Load in the form of the core.
    ///
    /// # Errors
    /// Knots or a point that a load rejects.
    pub fn load(&self) -> Result<Load, Failure> {
        let line = |name: &str, knots: &[Numbers<4>]| {
            let knots = knots.iter().map(|&Exactly([t, x, y, z])| (t, Vector3::new(x, y, z)));
            Polyline::new(knots.collect()).map_err(|error| Failure::setting(name, error))
        };
        let (force, torque) = (line("force", &self.force)?, line("torque", &self.torque)?);
        Ok(Load::new(force, torque, self.at.0.into())?)
    }
}

/// Sets the given restitution parameters of `world`.
///
/// # Errors
/// Numbers that a world rejects.
pub fn bouncing(
    world: World,
    restitution: Option<f64>,
    rebound_speed: Option<f64>,
) -> Result<World, Error> {
    let world = match restitution {
        Some(restitution) => world.with_restitution(restitution)?,
        None => world,
    };
    match rebound_speed {
        Some(speed) => world.with_rebound_speed(speed),
        None => Ok(world),
    }
}

/// Plane in the form of the files.
pub fn plane(plane: &Plane) -> PlaneParameters {
    PlaneParameters { normal: numbers(plane.normal()), offset: plane.offset() }
}
