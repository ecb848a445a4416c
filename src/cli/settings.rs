//! What a simulation is told by flags.

use super::args::SimulateArgs;
use super::choices::Shape;
use super::outcome::Failure;
pub use tumble::scenario::settings::{Settings, polyline};

/// What the flags of a simulation say.
pub fn of_flags(args: &SimulateArgs) -> Result<Settings, Failure> {
    let physics = &args.physics;
    Ok(Settings {
        steps: args.steps,
        seed: args.seed,
        dt: physics.dt,
        rotation: physics.rotation,
        mu: physics.mu,
        restitution: physics.restitution,
        rebound_speed: physics.rebound_speed,
        mass: physics.mass,
        inertia: physics.inertia.clone(),
        gravity: physics.gravity,
        shape: physics.sides.map(Shape::Box),
        plane: physics.plane.clone(),
        position: args.position,
        height: args.height,
        attitude: args.attitude.clone(),
        velocity: args.velocity,
        spin: args.spin,
        frame: args.frame,
        force: polyline("force", &physics.force)?,
        torque: polyline("torque", &physics.torque)?,
        force_at: physics.force_at,
        solver: args.solver,
        preset: args.preset,
        formulation: args.formulation,
        detection: args.detection,
        tol: args.tol,
        max_iter: args.max_iter,
        on_failure: args.on_failure,
    })
}
