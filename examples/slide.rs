//! Identification of friction and initial speed of a sliding block from two measured positions, by
//! Gauss–Newton with exact derivatives of the run. Also measures the cost of a step's derivative.
//!
//! ```text
//! cargo run --release --example slide
//! ```

use nalgebra::{Matrix2, Vector2, Vector3, Vector4};
use std::time::Instant;
use tumble::{
    Constant, Error, Motion, Parameters, Plane, RigidBody, Rotation, Simulation, State,
    StateChange, StepChange, StepDerivative, StepRecord, World,
};

/// Times of the measurements, in steps of 2 ms.
const TIMES: [u64; 2] = [100, 200];

/// Creates a block with this friction and initial speed, m/s.
fn simulation([friction, speed]: [f64; 2]) -> Result<Simulation<'static>, Error> {
    let world = World::new(Parameters {
        bodies: vec![RigidBody::solid_box(2.0, Vector3::new(0.2, 0.1, 0.05))?],
        ground: Some(Plane::level()),
        gravity: Vector3::new(0.0, 0.0, -9.81),
        friction,
        time_step: 0.002,
        rotation: Rotation::Momentum,
    })?;
    let start = State {
        position: Vector3::new(0.0, 0.0, 0.05),
        attitude: Vector4::new(1.0, 0.0, 0.0, 0.0),
        velocity: Vector3::new(speed, 0.0, 0.0),
        spin: Vector3::new(0.0, 0.0, 1.0),
    };
    let motion = Motion::native(&world);
    Simulation::new(world, [start], motion)
}

/// Positions at both times, m, and their derivatives with respect to friction and initial speed.
fn places(guess: [f64; 2]) -> Result<(Vector2<f64>, Matrix2<f64>), Error> {
    let mut simulation = simulation(guess)?;
    let (mut record, mut derivative) = (StepRecord::new(), StepDerivative::new());
    let faster = StateChange { velocity: Vector3::x(), ..StateChange::zero() };
    // State changes for each of the two parameters.
    let mut moving = [vec![StateChange::zero()], vec![faster]];
    let (mut found, mut slopes) = (Vector2::zeros(), Matrix2::zeros());
    for k in 1..=TIMES[1] {
        simulation.step(&mut record)?;
        simulation.linearise(&record, &mut derivative)?;
        for (states, friction) in moving.iter_mut().zip([1.0, 0.0]) {
            let constants = [(Constant::Friction, &[friction][..])];
            let mut next = Vec::new();
            let change = StepChange { states, wrenches: &[], constants: &constants };
            derivative.jvp(&change, &mut next)?;
            *states = next;
        }
        if let Some(row) = TIMES.iter().position(|time| *time == k) {
            found[row] = simulation.state().position[0];
            for (column, states) in moving.iter().enumerate() {
                slopes[(row, column)] = states[0].position[0];
            }
        }
    }
    Ok((found, slopes))
}

fn main() -> Result<(), Error> {
    let seen = places([0.234, 2.1])?.0;
    let mut guess = Vector2::new(0.4, 2.5);
    println!("iteration  friction              speed, m/s            miss, m");
    for iteration in 0..8 {
        let (found, slopes) = places(guess.into())?;
        let miss = seen - found;
        println!("{iteration:9}  {:<20}  {:<20}  {:.1e}", guess[0], guess[1], miss.norm());
        match slopes.lu().solve(&miss) {
            Some(step) if miss.norm() > 1e-15 => guess += step,
            _ => break,
        }
    }

    // Cost of steps alone, and of steps with derivatives with respect to states, wrenches and
    // constants.
    let (mut record, mut derivative) = (StepRecord::new(), StepDerivative::new());
    let mut best = [f64::INFINITY; 2];
    for round in 0..20 {
        let mut simulation = simulation([0.234, 2.1])?;
        let differentiates = round % 2 == 1;
        let begun = Instant::now();
        for _ in 0..TIMES[1] {
            simulation.step(&mut record)?;
            if differentiates {
                simulation.linearise(&record, &mut derivative)?;
                let mut gradient = Default::default();
                derivative.vjp(&[StateChange::zero()], &[Constant::Friction], &mut gradient)?;
            }
        }
        let each = begun.elapsed().as_secs_f64() / TIMES[1] as f64;
        best[usize::from(differentiates)] = best[usize::from(differentiates)].min(each);
    }
    println!("a step {:.2} µs, with its derivative {:.2} µs", best[0] * 1e6, best[1] * 1e6);
    Ok(())
}
