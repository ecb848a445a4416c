//! Throw of a cube to a target, by Gauss–Newton on the initial velocity.
//!
//! The exact derivatives belong to a run in which the cube lands, tumbles and slides. A step can
//! lead to a larger miss, because the cube falls on another face. Then half of it is tried. If even
//! a small part fails, the search continues from another initial velocity.
//!
//! ```text
//! cargo run --release --example throw
//! ```

use nalgebra::{Matrix2x3, Vector2, Vector3, Vector4};
use tumble::{
    Checkpoints, Error, Motion, Parameters, Plane, RigidBody, Rotation, Run, Simulation, State,
    StateChange, World,
};

/// Number of steps of 2 ms, after which the cube lies still.
const STEPS: u64 = 900;
/// Target position, m.
const MARK: Vector2<f64> = Vector2::new(1.5, 0.4);

/// Tolerance of the position, m.
const NEAR: f64 = 1e-9;
/// Smallest fraction of a step that is tried.
const SHORTEST: f64 = 0.01;
/// Initial velocities of the search, m/s.
const STARTS: [[f64; 3]; 4] = [[1.5, 0.0, 1.0], [1.5, 0.5, 1.0], [2.0, 0.5, 1.5], [1.0, 0.5, 0.5]];

/// Creates a cube with this initial velocity, m/s.
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

/// Vector from the target to the rest position, m.
fn miss(velocity: &Vector3<f64>) -> Result<Vector2<f64>, Error> {
    let mut simulation = simulation(velocity)?;
    let mut record = Default::default();
    for _ in 0..STEPS {
        simulation.step(&mut record)?;
    }
    Ok(simulation.state().position.xy() - MARK)
}

/// Derivative of the miss with respect to the velocity, s, and the run's margin to a kink, m/s.
fn slopes(velocity: &Vector3<f64>) -> Result<(Matrix2x3<f64>, f64), Error> {
    let (mut slopes, mut margin) = (Matrix2x3::zeros(), 0.0);
    for (row, along) in [Vector3::x(), Vector3::y()].into_iter().enumerate() {
        let end = StateChange { position: along, ..StateChange::zero() };
        let found = simulation(velocity)?.gradient(&mut Run {
            steps: STEPS,
            before: &mut |_| Ok(()),
            by_states: &mut |k, _| (k == STEPS).then(|| vec![end]),
            constants: &[],
            inputs: &[],
            checkpoints: Checkpoints::default(),
            smoothing: None,
            has_impact_times: false,
        })?;
        slopes.row_mut(row).copy_from(&found.states[0].velocity.transpose());
        margin = found.margin.0;
    }
    Ok((slopes, margin))
}

/// Improves a throw until it hits the target or no better one is found. Returns the distance, m.
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
        // Shortest change that solves the linearised problem.
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
