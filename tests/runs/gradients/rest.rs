//! Derivative of a run that comes to rest, against products step by step.

use super::{scenario, size};
use crate::common::prelude::*;
use tumble_core::simulation::{Checkpoints, Run};
use tumble_core::solver::native::StepGradient;

const STEPS: u64 = 400;

/// Pushes the top box in steps 170 to 172 if `is_pushed` is true.
fn push(simulation: &mut Simulation<'_>, is_pushed: bool) -> Result<(), Error> {
    let force = if is_pushed && (170..173).contains(&simulation.index()) { 2.0 } else { 0.0 };
    let top = simulation.states().len() - 1;
    simulation.set_wrench(top, Wrench { force: Vector3::new(force, 0.0, 0.0), ..Wrench::zero() })
}

/// Checks a backward pass that uses one matrix for all steps at rest and sums up the constants
/// without running these steps again. The reference linearises each step separately. A pushed box
/// wakes up and comes to rest again.
#[test]
fn runs_that_come_to_rest() {
    let few = [(7, 3), (40, 5)].map(|(steps, saved)| Checkpoints { steps, saved });
    for checkpoints in [Checkpoints::default()].into_iter().chain(few) {
        [false, true]
            .into_iter()
            .for_each(|is_pushed| a_run_that_comes_to_rest(checkpoints, is_pushed));
    }
}

fn a_run_that_comes_to_rest(checkpoints: Checkpoints, is_pushed: bool) {
    let scene = scenario("stack.toml");
    let constants = [Constant::Mass, Constant::Friction, Constant::Gravity, Constant::TimeStep];
    let mut run = scene.simulation(&Default::default()).unwrap();
    let bodies = run.states().len();
    let along = |k: u64| {
        let number = |n: usize| (n as f64 + 0.1 * k as f64).sin();
        vec![StateChange::from_array(&std::array::from_fn(number)); bodies]
    };
    // The objective also depends on every hundredth state.
    let by_states = |k: u64| (k == STEPS || k.is_multiple_of(100)).then(|| along(k));
    let found = run
        .gradient(&mut Run {
            steps: STEPS,
            before: &mut |simulation: &mut Simulation<'_>| push(simulation, is_pushed),
            by_states: &mut |k, _| by_states(k),
            constants: &constants,
            inputs: &[],
            checkpoints,
            smoothing: None,
            has_impact_times: false,
        })
        .unwrap();
    let mut run = scene.simulation(&Default::default()).unwrap();
    let mut steps: Vec<StepDerivative> = Vec::new();
    let (mut record, mut at_rest) = (StepRecord::new(), 0);
    for _ in 0..STEPS {
        push(&mut run, is_pushed).unwrap();
        run.step(&mut record).unwrap();
        let mut alone = StepDerivative::new();
        run.linearise(&record, &mut alone).unwrap();
        at_rest += usize::from(record.states() == record.next_states());
        steps.push(alone);
    }
    assert!(at_rest > 100, "{at_rest}");
    let (mut dual, mut gradient) = (along(STEPS), StepGradient::default());
    let mut sums: Vec<Vec<f64>> = found.constants.iter().map(|of| vec![0.0; of.len()]).collect();
    let near = |a: f64, b: f64, scale: f64| assert!((a - b).abs() <= 1e-11 * scale, "{a} {b}");
    for (k, alone) in steps.iter_mut().enumerate().rev() {
        alone.vjp(&dual, &constants, &mut gradient).unwrap();
        dual.clone_from(&gradient.states);
        let wrenches = found.wrenches[k].iter().zip(&gradient.wrenches);
        let largest = |of: &Wrench| of.force.amax().max(of.torque.amax());
        let scale = gradient.wrenches.iter().map(largest).fold(1e-3, f64::max);
        for (found, alone) in wrenches {
            near((found.force - alone.force).amax(), 0.0, scale);
            near((found.torque - alone.torque).amax(), 0.0, scale);
        }
        let each = sums.iter_mut().zip(&gradient.constants);
        each.for_each(|(sum, more)| sum.iter_mut().zip(more).for_each(|(sum, more)| *sum += more));
        if let Some(more) = by_states(k as u64) {
            dual.iter_mut().zip(&more).for_each(|(dual, more)| *dual = dual.plus(1.0, more));
        }
    }
    for (found, alone) in found.states.iter().zip(&dual) {
        near(size(&[found.plus(-1.0, alone)]), 0.0, size(&dual));
    }
    for (found, alone) in found.constants.iter().flatten().zip(sums.iter().flatten()) {
        near(*found, *alone, alone.abs().max(1.0));
    }
}
