//! The nine steps of `data/exact/hard-steps.json`, each solved as a single step: jams, corners that
//! start to slip, faces that land or come to rest.

use crate::common::prelude::*;
use crate::common::{point_forces, reference, state};
use crate::toss::*;
use serde::Deserialize;

#[derive(Deserialize)]
struct Steps {
    steps: Vec<HardStep>,
}

/// Step with its exact solution. Impulses in N s, one per corner.
#[derive(Deserialize)]
struct HardStep {
    run: String,
    step: u64,
    why: String,
    state: Vec<f64>,
    impulses_before: Vec<[f64; 3]>,
    next: Vec<f64>,
    impulses: Vec<[f64; 3]>,
    modes: Vec<u8>,
}

const TIME_STEP: f64 = 0.002;
const FRICTION: f64 = 0.3;

impl HardStep {
    fn name(&self) -> String {
        format!("{}, step {} ({})", self.run, self.step, self.why)
    }

    /// Solves the step with a new solver that starts from the given impulses.
    fn solve(&self, before: &[[f64; 3]]) -> Solved {
        let world = cube_world(if self.run.ends_with("6.666667") { SOLID } else { LIGHT });
        let state = state(&self.state);
        let forces: Vec<_> = before.iter().map(|&p| Vector3::from(p) / TIME_STEP).collect();
        let start = with_forces(&world, &state, &forces);
        solve_step(&mut NativeSolver::new(&world), &world, &state, &start)
    }
}

fn hard_steps() -> Vec<HardStep> {
    let steps: Steps = serde_json::from_str(&reference("exact/hard-steps.json")).unwrap();
    assert_eq!(steps.steps.len(), 9);
    steps.steps
}

/// Compares the next state and the impulses with the exact ones, starting from the last impulses
/// and from none.
///
/// Where the laws determine the impulses, the error is rounding: 1e-12 of the speeds and impulses.
/// Where a face slides, the error comes from the compliance 1e-6 from which the limit is taken. It
/// is 1e-6 times impulse over mass (up to 2 m/s) times the response of the corner.
#[test]
fn the_next_state_and_the_impulses_are_the_exact_ones() {
    for step in hard_steps() {
        let world = cube_world(SOLID);
        for before in [step.impulses_before.clone(), vec![[0.0; 3]; 8]] {
            let solved = step.solve(&before);
            let (ours, exact) = (&solved.solution.states[0], state(&step.next));
            let (motion, pose) = (motion_apart(&world, ours, &exact), pose_apart(ours, &exact));
            let face = step.modes.iter().filter(|mode| **mode > 0).count() > 2;
            let (speed, impulse) = if face { (2e-7, 5e-6) } else { (2e-12, 2e-11) };
            assert_ne!(solved.report.status, StepStatus::Failed, "{}", step.name());
            assert!(motion < speed, "{}: motion by {motion:e} m/s", step.name());
            // A step of 2 ms turns speeds into lengths. 1e-15 is rounding.
            assert!(pose < TIME_STEP * speed + 1e-15, "{}: pose by {pose:e}", step.name());
            let ours = point_forces(&world, &solved.solution);
            for (i, (ours, &exact)) in ours.iter().zip(&step.impulses).enumerate() {
                let apart = (ours * TIME_STEP - Vector3::from(exact)).amax();
                assert!(apart < impulse, "{}: impulse {i} by {apart:e} N s", step.name());
            }
        }
    }
}

/// Checks the state of every corner. Open corners carry nothing. Sticking corners do not move and
/// are inside the cone. Sliding corners are on the cone. Speeds have the tolerance of the
/// certificate, 1e-10 m/s, and forces that times m/h.
#[test]
fn every_corner_does_what_it_does_in_the_exact_solution() {
    for step in hard_steps() {
        let solved = step.solve(&step.impulses_before);
        assert!(solved.certificate.residual() < 1e-10, "{}: {:?}", step.name(), solved.certificate);
        for (i, mode) in step.modes.iter().enumerate() {
            // A corner that is not a candidate also carries nothing.
            let found = solved.solution.contacts.iter().find(|contact| contact.key.point == i);
            let (force, slip) = found
                .map_or((Vector3::zeros(), 0.0), |contact| (contact.force, contact.slip.norm()));
            let room = FRICTION * force[2] - force.xy().norm();
            let as_exact = match mode {
                0 => force == Vector3::zeros(),
                1 => slip < 1e-10 && room > 0.0,
                _ => room.abs() < 5e-7,
            };
            let name = step.name();
            assert!(as_exact, "{name}: corner {i}, mode {mode}: {force:?}, slip {slip:e}");
            let carries = found.is_some_and(|contact| contact.carries_force());
            assert_eq!(carries, *mode > 0, "{name}: corner {i}");
        }
    }
}

/// Checks a throw whose step 524 needs the natural map at all its sharpnesses. With 1, 1e3 and 1e6
/// alone the solver stalls at 3e-7 m/s.
#[test]
fn every_step_of_seed_715_is_solved() {
    let run = thrown_run(&cube_world(LIGHT), 715);
    let failed: Vec<_> = run.iter().filter(|step| step.status() == StepStatus::Failed).collect();
    assert!(failed.is_empty(), "step {}", failed[0].index);
}
