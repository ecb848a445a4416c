//! Accuracy of derivatives for small time steps. The derivative of a step by a position has size
//! 1/h and is cancelled in the next step. Rounding against the stiffness of the contacts would show
//! here.

use super::on_a_slope;
use crate::common::prelude::*;
use tumble_core::simulation::{Checkpoints, Run};

const ANGLE: f64 = 0.5;
const FRICTION: f64 = 0.3;
/// Half a side [m].
const HALF: f64 = 0.1;
const STEPS: u64 = 20_000;

/// Cube that slides down a slope, in steps of `h` [s].
fn sliding(h: f64) -> (World, Vec<State>) {
    let (world, states) = on_a_slope(ANGLE, FRICTION, 1.0);
    (world.with_constants(&[(Constant::TimeStep, &[h])]).unwrap(), states)
}

/// Unit vectors down the slope and out of it.
fn axes() -> (Vector3<f64>, Vector3<f64>) {
    let (sin, cos) = ANGLE.sin_cos();
    (Vector3::new(cos, 0.0, -sin), Vector3::new(sin, 0.0, cos))
}

/// Derivatives of the final position down the slope, in closed form. The arguments are the initial
/// position along the slope, out of it, and the size. A start out of the slope changes the first
/// step by δv_n = −δz/h. So friction decelerates less by μ δz/h in one step.
const EXPECTED: [f64; 3] = [1.0, FRICTION, -FRICTION * HALF];

/// Tolerance. A speed has a rounding error of 1e-16/h in a step. The next step corrects the gap, so
/// that the errors sum up like positions of 1e-16 m. A hundred times that for twenty thousand
/// steps.
const CLOSE: f64 = 1e-10;

#[test]
fn a_slide_in_small_steps_forwards() {
    let (along, off) = axes();
    for h in [1e-3, 1e-5] {
        let (world, states) = sliding(h);
        let mut simulation =
            Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
        let (mut record, mut derivative) = (StepRecord::new(), StepDerivative::new());
        let still = StateChange::zero();
        let placed = |position: Vector3<f64>| vec![StateChange { position, ..still }];
        let mut moving = [placed(along), placed(off), vec![still]];
        let mut next = Vec::new();
        for _ in 0..STEPS {
            simulation.step(&mut record).unwrap();
            simulation.linearise(&record, &mut derivative).unwrap();
            for (k, states) in moving.iter_mut().enumerate() {
                let larger = [(Constant::Size, &[1.0][..])];
                let constants = if k == 2 { &larger[..] } else { &[] };
                let change = StepChange { states, wrenches: &[], constants };
                derivative.jvp(&change, &mut next).unwrap();
                std::mem::swap(states, &mut next);
            }
        }
        for (moved, expected) in moving.iter().zip(EXPECTED) {
            let found = along.dot(&moved[0].position);
            println!("h = {h}: {found} of {expected}, {:.1e} off", (found - expected).abs());
            assert!((found - expected).abs() < CLOSE, "h = {h}: {found}, not {expected}");
        }
    }
}

#[test]
fn a_slide_in_small_steps_backwards() {
    let (along, off) = axes();
    for h in [1e-3, 1e-5] {
        let (world, states) = sliding(h);
        let mut simulation =
            Simulation::new(world.clone(), states, Motion::native(&world)).unwrap();
        let found = simulation
            .gradient(&mut Run {
                steps: STEPS,
                before: &mut |_: &mut Simulation<'_>| Ok(()),
                by_states: &mut |k: u64, _: &[State]| {
                    let end = StateChange { position: along, ..StateChange::zero() };
                    (k == STEPS).then(|| vec![end])
                },
                constants: &[Constant::Size],
                inputs: &[],
                checkpoints: Checkpoints::default(),
                smoothing: None,
                has_impact_times: false,
            })
            .unwrap();
        let by_place = &found.states[0].position;
        let found = [along.dot(by_place), off.dot(by_place), found.constants[0][0]];
        for (found, expected) in found.into_iter().zip(EXPECTED) {
            println!("h = {h}: {found} of {expected}, {:.1e} off", (found - expected).abs());
            assert!((found - expected).abs() < CLOSE, "h = {h}: {found}, not {expected}");
        }
    }
}
