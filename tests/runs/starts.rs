//! Allowed starts of a simulation, including states of an earlier run.

use crate::common::prelude::*;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_scene::scene::Scene;

fn scenario(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios").join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    let read = |path: &Path, _: u64| std::fs::read(path);
    Scene::from_text(&text, &path, &[], &read).unwrap()
}

#[test]
fn every_state_of_a_run_is_a_valid_start() {
    for name in ["pile.toml", "bricks.toml", "stack.toml", "slope.toml", "card-house.toml"] {
        let scene = scenario(name);
        let mut run = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
        let mut record = StepRecord::new();
        for step in 0..scene.rows - 1 {
            run.step(&mut record).unwrap();
            if step % 7 > 0 && name != "pile.toml" {
                continue;
            }
            let motion = Motion::native(&scene.world);
            let again = Simulation::new(scene.world.clone(), run.states().to_vec(), motion);
            let mut again = again.unwrap_or_else(|error| panic!("{name}, step {step}: {error}"));
            if step % 50 == 0 {
                let mut next = StepRecord::new();
                again.step(&mut next).unwrap();
                assert_ne!(next.status(), StepStatus::Failed, "{name}, step {step}");
            }
        }
    }
}

fn running(scene: &Scene) -> Simulation<'static> {
    scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap()
}

fn steps(simulation: &mut Simulation<'_>, count: usize) -> Vec<StepRecord> {
    let mut record = StepRecord::new();
    let step = |_| {
        simulation.step(&mut record).unwrap();
        record.clone()
    };
    (0..count).map(step).collect()
}

#[test]
fn a_simulation_that_starts_later_sees_the_loads_of_that_time() {
    let mut scene = scenario("dragged-cube.toml");
    // A run that starts again at the velocities of the instant is the same to second order only.
    scene.use_integrator(Integrator::Euler);
    let mut whole = running(&scene);
    steps(&mut whole, 300);
    let motion = Motion::native(&scene.world);
    let states = whole.states().to_vec();
    let mut later = Simulation::new(scene.world.clone(), states.clone(), motion).unwrap();
    later.set_index(300).unwrap();
    // The load grows with time, so that the motion shows the time.
    let knots = [(0.0, [0.0; 3].into()), (10.0, [700.0, 0.0, 0.0].into())].to_vec();
    let load = Load::new(Polyline::new(knots).unwrap(), Polyline::default(), [0.0; 3].into());
    let load = load.unwrap();
    for simulation in [&mut whole, &mut later] {
        simulation.set_load(0, load.clone()).unwrap();
    }
    let (first, then) = (steps(&mut whole, 40), steps(&mut later, 40));
    for (first, then) in first.iter().zip(&then) {
        assert_eq!(first.index, then.index);
        let way = (first.next().position - then.next().position).norm();
        assert!(way <= 1e-12, "{way} at {}", first.index);
    }
    // The same load from time 0 would not have moved the cube.
    let motion = Motion::native(&scene.world);
    let mut at_zero = Simulation::new(scene.world.clone(), states, motion).unwrap();
    at_zero.set_load(0, load).unwrap();
    let last = steps(&mut at_zero, 40).pop().unwrap();
    assert!((last.next().velocity - then[39].next().velocity).norm() > 1e-3);
    assert!(later.set_index(1 << 60).is_err());
}

#[test]
fn body_continues_from_the_state_that_was_set() {
    let scene = scenario("stack.toml");
    let mut run = running(&scene);
    steps(&mut run, 20);
    let top = scene.starts.len() - 1;
    let there = run.states().to_vec();
    let away = State { position: there[top].position + Vector3::new(5.0, 0.0, 3.0), ..there[top] };
    run.set_state(top, away).unwrap();
    assert_eq!(run.states()[top], away);
    assert_eq!(run.states()[..top], there[..top]);
    let record = steps(&mut run, 1).pop().unwrap();
    // The body falls freely, and the ones below it stand.
    let (h, g) = (scene.world.time_step(), scene.world.gravity());
    let fallen = run.states()[top].velocity - away.velocity;
    assert!((fallen - g * h).norm() < 1e-12);
    assert!(
        record.first().contacts.iter().all(|contact| contact.key.bodies().all(|body| body != top))
    );
    for (state, before) in record.next_states()[..top].iter().zip(&there) {
        assert!((state.position - before.position).norm() < 1e-6);
    }
    assert_ne!(record.status(), StepStatus::Failed);
}

#[test]
fn a_velocity_that_is_set_moves_the_body_and_forces_of_the_others_stay() {
    let scene = scenario("stack.toml");
    let mut run = running(&scene);
    let mut record = steps(&mut run, 20).pop().unwrap();
    let top = scene.starts.len() - 1;
    let pushed = State { velocity: [0.5, 0.0, 0.0].into(), ..run.states()[top] };
    run.set_state(top, pushed).unwrap();
    run.take_back(&record);
    assert_eq!(run.index(), 20, "the step before is no longer to be taken back");
    run.step(&mut record).unwrap();
    let sideways = record.next_states()[top].velocity[0];
    assert!((0.4..0.5).contains(&sideways), "{sideways}");
}

#[test]
fn invalid_state_is_rejected_and_changes_nothing() {
    let scene = scenario("stack.toml");
    let (mut run, mut undisturbed) = (running(&scene), running(&scene));
    for simulation in [&mut run, &mut undisturbed] {
        steps(simulation, 20);
    }
    let here = run.states().to_vec();
    let moved = |by: [f64; 3]| State { position: here[1].position + Vector3::from(by), ..here[1] };
    let overlap = run.set_state(1, moved([0.0, 0.0, 0.05])).unwrap_err();
    assert!(matches!(overlap, Error::Overlap { .. }), "{overlap}");
    let deep = run.set_state(1, moved([9.0, 0.0, -50.0])).unwrap_err();
    assert!(matches!(deep, Error::StartBelowGround { .. }), "{deep}");
    let odd = State { velocity: [f64::NAN, 0.0, 0.0].into(), ..here[1] };
    assert!(run.set_state(1, odd).is_err());
    assert!(run.set_state(99, here[1]).is_err());
    assert!(run.set_states(&here[1..]).is_err());
    assert_eq!(steps(&mut run, 30), steps(&mut undisturbed, 30));
}

#[test]
fn all_states_can_be_set_at_once() {
    let scene = scenario("stack.toml");
    let mut run = running(&scene);
    steps(&mut run, 20);
    let back: Vec<_> = scene.starts.iter().rev().copied().collect();
    run.set_states(&back).unwrap();
    assert_eq!(run.states(), back);
    let record = steps(&mut run, 30).pop().unwrap();
    assert_ne!(record.status(), StepStatus::Failed);
}

/// Checks that a start beyond a joint's limits is refused. The limit would push the body back
/// within one step, and the energy would grow as the step gets shorter.
#[test]
fn joint_beyond_its_limits_is_rejected() {
    let start = |linear: bool, limits: [f64; 2], at: f64| {
        let frame = JointFrame::along(Vector3::zeros(), Vector3::x()).unwrap();
        let drive = Drive { limits: Some(limits), ..Drive::NONE };
        let joint = if linear {
            Joint::prismatic(0, None, [frame; 2], drive)
        } else {
            Joint::revolute(0, None, [frame; 2], drive)
        };
        let bodies = vec![RigidBody::solid_box(1.0, Vector3::repeat(0.1)).unwrap()];
        let parameters = Parameters {
            ground: None,
            gravity: Vector3::zeros(),
            friction: 0.0,
            ..Parameters::new(bodies)
        };
        let world = World::new(parameters).unwrap().with_joints(vec![joint]).unwrap();
        let (sine, cosine) = (0.5 * at).sin_cos();
        let state = if linear {
            State { position: Vector3::new(at, 0.0, 0.0), ..still() }
        } else {
            State { attitude: Vector4::new(cosine, sine, 0.0, 0.0), ..still() }
        };
        let motion = Motion::native(&world);
        Simulation::new(world, [state], motion)
    };
    for linear in [true, false] {
        for (limits, at, size) in
            [([0.5, 1.0], 0.0, 0.5), ([0.02, 1.0], 0.0, 0.02), ([-1.0, 0.25], 0.75, 0.5)]
        {
            let Err(Error::JointBeyond { joint: 0, place, turn, .. }) = start(linear, limits, at)
            else {
                panic!("{linear} {limits:?} {at}: taken");
            };
            let [off, none] = if linear { [place, turn] } else { [turn, place] };
            assert!((off - size).abs() < 1e-12 && none == 0.0, "{place} {turn}");
        }
        for at in [0.25 - 1e-9, -1.0, 0.25 + 1e-9] {
            assert!(start(linear, [-1.0, 0.25], at).is_ok(), "{linear} {at}");
        }
    }
}

fn still() -> State {
    let zero = Vector3::zeros();
    let attitude = Vector4::new(1.0, 0.0, 0.0, 0.0);
    State { position: zero, attitude, velocity: zero, spin: zero }
}
