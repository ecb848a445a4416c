//! The problems with a closed-form answer, by both solvers, with the usual numbers and with
//! others; and that a solver of another law is found out.

use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};
use std::cell::Cell;
use tumble::error::Error;
use tumble::simulation::scene;
use tumble::solver::ipopt::{Formulation, IpoptSolver, Ladder, Rung};
use tumble::solver::native::NativeSolver;
use tumble::step::{Decision, Step, StepReport, StepSolver};
use tumble::validation::{
    self, Findings, Input, Inputs, Laboratory, PROBLEMS, Problem, Unsuitable,
};
use tumble::world::{ContactModel, Parameters};

fn native(model: &ContactModel) -> Result<Box<dyn StepSolver>, Error> {
    Ok(Box::new(NativeSolver::new(model)))
}

fn ipopt(model: &ContactModel) -> Result<Box<dyn StepSolver>, Error> {
    let options = IpoptSolver::options(model, scene::TOLERANCE, scene::MOST_ITERATIONS);
    let ipopt = IpoptSolver::new(model, Formulation::default(), options)?;
    Ok(Box::new(Ladder::new(model, ipopt, &Rung::ALL)))
}

fn assert_holds(problem: &dyn Problem, inputs: &Inputs, findings: &Findings) {
    for quantity in &findings.quantities {
        assert!(quantity.holds(), "{}: {quantity:?} with {inputs:?}", problem.name());
    }
    let curve = &findings.curve;
    assert!(curve.times.len() > 4, "{}", problem.name());
    assert_eq!(curve.times.len(), curve.measured.len());
    assert_eq!(curve.times.len(), curve.exact.len());
}

/// With the usual numbers, at h and at h/2; and where there is an error to speak of, it is
/// one of first order or better (0.8 leaves room for the next term of the expansion).
#[test]
fn the_native_solver_has_the_answers() {
    for problem in PROBLEMS {
        let inputs = problem.inputs();
        let [coarse, fine] = [1.0, 0.5].map(|part| {
            let mut laboratory = Laboratory::new(&native, part * inputs.time_step);
            let findings = problem.solve(&inputs, &mut laboratory).unwrap();
            assert_eq!((laboratory.failed, laboratory.fallback), (0, 0), "{}", problem.name());
            assert!(laboratory.worst_certificate < 1e-9, "{}", problem.name());
            assert_holds(problem, &inputs, &findings);
            findings
        });
        for (coarse, fine) in coarse.quantities.iter().zip(&fine.quantities) {
            let order = coarse.order(fine);
            assert!(order.is_none_or(|order| order > 0.8), "{coarse:?}: {order:?}");
        }
    }
}

/// The Ipopt path, at five times the step, which is five times fewer of its steps.
#[test]
fn ipopt_has_the_answers() {
    for problem in PROBLEMS {
        let inputs = problem.inputs();
        let mut laboratory = Laboratory::new(&ipopt, 5.0 * inputs.time_step);
        let findings = problem.solve(&inputs, &mut laboratory).unwrap();
        assert_eq!(laboratory.failed, 0, "{}", problem.name());
        assert_holds(problem, &inputs, &findings);
    }
}

/// A light box has small forces, of which Ipopt's tolerance is a larger part; its error has one
/// sign and adds up over the steps.
#[test]
fn ipopt_slides_light_boxes_as_well_as_its_certificates_say() {
    let problem = validation::find("slope-slide").unwrap();
    for (mass, time_step) in [(2.0, 0.02), (0.2, 0.02), (0.05, 0.01), (0.01, 0.01)] {
        let mut inputs = problem.inputs();
        inputs.set(Input::Mass, mass);
        let mut laboratory = Laboratory::new(&ipopt, time_step);
        let findings = problem.solve(&inputs, &mut laboratory).unwrap();
        assert_holds(problem, &inputs, &findings);
    }
}

/// Other masses, frictions, gravities, slopes and speeds. Inputs for which the closed form
/// is another motion's are refused, but not most of them.
#[test]
fn other_numbers_have_their_answers_too() {
    let numbers =
        (0.01..1e3_f64, 0.05..1.2_f64, 1.0..25.0_f64, 0.0..50.0_f64, 0.2..12.0_f64, 1e-3..4e-3_f64);
    for problem in PROBLEMS {
        let config =
            ProptestConfig { rng_seed: RngSeed::Fixed(6), cases: 60, ..Default::default() };
        let solved = Cell::new(0);
        TestRunner::new(config)
            .run(&numbers, |(mass, friction, gravity, slope, speed, h)| {
                let mut inputs = problem.inputs();
                // What the problem can be posed with at all, for most of the draws.
                let name = problem.name();
                let speed = if name == "rocking" { 0.3 + speed / 18.0 } else { speed };
                let mass = if name == "dragged-cube" { mass / 500.0 } else { mass };
                inputs.set(Input::Mass, mass);
                inputs.set(Input::Friction, friction);
                inputs.set(Input::Gravity, gravity);
                inputs.set(Input::Slope, slope);
                inputs.set(Input::Speed, speed);
                let h = h.min(inputs.time_step);
                match problem.solve(&inputs, &mut Laboratory::new(&native, h)) {
                    Ok(findings) => {
                        assert_holds(problem, &inputs, &findings);
                        solved.set(solved.get() + 1);
                    }
                    Err(Unsuitable::Motion(why)) => assert!(!why.is_empty()),
                    Err(error) => panic!("{}: {error}", problem.name()),
                }
                Ok(())
            })
            .unwrap();
        assert!(solved.get() >= 20, "{}: {} of 60", problem.name(), solved.get());
    }
}

/// A solver of a world with nine tenths of the friction.
struct Slippery(NativeSolver, ContactModel);

impl Slippery {
    fn make(model: &ContactModel) -> Result<Box<dyn StepSolver>, Error> {
        let friction = 0.9 * model.friction();
        let slippery = ContactModel::new(Parameters { friction, ..model.parameters().clone() })?;
        Ok(Box::new(Self(NativeSolver::new(&slippery), slippery)))
    }
}

impl StepSolver for Slippery {
    fn accepted_certificate(&self) -> f64 {
        // The simulation must not tell on it: the answers have to.
        f64::INFINITY
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        active: &mut [bool],
        solution: &mut Decision,
    ) -> Result<StepReport, Error> {
        self.0.solve(&Step { model: &self.1, ..*step }, active, solution)
    }
}

#[test]
fn a_solver_of_another_law_is_found_out() {
    for name in ["sliding-stop", "slope-slide", "spinning-box", "compass", "dragged-cube"] {
        let problem = validation::find(name).unwrap();
        let inputs = problem.inputs();
        let mut laboratory = Laboratory::new(&Slippery::make, inputs.time_step);
        let findings = problem.solve(&inputs, &mut laboratory).unwrap();
        // The certificate knows it as well: it does not believe the solver's model.
        assert!(laboratory.worst_certificate > 1e-4, "{name}: {}", laboratory.worst_certificate);
        let wrong = |findings: &Findings| {
            findings.quantities.iter().any(|quantity| {
                // Without what its own certificates excuse.
                quantity.error().abs() > quantity.discretisation + 1e-6
            })
        };
        assert!(wrong(&findings), "{name}: {findings:?}");
    }
}

#[test]
fn numbers_out_of_range_are_refused() {
    for problem in PROBLEMS {
        for (input, _) in problem.inputs().values() {
            for bad in [f64::NAN, -1.0, 1e9, f64::INFINITY] {
                let mut inputs = problem.inputs();
                inputs.set(*input, bad);
                let found = problem.solve(&inputs, &mut Laboratory::new(&native, inputs.time_step));
                assert!(found.is_err(), "{} {input:?} {bad}", problem.name());
            }
        }
    }
}
