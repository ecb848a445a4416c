//! Steps that are solved and no physics: they are told from the others.

mod common;
mod toss;

use nalgebra::{Matrix3, Vector3, Vector4};
use toss::*;
use tumble::mechanics::{RigidBody, State};
use tumble::simulation::{Motion, Simulation, StepRecord};
use tumble::step::StepStatus;
use tumble::world::{Parameters, World};

/// ½ m v² + ½ ωᵀ I ω − m g·r, J.
fn energy(world: &World, state: &State) -> f64 {
    let body = &world.bodies()[0];
    let spinning = state.spin.dot(&(body.inertia() * state.spin));
    let moving = body.mass() * state.velocity.norm_squared();
    0.5 * (moving + spinning) - body.mass() * world.gravity().dot(&state.position)
}

/// The records of a native run of a body.
fn run(world: &World, start: State, steps: usize) -> Vec<StepRecord> {
    let mut simulation = Simulation::new(world.clone(), [start], Motion::native(world)).unwrap();
    let mut step = || {
        let mut record = StepRecord::new();
        simulation.step(&mut record).unwrap();
        record
    };
    (0..steps).map(|_| step()).collect()
}

/// A cube that spins on ice by 20 rad/s turns by 2 rad in a step of 0.1 s, as far as the step's
/// impulses know: they act on a motion that the turn has long left behind. The same cube is no
/// trouble at a hundredth of the step.
#[test]
fn a_step_that_is_too_long_for_a_body_is_marked() {
    let body = RigidBody::solid_box(1.0, Vector3::repeat(0.5)).unwrap();
    let world = |time_step| {
        let bodies = vec![body.clone()];
        World::new(Parameters { bodies, time_step, friction: 0.0, ..parameters(body.clone()) })
            .unwrap()
    };
    let mut start = thrown(3);
    start.position = Vector3::new(0.0, 0.0, 0.5);
    start.attitude = Vector4::new(1.0, 0.0, 0.0, 0.0);
    start.velocity = Vector3::zeros();
    start.spin = Vector3::new(0.0, 0.0, 20.0);
    let marked = |time_step| {
        let records = run(&world(time_step), start, 200);
        records.iter().filter(|record| record.report.status == StepStatus::Wild).count()
    };
    assert!(marked(0.1) > 0);
    assert_eq!(marked(0.001), 0);
}

/// A step of the tutorial's scene never makes energy, and none is marked; of light bodies with few
/// points some steps do, and every one that makes more than a hundredth of the motion's energy says
/// so.
#[test]
fn no_solved_step_makes_energy_unmarked() {
    let needle = |count: usize| {
        let points: Vec<_> = (0..count)
            .map(|i| {
                let angle = i as f64 * 2.4;
                Vector3::new(angle.cos(), angle.sin(), 0.3 * i as f64 - 0.5)
            })
            .collect();
        RigidBody::new(1.0, Matrix3::from_diagonal_element(1e-3), &points).unwrap()
    };
    let mut wild = 0;
    for (body, quiet) in [(needle(1), false), (needle(2), false), (needle(3), false)]
        .into_iter()
        .chain(cubes().into_iter().map(|body| (body, true)))
    {
        let parameters = Parameters { time_step: 0.01, friction: 1.0, ..parameters(body.clone()) };
        let parameters = if quiet { self::parameters(body) } else { parameters };
        let world = World::new(parameters).unwrap();
        for seed in 0..10 {
            for record in run(&world, thrown(seed), 500) {
                let (before, after) = (record.state(), record.next());
                let gained = energy(&world, after) - energy(&world, before);
                let body = &world.bodies()[0];
                let moving = body.mass() * after.velocity.norm_squared()
                    + after.spin.dot(&(body.inertia() * after.spin));
                let status = record.report.status;
                let marked = [StepStatus::Wild, StepStatus::Failed].contains(&status);
                assert!(
                    gained <= 0.005 * moving + 1e-8 || marked,
                    "{seed}: {gained} of {moving} J"
                );
                assert!(!quiet || !marked, "{seed}: {status}");
                wild += u32::from(marked);
            }
        }
    }
    assert!(wild > 0, "no step of the needles was wild");
}
