//! Borders of the leapfrog integrator: inputs, starts, and lengths that change (eq. 37).

use crate::common::prelude::*;
use crate::leapfrog::{NO_GROUND, at, pendulum, simulation};

const G: f64 = 9.81;

fn pushed(force: [f64; 3]) -> Wrench {
    Wrench { force: force.into(), torque: Vector3::zeros() }
}

/// Takes a step under the wrench, and returns the state after it.
fn step(simulation: &mut Simulation<'_>, force: [f64; 3]) -> State {
    simulation.set_wrench(0, pushed(force)).unwrap();
    simulation.step(&mut StepRecord::new()).unwrap();
    simulation.states()[0]
}

/// A wrench of one step gives its impulse, whatever the step is: 1 N s on 1 kg.
#[test]
fn a_held_wrench_gives_its_impulse() {
    let text = format!(
        "gravity = [0, 0, 0]\n{NO_GROUND}[[bodies]]\nname = \"b\"\nbox = 0.2\nmass = 1.0\nposition = [0, 0, 5]\n"
    );
    for given in [0, 1, 5] {
        let mut simulation = simulation(&text, 0.01);
        for k in 0..9 {
            let force = if k == given { 100.0 } else { 0.0 };
            let after = step(&mut simulation, [force, 0.0, 0.0]);
            let speed = if k < given { 0.0 } else { 1.0 };
            assert!((after.velocity.x - speed).abs() <= 1e-14, "{given} {k}: {}", after.velocity.x);
            // x = ½ a t² during the step, and uniform motion after it.
            let place = if k < given { 0.0 } else { 0.005 + 0.01 * (k - given) as f64 };
            assert!((after.position.x - place).abs() <= 1e-14, "{given} {k}: {}", after.position.x);
        }
    }
}

/// A held force pulls a block over the ground from rest, or a sliding one from a later step on. Places have the
/// closed form of a constant force.
#[test]
fn a_held_force_pulls_a_block_exactly() {
    for (first, speed) in [(0, 0.0), (7, 1.0)] {
        let text = format!(
            "[ground]\nfriction = 0.3\n[[bodies]]\nname = \"b\"\nbox = 0.2\nmass = 2.0\nposition = [0, 0, 0.1]\nvelocity = [{speed}, 0, 0]\n"
        );
        let mut simulation = simulation(&text, 0.005);
        let begins = 0.005 * first as f64;
        for k in 0..40 {
            let force = if k < first { 0.0 } else { 10.0 };
            let after = step(&mut simulation, [force, 0.0, 0.0]);
            let time = 0.005 * (k + 1) as f64;
            let pulled = (time - begins).max(0.0);
            let place = speed * time - 0.15 * G * time * time + 2.5 * pulled * pulled;
            let off = after.position.x - place;
            assert!(off.abs() <= 1e-11, "{first} {k}: {off}");
            let off = after.velocity.x - (speed - 0.3 * G * time + 5.0 * pulled);
            assert!(off.abs() <= 1e-9, "{first} {k}: {off}");
        }
    }
}

/// Motion is continuous in the velocity of the start, also at rest.
#[test]
fn a_start_is_continuous_at_rest() {
    let slope = |speed: f64| {
        let (sine, cosine) = 0.5f64.sin_cos();
        format!(
            "[ground]\nfriction = 0.3\nslope = {}\n[[bodies]]\nname = \"b\"\nbox = [0.4, 0.4, 0.1]\nmass = 1.0\n\
             position = [{}, 0, {}]\nattitude = {{ axis = [0, 1, 0], degrees = {} }}\nvelocity = [{}, 0, {}]\n",
            0.5f64.to_degrees(),
            0.05 * sine,
            0.05 * cosine,
            0.5f64.to_degrees(),
            speed * cosine,
            -speed * sine
        )
    };
    for h in [0.004, 0.001] {
        let end = |speed: f64| at(&slope(speed), 0.16, h)[0].position;
        let rest = end(0.0);
        let exact = 0.5 * G * (0.5f64.sin() - 0.3 * 0.5f64.cos()) * 0.16 * 0.16;
        assert!((rest.norm() - (exact * exact + 0.05 * 0.05).sqrt()).abs() <= 1e-12, "{h}");
        for speed in [-1e-7, 1e-7, -1e-5, 1e-5] {
            let moved = (end(speed) - rest).norm();
            assert!(moved <= 0.2 * speed.abs(), "{h} {speed}: {moved}");
        }
    }
}

/// A frictionless pendulum at 20 rad/s and 0.1 rad a step keeps its speed, and no step is divided.
#[test]
fn a_spinning_pendulum_keeps_its_energy() {
    let text = format!(
        "{NO_GROUND}[[bodies]]\nname = \"ball\"\nsphere = 0.05\nmass = 1.0\nposition = [0, 0, -0.5]\nvelocity = [-10, 0, 0]\n\
         spin = [0, 20, 0]\n[[joints]]\nname = \"hinge\"\ntype = \"revolute\"\nbodies = \"ball\"\nanchor = [0, 0, 0]\naxis = [0, 1, 0]\n"
    );
    let mut simulation = simulation(&text, 0.005);
    let mut record = StepRecord::new();
    let mut energies = Vec::new();
    for k in 0..400 {
        energies.push(simulation.energy());
        simulation.step(&mut record).unwrap();
        assert_eq!(record.status(), StepStatus::Converged, "{k}");
    }
    // The energy of velocities along chords swings by a share of (h ω)², and has no trend.
    let mean = |from: usize| energies[from..from + 63].iter().sum::<f64>() / 63.0;
    assert!((mean(330) / mean(1) - 1.0).abs() <= 1e-3, "{} {}", mean(1), mean(330));
    assert!(energies.iter().all(|energy| (energy / energies[0] - 1.0).abs() <= 0.01));
}

/// The forces of the first step are those of the load, not half of them.
#[test]
fn the_first_step_has_the_weight() {
    let text = "[ground]\nfriction = 0.3\n[[bodies]]\nname = \"b\"\nbox = 0.2\nmass = 2.0\nposition = [0, 0, 0.1]\n";
    let mut simulation = simulation(text, 0.01);
    let mut record = StepRecord::new();
    for k in 0..3 {
        simulation.step(&mut record).unwrap();
        let weight = record.mean_force(0).z;
        assert!((weight - 2.0 * G).abs() <= 1e-9, "{k}: {weight}");
    }
}

/// After a flat landing, the velocity that closed the gap leaves no rebound in the rows.
#[test]
fn a_flat_landing_leaves_no_rebound() {
    for (h, height) in [(0.02, 0.1011), (0.02, 0.13), (0.005, 0.1123), (0.01, 0.2)] {
        let text = format!(
            "[ground]\nfriction = 0.3\n[[bodies]]\nname = \"b\"\nbox = 0.2\nmass = 2.0\nposition = [0, 0, {height}]\n"
        );
        let mut simulation = simulation(&text, h);
        let mut record = StepRecord::new();
        let mut landed = None;
        for k in 0..40 {
            simulation.step(&mut record).unwrap();
            let state = simulation.states()[0];
            if landed.is_some_and(|landed| k > landed) {
                assert!(state.velocity.amax() <= 1e-11, "{h} {height} {k}: {}", state.velocity);
            }
            if record.mean_force(0).z > 0.0 && landed.is_none() {
                landed = Some(k);
            }
        }
        assert!(landed.is_some_and(|landed| landed < 39));
    }
}

/// If the state of one of two jointed bodies is set, both start, and their momentum is that of the states.
#[test]
fn a_body_that_is_set_starts_its_island() {
    let bodies = "gravity = [0, 0, 0]\n[ground]\nnone = true\nfriction = 0\n\
         [[bodies]]\nname = \"a\"\nbox = 0.2\nmass = 1.0\nposition = [-0.5, 0, 0]\nvelocity = [0, 1, 0]\nspin = [0, 0, -2]\n\
         [[bodies]]\nname = \"b\"\nbox = 0.2\nmass = 3.0\nposition = [0.5, 0, 0]\nvelocity = [0, -1, 0]\nspin = [0, 0, -2]\n\
         [[joints]]\nname = \"j\"\ntype = \"spherical\"\nbodies = [\"a\", \"b\"]\nanchor = [0, 0, 0]\n";
    let mut simulation = simulation(bodies, 0.002);
    let mut record = StepRecord::new();
    for _ in 0..50 {
        simulation.step(&mut record).unwrap();
    }
    let momentum = |states: &[State]| states[0].velocity + 3.0 * states[1].velocity;
    let mut faster = simulation.states()[0];
    faster.velocity += Vector3::new(0.1, 0.3, -0.2);
    simulation.set_state(0, faster).unwrap();
    let expected = momentum(simulation.states());
    for k in 0..50 {
        simulation.step(&mut record).unwrap();
        let now = momentum(simulation.states());
        assert!((now - expected).amax() <= 1e-11, "{k}: {now} {expected}");
    }
}

/// The pendulum that starts in the middle of its swing follows that which swings on.
#[test]
fn a_start_in_motion_is_of_second_order() {
    let error = |h: f64| {
        let mut whole = simulation(&pendulum(), h);
        let mut again = simulation(&pendulum(), h);
        let steps = (0.4 / h).round() as u64;
        let mut record = StepRecord::new();
        for k in 0..2 * steps {
            if k == steps {
                // A start at the present state, which is another one by rounding.
                let mut state = again.states()[0];
                state.velocity *= 1.0 + 1e-15;
                again.set_state(0, state).unwrap();
            }
            whole.step(&mut record).unwrap();
            again.step(&mut record).unwrap();
        }
        (whole.states()[0].position - again.states()[0].position).norm()
    };
    let order = (error(0.01) / error(0.005)).log2();
    assert!(order >= 1.8, "{order}");
}
