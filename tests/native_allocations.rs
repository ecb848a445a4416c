//! The native solver's steps allocate nothing once everything is constructed.

mod common;
mod toss;

use allocation_counter::measure;
use nalgebra::Vector3;
use toss::*;
use tumble::mechanics::state::Wrench;
use tumble::simulation::StepRecord;
use tumble::solver::native::NativeSolver;
use tumble::step::{Decision, Step, StepSolver, StepStatus};
use tumble::world::ContactModel;

/// Whole runs, flags, solves and certificates. The seeds 1, 2 and 6 hold the hard steps, in
/// which Newton's method does not get there from the step before.
#[test]
fn a_whole_run_allocates_nothing() {
    let mut retried = 0;
    for body in cubes() {
        let model = ContactModel::new(parameters(body)).unwrap();
        for seed in [0, 1, 2, 3, 6, 42] {
            let mut simulation = native(&model, thrown(seed));
            let mut record = StepRecord::new(&thrown(seed), model.contact_count());
            for k in 0..999 {
                let seen = measure(|| simulation.step(&mut record).unwrap());
                assert_eq!(seen.count_total, 0, "seed {seed}, step {k}");
                assert_ne!(record.report.status, StepStatus::Failed, "seed {seed}, step {k}");
                retried += u32::from(record.report.status == StepStatus::Retried);
            }
        }
    }
    assert!(retried >= 3, "only {retried} steps needed another start");
}

/// A step that has no solution goes through every start there is. In a step whose wrench is
/// not a number no iteration can converge.
#[test]
fn a_step_that_fails_allocates_nothing() {
    let model = cube_model(LIGHT);
    let run = thrown_run(&model, 1);
    let record = run.iter().find(|step| step.report.status != StepStatus::Free).unwrap();
    let wrench = Wrench { torque: Vector3::repeat(f64::NAN), ..Wrench::zero() };
    let state = &record.state;
    let free = &model.free_flight(state, &Wrench::zero());
    let previous = &Decision::at_rest_in(state, 8);
    let step = Step { model: &model, state, wrench: &wrench, free, previous };
    let (mut active, mut solution) = (record.active.clone(), previous.clone());
    let mut solver = NativeSolver::new(&model);
    let mut status = StepStatus::End;
    let seen = measure(|| status = solver.solve(&step, &mut active, &mut solution).unwrap().status);
    assert_eq!((status, seen.count_total), (StepStatus::Failed, 0));
}

/// The counter counts: making a solver allocates.
#[test]
fn making_a_solver_is_seen_to_allocate() {
    let model = cube_model(SOLID);
    let seen = measure(|| drop(NativeSolver::new(&model)));
    assert!(seen.count_total > 0 && seen.count_current == 0, "{seen:?}");
}
