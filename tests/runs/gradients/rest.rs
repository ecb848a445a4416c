//! The derivative of a run in which things come to rest, against products step by step.

use super::{scenario, size};
use tumble::derivative::StateChange;
use tumble::mechanics::Wrench;
use tumble::simulation::{Checkpoints, Run, StepRecord};
use tumble::solver::native::{StepDerivative, StepGradient};
use tumble::world::Constant;

/// A run goes back through its steps at rest with one matrix, and sums up for the constants; each step alone is solved anew.
#[test]
fn a_run_that_comes_to_rest() {
    const STEPS: u64 = 400;
    let scene = scenario("stack.toml");
    let constants = [Constant::Mass, Constant::Friction, Constant::Gravity, Constant::TimeStep];
    let mut run = scene.simulation(&Default::default()).unwrap();
    let bodies = run.states().len();
    let along = |k: u64| {
        let number = |n: usize| (n as f64 + 0.1 * k as f64).sin();
        vec![StateChange::from_array(&std::array::from_fn(number)); bodies]
    };
    // Numbers that every hundredth state decides, too.
    let by_states = |k: u64| (k == STEPS || k.is_multiple_of(100)).then(|| along(k));
    let found = run
        .gradient(&mut Run {
            steps: STEPS,
            before: &mut |_| Ok(()),
            by_states: &mut |k, _| by_states(k),
            constants: &constants,
            checkpoints: Checkpoints::default(),
            smoothing: None,
        })
        .unwrap();
    let mut run = scene.simulation(&Default::default()).unwrap();
    let mut steps: Vec<StepDerivative> = Vec::new();
    let (mut record, mut at_rest) = (StepRecord::new(), 0);
    for _ in 0..STEPS {
        run.step(&mut record).unwrap();
        let mut alone = StepDerivative::new();
        run.linearise(&record, &mut alone).unwrap();
        at_rest += usize::from(record.states == record.solution.states);
        steps.push(alone);
    }
    assert!(at_rest > 100, "{at_rest}");
    let (mut dual, mut gradient) = (along(STEPS), StepGradient::default());
    let mut sums: Vec<Vec<f64>> = found.constants.iter().map(|of| vec![0.0; of.len()]).collect();
    let near = |a: f64, b: f64, scale: f64| assert!((a - b).abs() <= 1e-11 * scale, "{a} {b}");
    for (k, alone) in steps.iter_mut().enumerate().rev() {
        alone.pull(&dual, &constants, &mut gradient).unwrap();
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
