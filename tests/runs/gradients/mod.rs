//! Derivative of a step against central differences of steps, in every regime and by every
//! argument.

mod batch;
mod central;
#[path = "../../../crates/core/tests/runs/gradients/compare.rs"]
mod compare;
mod driven;
mod joints;
mod landings;
mod loops;
mod rest;
mod shares;

use crate::common::draw;
use crate::common::prelude::*;
use compare::{
    Direction, Tally, apart, compare, difference, directions, on_a_slope, size, step, transposed,
};
use rand_mt::Mt;
use std::path::Path;
use tumble_core::simulation::{Checkpoints, Run, RunGradient};
use tumble_scene::scene::Scene;

fn scenario(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios").join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    let read = |path: &Path, _: u64| std::fs::read(path);
    differentiable(Scene::from_text(&text, &path, &[], &read).unwrap())
}

/// The scene with the integrator whose steps have derivatives.
fn differentiable(mut scene: Scene) -> Scene {
    scene.use_integrator(Integrator::Euler);
    scene
}

/// Gradient of Σ w·δX after `steps` steps. `weights` are w, one per body.
pub fn gradient_of_end(
    simulation: &mut Simulation<'_>,
    steps: u64,
    weights: &[StateChange],
    has_impact_times: bool,
) -> Result<RunGradient, Error> {
    simulation.gradient(&mut Run {
        steps,
        before: &mut |_| Ok(()),
        by_states: &mut |step, _| (step == steps).then(|| weights.to_vec()),
        constants: &[],
        inputs: &[],
        checkpoints: Checkpoints::default(),
        smoothing: None,
        has_impact_times,
    })
}

#[test]
fn the_transposed_product_is_that_of_the_same_matrix() {
    transposes(&StepDerivative::new());
}

/// Checks ⟨w, J v⟩ = ⟨Jᵀ w, v⟩ in every scene, by every argument.
fn transposes(derivative: &StepDerivative) {
    let mut twister = Mt::new(3);
    let mut draw = || f64::from(twister.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
    for name in [
        "drop",
        "slope",
        "block-on-block",
        "bricks",
        "marbles",
        "billiard",
        "double-pendulum",
        "four-bar",
        "chain",
    ] {
        let scene = scenario(&format!("{name}.toml"));
        let mut run = scene.simulation(&Default::default()).unwrap();
        let mut record = StepRecord::new();
        let mut derivative = derivative.clone();
        for k in 0..scene.rows.min(300) - 1 {
            run.step(&mut record).unwrap();
            if k % 60 != 30 {
                continue;
            }
            run.linearise(&record, &mut derivative).unwrap();
            let all = directions(&scene.world, &mut draw);
            transposed(&mut derivative, &all, &mut draw, &format!("{name} {k}"), 1e-7);
        }
    }
}

#[test]
#[ignore = "slow"]
fn every_argument_in_every_regime() {
    // Scenes, and the number of steps compared in each.
    let names = [
        ("drop", 3),
        ("slope", 3),
        ("real-cube", 3),
        ("plate", 3),
        ("point-mass", 3),
        ("block-on-block", 3),
        ("stack", 3),
        ("mass-ratio", 3),
        ("pyramid", 3),
        ("bricks", 8),
        ("arch", 3),
        ("marbles", 6),
        ("galton", 3),
        ("billiard", 3),
        ("pushed-tower", 3),
        ("dragged-cube", 3),
        ("pile", 5),
        ("double-pendulum", 3),
        ("slider-crank", 3),
        ("four-bar", 3),
        ("chain", 3),
        ("door", 3),
    ];
    let mut twister = Mt::new(1);
    let mut draw = || f64::from(twister.next_u32()) / f64::from(u32::MAX) * 2.0 - 1.0;
    let mut all = Tally::default();
    for (name, samples) in names {
        let scene = scenario(&format!("{name}.toml"));
        let mut run = scene.simulation(&Default::default()).unwrap();
        let mut record = StepRecord::new();
        let mut tally = Tally::default();
        let every = ((scene.rows - 1) / samples).max(1);
        for k in 0..scene.rows - 1 {
            run.step(&mut record).unwrap();
            if k % every == every / 2 {
                compare(
                    &scene.world,
                    record.states(),
                    &mut draw,
                    &format!("{name}, step {k}"),
                    &mut tally,
                );
            }
        }
        println!(
            "{name}: {} compared, {} left out, {} kinks, worst {:.1e}",
            tally.compared, tally.left_out, tally.kinks, tally.worst
        );
        all.compared += tally.compared;
        all.left_out += tally.left_out;
        all.kinks += tally.kinks;
        // A wall at rest lies on redundant corners, and in one of its steps that matters.
        assert!(tally.scattered <= if name == "bricks" { 3 } else { 0 }, "{name}");
        all.missed.extend(tally.missed);
    }
    println!("{} compared, {} left out, {} kinks", all.compared, all.left_out, all.kinks);
    assert!(all.missed.is_empty(), "{}", all.missed.join("\n"));
    assert!(all.compared > 200 && 20 * all.kinks < all.compared);
}

/// Checks the derivative of the final position of the tutorial's cube over a run that slides, tips
/// and lands. The backward derivative agrees with forward products. It does not depend on the
/// memory for checkpoints, and the run itself does not change.
#[test]
fn a_run_backwards() {
    let scene = scenario("real-cube.toml");
    let steps = 420;
    let running = || scene.simulation(&Default::default()).unwrap();
    let along = Vector3::new(0.6, -0.5, 0.3);
    let gradient = |checkpoints: Checkpoints| {
        let mut simulation = running();
        let mut before = |_: &mut Simulation<'_>| Ok(());
        let mut by_states = |k: u64, _: &[State]| {
            let end = StateChange { position: along, ..StateChange::zero() };
            (k == steps).then(|| vec![end])
        };
        let mut run = Run {
            steps,
            before: &mut before,
            by_states: &mut by_states,
            constants: &[Constant::Friction, Constant::Gravity],
            inputs: &[],
            checkpoints,
            smoothing: None,
            has_impact_times: false,
        };
        let found = simulation.gradient(&mut run).unwrap();
        assert_eq!(simulation.index(), steps);
        (found, simulation.states().to_vec())
    };
    let (found, end) = gradient(Checkpoints::default());
    assert_eq!(gradient(Checkpoints { steps: 7, saved: 3 }), (found.clone(), end.clone()));
    assert_eq!(found.unsolved + found.unknown + found.kept, 0);
    assert_eq!(found.wrenches.len() as u64, steps);
    // Forward product, with a change of the initial state and of friction.
    let change = StateChange::from_array(&std::array::from_fn(|k| (k as f64 + 1.0).sin()));
    let (mut simulation, mut record) = (running(), StepRecord::new());
    let (mut derivative, mut moving, mut next) = (StepDerivative::new(), vec![change], Vec::new());
    let friction = [(Constant::Friction, &[0.3][..])];
    for _ in 0..steps {
        simulation.step(&mut record).unwrap();
        simulation.linearise(&record, &mut derivative).unwrap();
        let step = StepChange { states: &moving, wrenches: &[], constants: &friction };
        derivative.jvp(&step, &mut next).unwrap();
        std::mem::swap(&mut moving, &mut next);
    }
    assert_eq!(simulation.states(), end);
    let forwards = along.dot(&moving[0].position);
    let backwards = found.states[0].dot(&change) + 0.3 * found.constants[0][0];
    // Rounding of 420 systems with a condition of 1/ε = 1e6.
    assert!((forwards - backwards).abs() <= 1e-6 * forwards.abs(), "{forwards} {backwards}");
}

/// Checks a tall box that is tipped over by a load at its top. The torque of the load turns with
/// the box. The derivatives by the wrenches of all steps, by mass and by gravity agree with central
/// differences of the run.
#[test]
fn a_run_under_a_load_that_acts_at_a_point() {
    let scene = scenario("pushed-tower.toml");
    let steps = 800;
    let end = |world: &World, push: Vector3<f64>| {
        let scene = Scene { world: world.clone(), ..scene.clone() };
        let mut simulation = scene.simulation(&Default::default()).unwrap();
        simulation.set_wrench(0, Wrench { force: push, torque: Vector3::zeros() }).unwrap();
        let mut record = StepRecord::new();
        (0..steps).for_each(|_| simulation.step(&mut record).unwrap());
        simulation.state().position.x
    };
    let mut by_states = |k: u64, _: &[State]| {
        let end = StateChange { position: Vector3::x(), ..StateChange::zero() };
        (k == steps).then(|| vec![end])
    };
    let mut simulation = scene.simulation(&Default::default()).unwrap();
    let found = simulation.gradient(&mut Run {
        steps,
        before: &mut |_| Ok(()),
        by_states: &mut by_states,
        constants: &[Constant::Mass, Constant::Gravity],
        inputs: &[],
        checkpoints: Checkpoints { steps: 90, saved: 3 },
        smoothing: None,
        has_impact_times: false,
    });
    let found = found.unwrap();
    let close = |found: f64, difference: f64| {
        // Truncation error of a difference with step 1e-4, for derivatives of up to 0.1.
        assert!((found - difference).abs() < 1e-6, "{found} {difference}");
    };
    const BY: f64 = 1e-4;
    let set = |constant: Constant, place: usize, by: f64| {
        let mut numbers = constant.values(&scene.world);
        numbers[place] += by;
        scene.world.with_constants(&[(constant, &numbers)]).unwrap()
    };
    for (slopes, constant) in found.constants.iter().zip([Constant::Mass, Constant::Gravity]) {
        for (place, slope) in slopes.iter().enumerate() {
            let at = |by: f64| end(&set(constant, place, by), Vector3::zeros());
            close(*slope, (at(BY) - at(-BY)) / (2.0 * BY));
        }
    }
    for k in 0..3 {
        let slope: f64 = found.wrenches.iter().map(|wrenches| wrenches[0].force[k]).sum();
        let at = |by: f64| end(&scene.world, Vector3::ith(k, by));
        close(slope, (at(BY) - at(-BY)) / (2.0 * BY));
    }
}

/// Checks that an object reused for step after step returns the derivative that a new one returns
/// for each step. Steps at rest reuse the last derivative. A change of the world at rest is
/// noticed.
#[test]
fn reused_derivative_agrees_with_a_new_one_at_rest() {
    let scene = scenario("stack.toml");
    let mut run = scene.simulation(&Default::default()).unwrap();
    let (mut record, mut kept) = (StepRecord::new(), StepDerivative::new());
    let change: Vec<StateChange> = run
        .states()
        .iter()
        .map(|_| StateChange::from_array(&std::array::from_fn(|k| (k as f64 + 1.0).sin())))
        .collect();
    let pushed = |derivative: &mut StepDerivative| {
        let mut end = Vec::new();
        let change = StepChange { states: &change, ..StepChange::default() };
        derivative.jvp(&change, &mut end).unwrap();
        end
    };
    let mut at_rest = 0;
    for _ in 0..300 {
        run.step(&mut record).unwrap();
        run.linearise(&record, &mut kept).unwrap();
        let mut alone = StepDerivative::new();
        run.linearise(&record, &mut alone).unwrap();
        assert_eq!(pushed(&mut kept), pushed(&mut alone));
        for body in [0, change.len() - 1] {
            let mut found = [Vec::new(), Vec::new()];
            kept.jacobian_wrt_state(body, &mut found[0]).unwrap();
            alone.jacobian_wrt_state(body, &mut found[1]).unwrap();
            assert_eq!(found[0], found[1]);
        }
        at_rest += usize::from(record.states() == record.next_states());
    }
    assert!(at_rest > 100, "{at_rest} steps at rest");
    let heavier = scene.world.with_constants(&[(Constant::Mass, &[9.0; 64][..change.len()])]);
    let states = run.states().to_vec();
    let (other, record) = step(&heavier.unwrap(), &states, &[]).unwrap();
    other.linearise(&record, &mut kept).unwrap();
    let mut alone = StepDerivative::new();
    other.linearise(&record, &mut alone).unwrap();
    assert_eq!(pushed(&mut kept), pushed(&mut alone));
    let mut found = [Vec::new(), Vec::new()];
    kept.jacobian_wrt_state(0, &mut found[0]).unwrap();
    alone.jacobian_wrt_state(0, &mut found[1]).unwrap();
    assert_eq!(found[0], found[1]);
}
