//! Steps taken back and repeated, by the same solver or another one, and records of another
//! model.

mod common;
mod toss;

use nalgebra::{Matrix3, Vector3};
use toss::*;
use tumble::mechanics::body::RigidBody;
use tumble::simulation::{Motion, StepRecord};
use tumble::step::StepStatus;
use tumble::world::ContactModel;

/// The start of the repeated step is that of the step, too: the same doubles.
#[test]
fn a_step_taken_back_and_repeated_is_the_same_step() {
    let model = cube_model(SOLID);
    let mut simulation = native(&model, thrown(42));
    let mut first = simulation.record();
    let mut again = simulation.record();
    let mut contact = 0;
    for _ in 0..600 {
        simulation.step(&mut first).unwrap();
        simulation.take_back(&first);
        assert_eq!(simulation.state(), first.state);
        assert_eq!(simulation.index(), first.index);
        simulation.step(&mut again).unwrap();
        assert_eq!(again, first);
        contact += u32::from(first.report.status != StepStatus::Free);
    }
    assert!(contact > 100, "{contact}");
    assert_eq!(native_run(&model, thrown(42), 600).last(), Some(&again));
}

#[test]
fn only_the_last_step_can_be_taken_back() {
    let model = cube_model(SOLID);
    let mut simulation = native(&model, thrown(42));
    let mut first = simulation.record();
    simulation.step(&mut first).unwrap();
    let mut second = simulation.record();
    simulation.step(&mut second).unwrap();
    let state = simulation.state();
    simulation.take_back(&first);
    assert_eq!((simulation.index(), simulation.state()), (2, state));
    simulation.take_back(&second);
    simulation.take_back(&second);
    simulation.take_back(&first);
    assert_eq!((simulation.index(), simulation.state()), (1, second.state));
}

#[test]
fn a_motion_swapped_in_takes_the_next_steps() {
    let model = cube_model(SOLID);
    let mut simulation = native(&model, thrown(42));
    let mut floating = Motion::Floating;
    let mut record = simulation.record();
    while record.state.position.z > 0.2 && simulation.index() < 400 {
        simulation.swap_motion(&mut floating);
        simulation.step(&mut record).unwrap();
        assert_eq!(record.report.status, StepStatus::Free);
        simulation.swap_motion(&mut floating);
    }
    // Without the ground the cube fell into it; the contact's motion pushes it out.
    assert!(model.lowest_height(&simulation.state()) < -0.5);
    simulation.step(&mut record).unwrap();
    assert_ne!(record.report.status, StepStatus::Free);
}

#[test]
fn a_record_of_another_model_is_made_anew() {
    let start = thrown(42);
    let point = &[Vector3::new(0.1, 0.0, 0.0)];
    let pendulum = RigidBody::new(1.0, Matrix3::identity(), point).unwrap();
    let model = ContactModel::new(parameters(pendulum)).unwrap();
    let mut simulation = native(&model, start);
    let mut record = StepRecord::new(&start, 8);
    simulation.step(&mut record).unwrap();
    assert_eq!((record.active.len(), record.solution.layout().contacts()), (1, 1));
}
