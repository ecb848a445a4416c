//! Ground and load of a model.

use super::failure::Failure;
use super::fields::{Exactly, Numbers, numbers};
use nalgebra::Vector3;
use tumble_core::error::Error;
use tumble_core::mechanics::load::{Load, Polyline};
use tumble_core::world::{Plane, World};

/// Ground n·x = d.
#[derive(Debug, Clone)]
pub struct PlaneParameters {
    /// Unit normal n, world frame.
    pub normal: Numbers<3>,
    /// Offset d (m).
    pub offset: f64,
}

/// External load.
#[derive(Debug, Clone)]
pub struct LoadParameters {
    /// Knots of the force: time (s), then components (N) in the world frame.
    pub force: Vec<Numbers<4>>,
    /// Knots of the torque: time (s), then components (N m) in the body frame.
    pub torque: Vec<Numbers<4>>,
    /// Point where the force acts (m), body frame.
    pub at: Numbers<3>,
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
