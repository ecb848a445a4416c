//! The world and the load of a run's files, and what run.json says of them.

use super::args::PhysicsArgs;
use super::choices::{Inertia, Shape};
use super::outcome::Failure;
use super::run_file::RunParameters;
use super::settings::polyline;
use tumble::mechanics::load::Load;
use tumble::scenario::fields::by_rows;
pub use tumble::scenario::fields::{matrix, numbers};
use tumble::scenario::parameters::LoadParameters;
pub use tumble::scenario::physics::Physics;
use tumble::scenario::physics::{bouncing, plane, rigid_body};
use tumble::simulation::scene;
use tumble::step_nlp::SMOOTHING;
use tumble::world::Plane;
use tumble::world::{Parameters, World};

/// That of a run, with what flags give in the place of its own.
pub fn of_run(parameters: &RunParameters, flags: &PhysicsArgs) -> Result<Physics, Failure> {
    let points = || parameters.contact_points.iter().map(|point| point.0.into()).collect();
    let shape = flags.sides.map_or_else(|| Shape::Points(points()), Shape::Box);
    let rows = || Inertia::Matrix(matrix(&parameters.inertia));
    let inertia = flags.inertia.clone().unwrap_or_else(rows);
    let plane = flags.plane.as_ref().map_or_else(|| parameters.plane.clone(), plane);
    let world = World::new(Parameters {
        bodies: vec![rigid_body(flags.mass.unwrap_or(parameters.mass), &shape, &inertia)?],
        ground: Some(Plane::new(plane.normal.0.into(), plane.offset)?),
        gravity: flags.gravity.unwrap_or(parameters.gravity.0.into()),
        friction: flags.mu.unwrap_or(parameters.mu),
        time_step: flags.dt.unwrap_or(parameters.dt),
        rotation: flags.rotation.unwrap_or(parameters.rotation),
    })?;
    let restitution = flags.restitution.or(Some(parameters.restitution));
    let rebound_speed = flags.rebound_speed.or(parameters.rebound_speed);
    let world = bouncing(world, restitution, rebound_speed)?;
    let load = parameters.load.as_ref().map_or(Ok(Load::none()), LoadParameters::load)?;
    let point = flags.force_at.unwrap_or(*load.point());
    let force = polyline("force", &flags.force)?.unwrap_or(load.force);
    let torque = polyline("torque", &flags.torque)?.unwrap_or(load.torque);
    Ok(Physics { world, load: Load::new(force, torque, point)? })
}

/// That of the tutorial's drop scene.
pub fn of_tutorial() -> Result<Physics, Failure> {
    Ok(Physics { world: World::new(scene::tutorial_parameters()?)?, load: Load::none() })
}

/// What run.json says of it, and of how many rows there are to be.
pub fn parameters(physics: &Physics, rows: u64) -> RunParameters {
    let (world, load) = (&physics.world, &physics.load);
    let body = physics.body();
    RunParameters {
        steps: rows,
        dt: world.time_step(),
        rotation: world.rotation(),
        mu: world.friction(),
        restitution: world.restitution(),
        rebound_speed: world.given_rebound_speed(),
        mass: body.mass(),
        inertia: by_rows(body.inertia()),
        gravity: numbers(world.gravity()),
        epsilon: SMOOTHING,
        plane: plane(&world.ground().cloned().unwrap_or_default()),
        contact_points: body.contact_points().iter().map(|c| numbers(&c.position)).collect(),
        load: (!load.is_none()).then(|| LoadParameters::of(load)),
    }
}
