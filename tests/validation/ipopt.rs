//! Validation problems with closed-form solutions, solved by Ipopt.

use crate::inputs::{Input, TestInputs};
use crate::problems::PROBLEMS;
use crate::runner::Runner;
use crate::{TestProblem, find};
use tumble::solver::ipopt::{
    Formulation, IpoptSolver, MOST_BODIES, MOST_ITERATIONS, TOLERANCE, ladder_for,
};
use tumble::step_nlp::SMOOTHING;
use tumble_core::error::Error;
use tumble_core::step::StepSolver;
use tumble_core::world::World;

fn ipopt(world: &World) -> Result<Box<dyn StepSolver>, Error> {
    let options = IpoptSolver::options(TOLERANCE, MOST_ITERATIONS);
    ladder_for(world, Formulation::default(), options)
}

/// Solves `problem` with the given time step (s) and checks every step and every quantity.
fn assert_holds(problem: &TestProblem, inputs: &TestInputs, time_step: f64) {
    let mut runner = Runner::new(&ipopt, time_step).smoothed(SMOOTHING);
    let findings = problem.solve(inputs, &mut runner).unwrap();
    assert_eq!(runner.counts.failed, 0, "{}", problem.name);
    for quantity in &findings {
        assert!(quantity.holds(), "{}: {quantity:?} with {inputs:?}", problem.name);
    }
}

/// Every problem that Ipopt can solve, with five times its usual time step to take a fifth of the
/// steps.
#[test]
#[ignore = "slow"]
fn ipopt_has_the_answers() {
    let takes = |problem: &&TestProblem| !problem.native_only && problem.bodies <= MOST_BODIES;
    assert!(PROBLEMS.iter().filter(takes).filter(|problem| problem.bodies > 1).count() >= 6);
    for problem in PROBLEMS.iter().filter(takes) {
        let inputs = problem.inputs();
        assert_holds(problem, &inputs, 5.0 * inputs.time_step);
    }
}

/// Ipopt's absolute tolerance is a larger part of the small contact forces of a light box. The
/// resulting error has one sign and accumulates over the steps.
#[test]
fn ipopt_slides_light_boxes_within_the_tolerance() {
    let problem = find("slope-slide").unwrap();
    for (mass, time_step) in [(2.0, 0.02), (0.2, 0.02), (0.05, 0.01), (0.01, 0.01)] {
        let mut inputs = problem.inputs();
        inputs.set(Input::Mass, mass);
        assert_holds(problem, &inputs, time_step);
    }
}
