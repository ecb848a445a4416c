//! World and load of a scene with one body, made from settings.

use super::choices::{BodyShape, Inertia};
use super::settings::Settings;
use nalgebra::Vector3;
use tumble_core::error::Error;
use tumble_core::mechanics::Rotation;
use tumble_core::mechanics::body::{RigidBody, solid_box_inertia};
use tumble_core::mechanics::load::{Load, Polyline};
use tumble_core::simulation::scene;
use tumble_core::world::{Parameters, World};
use tumble_model::failure::Failure;
use tumble_model::parameters::bouncing;
use tumble_model::shape::check_sides;

/// World and load of complete settings.
pub fn of_settings(settings: &Settings) -> Result<(World, Load), Failure> {
    let mass = settings.mass.ok_or_else(|| Failure::needed("mass"))?;
    let shape = settings.shape.as_ref().ok_or_else(|| Failure::needed("box"))?;
    let inertia = settings.inertia.as_ref().ok_or_else(|| Failure::needed("inertia"))?;
    let world = World::new(Parameters {
        bodies: vec![rigid_body(mass, shape, inertia)?],
        ground: Some(settings.plane.clone().unwrap_or_default()),
        gravity: settings.gravity.ok_or_else(|| Failure::needed("gravity"))?,
        friction: settings.mu.unwrap_or(scene::FRICTION),
        time_step: settings.dt.ok_or_else(|| Failure::needed("dt"))?,
        // Without a ground, the Runge–Kutta method integrates the equation itself.
        rotation: settings.rotation.unwrap_or(Rotation::Tutorial),
    })?;
    let world = bouncing(world, settings.restitution, settings.rebound_speed)?;
    let load = Load::new(
        settings.force.clone().unwrap_or_default(),
        settings.torque.clone().unwrap_or_default(),
        settings.force_at.unwrap_or_default(),
    )?;
    Ok((world, load))
}

/// Error message if one step of `load` would change the velocity by more than `MOST_GAINED`.
///
/// `h` is the time step (s).
pub fn violent_load(body: &RigidBody, load: &Load, h: f64) -> Option<String> {
    let size = |line: &Polyline| line.knots().iter().map(|(_, v)| v.amax()).fold(0.0, f64::max);
    let arm = 2.0 * load.point().amax();
    let (force, torque) = (size(&load.force), size(&load.torque));
    let turning = body.inertia_inverse().amax() * (torque + arm * force);
    let gained = [("m/s", h * force / body.mass()), ("rad/s", h * turning)];
    let (unit, gained) = gained.into_iter().find(|(_, gained)| *gained > MOST_GAINED)?;
    Some(format!(
        "one step of this load would change the body's velocity by {gained:.1e} {unit}; allowed: \
         up to {MOST_GAINED:e} {unit}"
    ))
}

/// Maximum change of velocity in one step (m/s or rad/s): a tenth of the limit for an initial
/// state.
const MOST_GAINED: f64 = 1e4;

/// Rigid body of `mass` (kg).
fn rigid_body(mass: f64, shape: &BodyShape, inertia: &Inertia) -> Result<RigidBody, Failure> {
    // The inertia of a solid box follows from its sides, so the error is about them.
    let of_sides = |error: Error| match Failure::from(error) {
        Failure::Setting { name, why } if name == "inertia" => Failure::setting("box", why),
        other => other,
    };
    if let BodyShape::Box(sides) = shape {
        check_sides(&(*sides).into())?;
    }
    Ok(match (shape, inertia) {
        (BodyShape::Box(sides), Inertia::Solid) => {
            RigidBody::solid_box(mass, 0.5 * sides).map_err(of_sides)?
        }
        (BodyShape::Box(sides), Inertia::Matrix(matrix)) => {
            RigidBody::with_box_corners(mass, *matrix, 0.5 * sides)?
        }
        (BodyShape::Points(points), Inertia::Matrix(matrix)) => {
            RigidBody::new(mass, *matrix, points)?
        }
        (BodyShape::Points(points), Inertia::Solid) => {
            let inertia = solid_box_inertia(mass, &half_sides(points)?);
            RigidBody::new(mass, inertia, points).map_err(of_sides)?
        }
    })
}

/// Half sides of the box with these corners.
///
/// # Errors
/// Points that are not the corners of a box centred at the origin.
fn half_sides(points: &[Vector3<f64>]) -> Result<Vector3<f64>, Failure> {
    let half = points.iter().fold(Vector3::zeros(), |half, point| point.abs().sup(&half));
    if points.len() == 8 && points.iter().all(|point| point.abs() == half) {
        return Ok(half);
    }
    Err(Failure::setting(
        "inertia",
        "`solid` needs a box, and the contact points are not the corners of one; give numbers",
    ))
}
