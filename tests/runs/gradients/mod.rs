//! Derivative of a step against central differences of steps, in every regime and by every
//! argument.

mod articulated;
mod batch;
mod campaign;
mod central;
mod compare;
mod digits;
mod draw;
mod driven;
mod dry;
mod joints;
mod landings;
mod laws;
mod loops;
mod own;
mod random;
mod rest;
mod shares;
mod smooth;
mod sums;
mod turns;

use compare::{Direction, Tally, apart, compare, difference, directions, size, transposed};
use nalgebra::{Vector3, Vector4};
use rand_mt::Mt;
use std::path::Path;
use tumble_core::contact::Plane;
use tumble_core::derivative::StateChange;
use tumble_core::mechanics::{RigidBody, Rotation, State, Wrench};
use tumble_core::simulation::{Checkpoints, Motion, Run, Simulation, StepRecord};
use tumble_core::solver::native::{Smoothing, StepChange, StepDerivative};
use tumble_core::step::StepStatus;
use tumble_core::world::{Constant, Integrator, Parameters, World};
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

/// One step from the given states, or `None` if it is not solved at full length.
fn step<'a>(
    world: &World,
    states: &[State],
    wrenches: &[Wrench],
) -> Option<(Simulation<'a>, StepRecord)> {
    let motion = Motion::native(world);
    let mut simulation = Simulation::new(world.clone(), states.to_vec(), motion).ok()?;
    for (body, wrench) in wrenches.iter().enumerate() {
        simulation.set_wrench(body, *wrench).unwrap();
    }
    let mut record = StepRecord::new();
    simulation.step(&mut record).unwrap();
    let unsolved = [StepStatus::Failed, StepStatus::Substepped];
    (!unsolved.contains(&record.status())).then_some((simulation, record))
}

/// Cube of mass 2 kg and half side 0.1 m on a slope of `angle` [rad], sliding down at `velocity`
/// [m/s].
fn on_a_slope(angle: f64, friction: f64, velocity: f64) -> (World, Vec<State>) {
    let body = RigidBody::solid_box(2.0, Vector3::repeat(0.1)).unwrap();
    let (sin, cos) = angle.sin_cos();
    let ground = Plane::new(Vector3::new(sin, 0.0, cos), 0.0).unwrap();
    let parameters = Parameters {
        bodies: vec![body],
        ground: Some(ground),
        gravity: Vector3::new(0.0, 0.0, -9.81),
        friction,
        time_step: 0.002,
        rotation: Rotation::Momentum,
    };
    let state = State {
        position: Vector3::new(sin, 0.0, cos) * 0.1,
        attitude: Vector4::new((0.5 * angle).cos(), 0.0, (0.5 * angle).sin(), 0.0),
        velocity: Vector3::new(cos, 0.0, -sin) * velocity,
        spin: Vector3::zeros(),
    };
    (World::new(parameters).unwrap().with_integrator(Integrator::Euler), vec![state])
}

/// Component of δv along the slope for changes of the constants of the world.
fn along_the_slope(
    scene: &(World, Vec<State>),
    angle: f64,
    constants: &[(Constant, &[f64])],
) -> f64 {
    let (simulation, base) = step(&scene.0, &scene.1, &[]).unwrap();
    let mut derivative = StepDerivative::new();
    simulation.linearise(&base, &mut derivative).unwrap();
    let mut end = Vec::new();
    derivative.jvp(&StepChange { constants, ..StepChange::default() }, &mut end).unwrap();
    Vector3::new(angle.cos(), 0.0, -angle.sin()).dot(&end[0].velocity)
}

/// Checks v⁺ = v + h g (sin α − μ cos α) for four sliding corners, two of which are redundant.
#[test]
fn a_slide_by_friction_gravity_mass_and_inertia() {
    let (angle, friction, h, g) = (0.5, 0.3, 0.002, 9.81);
    let scene = on_a_slope(angle, friction, 1.0);
    let by = |constants: &[(Constant, &[f64])]| along_the_slope(&scene, angle, constants);
    // Rounding of the velocity 1 m/s, and 1e-16/1e-6 for the undetermined part.
    let close =
        |found: f64, expected: f64| assert!((found - expected).abs() < 1e-11, "{found} {expected}");
    close(by(&[(Constant::Friction, &[1.0])]), -h * g * angle.cos());
    close(
        by(&[(Constant::Gravity, &[0.0, 0.0, -1.0])]),
        h * (angle.sin() - friction * angle.cos()),
    );
    close(by(&[(Constant::Mass, &[1.0])]), 0.0);
    close(by(&[(Constant::Inertia, &[1e-2, 0.0, 0.0, 0.0, 2e-2, 0.0, 0.0, 0.0, 3e-2])]), 0.0);
    close(by(&[(Constant::TimeStep, &[1.0])]), g * (angle.sin() - friction * angle.cos()));
}

/// Checks that a sticking block has zero derivatives for any push: a plateau.
#[test]
fn sticking_body_has_zero_derivative_by_a_push() {
    let angle = 0.2;
    let scene = on_a_slope(angle, 0.5, 0.0);
    let found = along_the_slope(&scene, angle, &[(Constant::Gravity, &[1.0, 0.5, -2.0])]);
    assert!(found.abs() < 1e-11, "{found}");
    assert!(along_the_slope(&scene, angle, &[(Constant::Friction, &[1.0])]).abs() < 1e-11);
}

/// Checks that with compliance a sticking block creeps under a push along the ground. Four corners
/// with u = −ε p̂ each and m v = h F + Σ m p̂ lead to v = h F/m ε/(4 + ε). The same holds for a
/// push downwards.
#[test]
fn sticking_body_creeps_with_compliance() {
    let (world, states) = on_a_slope(0.0, 0.5, 0.0);
    let (simulation, base) = step(&world, &states, &[]).unwrap();
    for compliance in [1e-6, 1e-3, 1e-1] {
        let mut derivative = StepDerivative::smoothed(Smoothing::Compliance(compliance)).unwrap();
        simulation.linearise(&base, &mut derivative).unwrap();
        let mut pushed = |force: Vector3<f64>, torque: Vector3<f64>| {
            let wrenches = [Wrench { force, torque }];
            let mut end = Vec::new();
            let change = StepChange { wrenches: &wrenches, ..StepChange::default() };
            derivative.jvp(&change, &mut end).unwrap();
            end[0]
        };
        let expected = 0.002 / 2.0 * compliance / (4.0 + compliance);
        // With the torque of the friction about the centre.
        let torque = -0.1 * 4.0 / (4.0 + compliance);
        let along = pushed(Vector3::x(), Vector3::new(0.0, torque, 0.0));
        assert!((along.velocity[0] - expected).abs() <= 1e-9 * expected, "{along:?}");
        assert!(along.spin.norm() <= 1e-9 * expected / 0.1, "{along:?}");
        let down = pushed(-Vector3::z(), Vector3::zeros());
        assert!((down.velocity[2] + expected).abs() <= 1e-9 * expected, "{down:?}");
        assert_eq!(derivative.smoothing(), Some(Smoothing::Compliance(compliance)));
    }
    for refused in [0.0, -1.0, 2.0, f64::NAN] {
        assert!(StepDerivative::smoothed(Smoothing::Compliance(refused)).is_err());
    }
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
