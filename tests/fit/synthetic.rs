//! Invented tosses of a cube, simulated with parameters that a fit does not know.

use nalgebra::{Matrix3, Vector3};
use rand_mt::Mt;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::contact::Plane;
use tumble::fit::{Model, ParameterValues, Toss};
use tumble::mechanics::quaternion::left;
use tumble::mechanics::{RigidBody, Rotation, State};
use tumble::simulation::random::random_attitude;
use tumble::simulation::{Motion, Simulation, StepRecord};
use tumble::world::{Parameters, World};

pub const RATE: f64 = 100.0;
pub const SUBSTEPS: usize = 4;
pub const HALF_SIDE: f64 = 0.05;
const FRAMES: usize = 45;

/// A cube of 10 cm and 0.4 kg that nothing is known of but its size and mass.
pub fn model() -> Model {
    let inertia = Matrix3::from_diagonal_element(7e-4);
    let half_sides = Vector3::repeat(HALF_SIDE);
    let body = RigidBody::with_box_corners(0.4, inertia, half_sides).unwrap();
    let world = World::new(Parameters {
        bodies: vec![body],
        ground: Some(Plane::level()),
        gravity: Vector3::new(0.0, 0.0, -9.81),
        friction: 0.4,
        time_step: 0.001,
        rotation: Rotation::Momentum,
    });
    Model::of_world(&world.unwrap()).unwrap()
}

/// A number in ±1.
fn draw(draws: &mut Mt) -> f64 {
    2.0 * f64::from(draws.next_u32()) / f64::from(u32::MAX) - 1.0
}

/// Tosses with the `values`. Each starts a little above the ground, less than four frames before it
/// may touch it, where the protocol takes the recorded velocities. `noise` goes to positions (m)
/// and attitudes (half of it, rad for m/10 mm); of the first `outliers` the second half slides
/// away.
pub fn tosses(values: &ParameterValues, count: usize, noise: f64, outliers: usize) -> Vec<Toss> {
    let model = model();
    let mut draws = Mt::new(5);
    (0..count)
        .map(|index| {
            let start = State {
                position: Vector3::new(0.0, 0.0, HALF_SIDE * 1.85),
                attitude: random_attitude(100 + index as u32),
                velocity: Vector3::new(1.0 + 0.4 * draw(&mut draws), 0.3 * draw(&mut draws), -0.8),
                spin: Vector3::from_fn(|_, _| 5.0 * draw(&mut draws)),
            };
            let world = model.world(values, 1.0 / (RATE * SUBSTEPS as f64)).unwrap();
            let motion = Motion::native(&world);
            let mut simulation = Simulation::new(world, [start], motion).unwrap();
            simulation.interrupt_by(Arc::new(AtomicBool::new(false)));
            let mut record = StepRecord::new();
            let mut frames = vec![start];
            while frames.len() < FRAMES {
                for _ in 0..SUBSTEPS {
                    simulation.step(&mut record).unwrap();
                }
                frames.push(*simulation.state());
            }
            for (k, frame) in frames.iter_mut().enumerate() {
                if index < outliers && k > FRAMES / 2 {
                    let late = (k - FRAMES / 2) as f64 / RATE;
                    frame.position.y += 2.0 * late;
                    frame.velocity.y += 2.0;
                }
                frame.position += Vector3::from_fn(|_, _| noise * draw(&mut draws));
                let turn = Vector3::from_fn(|_, _| 5.0 * noise * draw(&mut draws));
                let turn = nalgebra::Vector4::new(1.0, turn.x, turn.y, turn.z).normalize();
                frame.attitude = left(&frame.attitude) * turn;
            }
            Toss::new(format!("{index}"), RATE, frames).checked().unwrap()
        })
        .collect()
}
