//! A cube thrown so that it comes to rest on a mark: the velocity of the throw by Gauss–Newton, with the exact derivatives of a
//! run in which it lands, tumbles and slides. Where a step would lead to worse, because the cube falls on another
//! face there, half of it is tried; where even a small part does, the cube is thrown in another way to begin with.
//!
//! ```text
//! cargo run --release --example throw
//! ```

use nalgebra::{Matrix2x3, Vector2, Vector3, Vector4};
use tumble::{
    Checkpoints, Error, Motion, Parameters, Plane, RigidBody, Rotation, Run, Simulation, State,
    StateChange, World,
};

/// Steps of 2 ms, after which it lies.
const STEPS: u64 = 900;
/// Where it is to lie, m.
const MARK: Vector2<f64> = Vector2::new(1.5, 0.4);

/// As near it lies on it, m.
const NEAR: f64 = 1e-9;
/// A smaller part of a step is none.
const SHORTEST: f64 = 0.01;
/// Throws to begin with, m/s.
const STARTS: [[f64; 3]; 4] = [[1.5, 0.0, 1.0], [1.5, 0.5, 1.0], [2.0, 0.5, 1.5], [1.0, 0.5, 0.5]];

/// A cube thrown with this velocity, m/s.
fn simulation(velocity: &Vector3<f64>) -> Result<Simulation<'static>, Error> {
    let world = World::new(Parameters {
        bodies: vec![RigidBody::solid_box(1.0, Vector3::repeat(0.1))?],
        ground: Some(Plane::level()),
        gravity: Vector3::new(0.0, 0.0, -9.81),
        friction: 0.4,
        time_step: 0.002,
        rotation: Rotation::Momentum,
    })?;
    let start = State {
        position: Vector3::new(0.0, 0.0, 0.5),
        attitude: Vector4::new(0.9, 0.2, -0.3, 0.1).normalize(),
        velocity: *velocity,
        spin: Vector3::new(2.0, 1.0, 3.0),
    };
    let motion = Motion::native(&world);
    Simulation::new(world, [start], motion)
}

/// How far from the mark it lies, m.
fn miss(velocity: &Vector3<f64>) -> Result<Vector2<f64>, Error> {
    let mut simulation = simulation(velocity)?;
    let mut record = Default::default();
    for _ in 0..STEPS {
        simulation.step(&mut record)?;
    }
    Ok(simulation.state().position.xy() - MARK)
}

/// That by the velocity, s, and how near to a kink the run came, m/s.
fn slopes(velocity: &Vector3<f64>) -> Result<(Matrix2x3<f64>, f64), Error> {
    let (mut slopes, mut margin) = (Matrix2x3::zeros(), 0.0);
    for (row, along) in [Vector3::x(), Vector3::y()].into_iter().enumerate() {
        let end = StateChange { position: along, ..StateChange::zero() };
        let found = simulation(velocity)?.gradient(&mut Run {
            steps: STEPS,
            before: &mut |_| Ok(()),
            by_states: &mut |k, _| (k == STEPS).then(|| vec![end]),
            constants: &[],
            checkpoints: Checkpoints::default(),
            smoothing: None,
        })?;
        slopes.row_mut(row).copy_from(&found.states[0].velocity.transpose());
        margin = found.margin.0;
    }
    Ok((slopes, margin))
}

/// From a throw to better ones, until it lies on the mark or none is near. How far it lies from it then, m.
fn search(mut velocity: Vector3<f64>) -> Result<f64, Error> {
    let mut missed = miss(&velocity)?;
    println!("throw  velocity, m/s             miss, m  margin, m/s");
    for throw in 0..40 {
        let (slopes, margin) = slopes(&velocity)?;
        let [x, y, z] = velocity.into();
        println!("{throw:5}  {x:.4} {y:.4} {z:.4}  {:12.1e}  {margin:11.1e}", missed.norm());
        if missed.norm() < NEAR {
            break;
        }
        // The shortest change that would do if all were straight.
        let Some(inverse) = (slopes * slopes.transpose()).try_inverse() else { break };
        let step = -slopes.transpose() * (inverse * missed);
        let mut length = 1.0;
        let better = loop {
            let next = velocity + step * length;
            let found = miss(&next)?;
            if found.norm() < missed.norm() {
                break Some((next, found));
            }
            length *= 0.5;
            if length < SHORTEST {
                break None;
            }
        };
        let Some(found) = better else { break };
        (velocity, missed) = found;
    }
    Ok(missed.norm())
}

fn main() -> Result<(), Error> {
    let mut least = f64::INFINITY;
    for start in STARTS {
        least = search(start.into())?.min(least);
        if least < NEAR {
            break;
        }
    }
    println!("it lies {least:.1e} m from the mark");
    Ok(())
}
