//! Validation problems with closed-form solutions, solved by Ipopt.

use crate::inputs::{Input, TestInputs};
use crate::problems::PROBLEMS;
use crate::runner::Runner;
use crate::{TestProblem, find};
use tumble::solver::ipopt::{IpoptSolver, MOST_ITERATIONS, TOLERANCE, ladder_for};
use tumble::step_nlp::SMOOTHING;
use tumble_core::error::Error;
use tumble_core::step::StepSolver;
use tumble_core::world::World;

fn ipopt(world: &World) -> Result<Box<dyn StepSolver>, Error> {
    let options = IpoptSolver::options(TOLERANCE, MOST_ITERATIONS);
    ladder_for(world, options)
}

/// Solves `problem` with the given time step (s) and checks every step and every quantity. Returns
/// false if the program or the closed form does not support it.
fn holds(problem: &TestProblem, inputs: &TestInputs, time_step: f64) -> bool {
    let mut runner = Runner::new(&ipopt, time_step).smoothed(SMOOTHING);
    let Ok(findings) = problem.solve(inputs, &mut runner) else { return false };
    assert_eq!(runner.counts.failed, 0, "{}", problem.name);
    for quantity in &findings {
        assert!(quantity.holds(), "{}: {quantity:?} with {inputs:?}", problem.name);
    }
    true
}

/// Every problem that Ipopt can solve, with five times its usual time step to take a fifth of the
/// steps.
#[test]
#[ignore = "slow"]
fn ipopt_passes_all_validation_problems() {
    let solved = PROBLEMS.iter().filter(|problem| {
        let inputs = problem.inputs();
        holds(problem, &inputs, 5.0 * inputs.time_step)
    });
    assert_eq!(solved.count(), SUITABLE);
}

/// Number of problems of one body of points on the ground, without restitution.
const SUITABLE: usize = 12;

/// Ipopt's absolute tolerance is a larger part of the small contact forces of a light box. The
/// resulting error has one sign and accumulates over the steps.
#[test]
fn ipopt_slides_light_boxes_within_the_tolerance() {
    let problem = find("slope-slide").unwrap();
    for (mass, time_step) in [(2.0, 0.02), (0.2, 0.02), (0.05, 0.01), (0.01, 0.01)] {
        let mut inputs = problem.inputs();
        inputs.set(Input::Mass, mass);
        assert!(holds(problem, &inputs, time_step));
    }
}
