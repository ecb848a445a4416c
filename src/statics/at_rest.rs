//! Structures from the step that the simulator takes from rest.

use super::structure::Structure;
use crate::{Error, Motion, Simulation, State, StepRecord, StepStatus, World, Wrench};
use nalgebra::Vector3;

/// Speed after a step from rest that counts as motion, as a fraction of the largest load over mass times
/// the time step.
const MOVES: f64 = 1e-5;
/// Speed of a step's residual in units of the world's [speed scale](World::speed_scale) (m/s).
const ROUNDED: f64 = 1e-8;

/// The step that the simulator takes from rest, with its selection among the solutions.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct FromRest {
    /// Status of the step.
    pub status: StepStatus,
    /// Largest speed of a body at its end (m/s), with its reach.
    pub speed: f64,
    /// True if a body moves.
    pub moves: bool,
}

impl Structure {
    /// Structure of `world` at `states` without their velocities, and the simulator's answer: one step from rest with
    /// the native solver. The contacts are those of this step. `wrenches` act besides gravity; bodies
    /// without one have none.
    ///
    /// # Errors
    /// Those of [`Simulation::new`] and of [`Simulation::set_wrench`].
    pub fn at_rest(
        world: &World,
        states: &[State],
        wrenches: &[Wrench],
    ) -> Result<(Self, FromRest), Error> {
        let still =
            |state: &State| State { velocity: Vector3::zeros(), spin: Vector3::zeros(), ..*state };
        let world = world.clone().with_whole_steps();
        let motion = Motion::native(&world);
        let mut simulation = Simulation::new(world, states.iter().map(still), motion)?;
        for (body, wrench) in wrenches.iter().enumerate() {
            simulation.set_wrench(body, *wrench)?;
        }
        let starts = simulation.states().to_vec();
        let mut record = StepRecord::new();
        simulation.step(&mut record)?;
        let world = simulation.world();
        let structure = Self::new(world, &starts, wrenches, &record.first().contacts)?;
        let speed =
            |(state, reach): (&State, &f64)| state.velocity.norm() + state.spin.norm() * reach;
        let ends = record.next_states().iter().zip(&structure.reaches);
        let speed = ends.map(speed).fold(0.0, f64::max);
        let loads = structure.loads.wrenches.iter().zip(&structure.masses);
        let accelerations = loads.map(|(load, mass)| load.linear.norm() / mass);
        let fastest = accelerations.fold(0.0, f64::max) * world.time_step();
        let moves = speed > (MOVES * fastest).max(ROUNDED * world.speed_scale());
        Ok((structure, FromRest { status: record.status(), speed, moves }))
    }
}
