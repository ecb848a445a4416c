//! Bodies of round pieces, worlds with fixed pieces, and runs.

use crate::common::prelude::*;

pub const G: f64 = 9.81;
pub const MASS: f64 = 1.0;

pub fn body(piece: Piece) -> RigidBody {
    RigidBody::solid(MASS, &[piece]).unwrap().0
}

pub fn sphere(radius: f64) -> Piece {
    Piece::sphere(radius).unwrap()
}

/// Capsule with its axis along y.
pub fn capsule_along_y(half_length: f64, radius: f64) -> Piece {
    let turn = Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let piece = Piece::capsule(half_length, radius).unwrap();
    piece.moved_by(turn.matrix(), &Vector3::zeros()).unwrap()
}

pub fn at(position: Vector3<f64>, velocity: Vector3<f64>, spin: Vector3<f64>) -> State {
    State { velocity, spin, ..State::at_rest(position) }
}

pub fn world(
    bodies: Vec<RigidBody>,
    pieces: Vec<Piece>,
    (gravity, friction, time_step): (Vector3<f64>, f64, f64),
) -> World {
    let world = euler(Parameters {
        bodies,
        ground: None,
        gravity,
        friction,
        time_step,
        rotation: Rotation::Momentum,
    });
    world.with_fixed(pieces)
}

/// Runs `steps` steps. Every step must be solved and physical.
pub fn run(world: &World, states: &[State], count: usize) -> Vec<StepRecord> {
    steps(&mut simulate(world, states), count, is_solved)
}

/// Normal forces of a step [N].
pub fn normal_forces(record: &StepRecord) -> Vec<f64> {
    let contacts =
        record.first().solution.contacts.iter().filter(|contact| contact.carries_force());
    contacts.map(|contact| contact.normal_force).collect()
}
