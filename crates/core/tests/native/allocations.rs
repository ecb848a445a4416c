//! Checks that steps of the native solver allocate no memory after warm-up. A step is warm if an
//! earlier one had at least as many contacts.

use crate::common::prelude::*;
use crate::toss::*;
use allocation_counter::measure;
use std::f64::consts::TAU;

/// Number of solutions that a simulation stores: the one being computed, the last one and two
/// earlier ones. A step reuses the memory of the fourth step before it.
const KEPT: usize = 4;

/// Checks complete runs: detection, solves and certificates. A step is warm if a step that wrote to
/// the same memory had at least as many contacts. Only the first few steps of a run are cold.
#[test]
fn a_whole_run_allocates_nothing() {
    let mut cold = 0;
    for body in cubes() {
        let world = World::new(parameters(body)).unwrap();
        for seed in [0, 1, 2, 3, 6, 42] {
            let mut simulation = native(&world, thrown(seed));
            let mut record = StepRecord::new();
            let mut most = [None; KEPT];
            for k in 0..999 {
                let seen = measure(|| simulation.step(&mut record).unwrap());
                let (count, most) = (record.first().contacts.len(), &mut most[k % KEPT]);
                if Some(count) <= *most {
                    assert_eq!(seen.count_total, 0, "seed {seed}, step {k}");
                } else {
                    *most = Some(count);
                    cold += 1;
                }
                assert_ne!(record.status(), StepStatus::Failed, "seed {seed}, step {k}");
            }
        }
    }
    assert!(cold <= 18 * 20, "{cold} steps of 18 runs were not warm");
}

/// Drops a coin with 200 points on its rims. In some steps Newton's method from the last step does
/// not converge, so that later stages run.
#[test]
fn a_step_that_needs_another_start_allocates_nothing() {
    let rim = |i: usize| {
        let (angle, side) = ((i / 2) as f64 * TAU / 100.0, (i % 2) as f64 - 0.5);
        Vector3::new(0.5 * angle.cos(), 0.5 * angle.sin(), 0.06 * side)
    };
    let points: Vec<_> = (0..200).map(rim).collect();
    let inertia = Matrix3::from_diagonal(&Vector3::new(0.0628, 0.0628, 0.125));
    let world = World::new(parameters(RigidBody::new(1.0, inertia, &points).unwrap())).unwrap();
    let start = State {
        position: Vector3::new(0.0, 0.0, 0.55),
        velocity: Vector3::new(0.3, 0.2, 0.0),
        spin: Vector3::new(3.0, 2.0, 1.0),
        ..thrown(0)
    };
    let mut simulation = native(&world, start);
    let mut record = StepRecord::new();
    let (mut retried, mut most) = (0, [None; KEPT]);
    for k in 0..1500 {
        let seen = measure(|| simulation.step(&mut record).unwrap());
        let (count, most) = (record.first().contacts.len(), &mut most[k % KEPT]);
        if Some(count) <= *most {
            assert_eq!(seen.count_total, 0, "step {k}");
            retried += u32::from(record.status() == StepStatus::Retried);
        } else {
            *most = Some(count);
        }
    }
    assert!(retried >= 3, "only {retried} steps needed another start");
}

/// Drops rods on rough ground, where full restitution would create energy. The solver then searches
/// for a smaller share of the restitution and solves islands again. After the first such step the
/// search allocates nothing.
#[test]
fn a_step_that_seeks_a_share_allocates_nothing() {
    let rod = RigidBody::solid_box(1.0, Vector3::new(0.02, 0.02, 0.5)).unwrap();
    let start = |place: usize| State {
        position: Vector3::new(0.0, 3.0 * place as f64, 0.45 + 0.3 * place as f64),
        attitude: Vector4::new(f64::cos(0.3), 0.0, f64::sin(0.3), 0.0),
        velocity: Vector3::new(1.5, 0.0, -2.0),
        spin: Vector3::new(0.0, 1.0, 0.0),
    };
    let bodies = vec![rod.clone(); 4];
    let parameters = Parameters { bodies, friction: 1.0, ..parameters(rod) };
    let world =
        World::new(parameters).unwrap().with_coefficient(Coefficient::Restitution, 1.0).unwrap();
    let motion = Motion::native(&world);
    let starts = (0..4).map(start);
    let mut simulation = Simulation::new(world.clone(), starts, motion).unwrap();
    let mut record = StepRecord::new();
    let (mut sought, mut most) = (0, [None; KEPT]);
    for k in 0..600 {
        let seen = measure(|| simulation.step(&mut record).unwrap());
        let (count, most) = (record.first().contacts.len(), &mut most[k % KEPT]);
        let seeks = record.restitution_share() < 1.0;
        if Some(count) > *most {
            *most = Some(count);
        } else if !seeks || sought > 0 {
            assert_eq!(seen.count_total, 0, "step {k}, share {}", record.restitution_share());
        }
        sought += u32::from(seeks);
    }
    assert!(sought > 1, "{sought} steps sought a share");
}

/// Drives a chain on a moving tray, with motor targets and forces set between the steps. Neither
/// the setters nor the steps allocate.
#[test]
fn driven_joints_allocate_nothing() {
    use tumble_core::joint::{Course, Drive, Joint, JointAxis, JointFrame, JointLoad, Motor};
    let frame = |x: f64| JointFrame::along(Vector3::x() * x, Vector3::y()).unwrap();
    let link = RigidBody::solid_box(1.0, Vector3::new(0.14, 0.04, 0.02)).unwrap();
    let tray = RigidBody::solid_box(5.0, Vector3::new(2.0, 1.0, 0.05)).unwrap();
    let hold = JointFrame::at(Vector3::zeros());
    let mut joints = vec![Joint::fixed(0, None, [hold; 2])];
    let drive = Drive { friction: 0.1, armature: 0.01, ..Drive::NONE };
    joints.extend(
        (2..5).map(|k| Joint::revolute(k, Some(k - 1), [frame(-0.15), frame(0.15)], drive)),
    );
    let mut bodies = vec![tray];
    bodies.extend((1..5).map(|_| link.clone()));
    let parameters = Parameters { bodies, ground: None, friction: 0.5, ..parameters(link) };
    let world = World::new(parameters).unwrap().with_joints(joints).unwrap();
    let at = |position: Vector3<f64>| State {
        attitude: Vector4::new(1.0, 0.0, 0.0, 0.0),
        ..State::at_rest(position)
    };
    let links = (0..4).map(|k| at(Vector3::new(0.3 * f64::from(k) - 0.5, 0.0, 0.07)));
    let states = std::iter::once(at(Vector3::zeros())).chain(links);
    let motion = Motion::native(&world);
    let mut simulation = Simulation::new(world.clone(), states, motion).unwrap();
    let line = Polyline::new(vec![(0.0, Vector3::zeros()), (0.5, Vector3::z() * 0.3)]);
    let load = JointLoad { torque: line.unwrap(), ..JointLoad::default() };
    simulation.set_joint_load(2, load).unwrap();
    let mut record = StepRecord::new();
    let mut most = [None; KEPT];
    let mut warm = 0;
    for k in 0..600 {
        let t = 1e-3 * k as f64;
        let seen = measure(|| {
            let velocity = Vector3::x() * (0.3 * (5.0 * t).sin());
            let spin = Vector3::z() * 0.2;
            simulation.set_course(0, Course::Steady { velocity, spin }).unwrap();
            let motor = Motor::Speed { target: (9.0 * t).sin(), max_force: 1.0 };
            simulation.set_motor(1, JointAxis::Angular(2), Some(motor)).unwrap();
            simulation.step(&mut record).unwrap();
        });
        assert!(record.residual() < 1e-9, "{k}: {:?}", record.certificate());
        // After 100 steps the broad phase has seen all pairs and its memory has reached its full
        // size.
        let (count, most) = (record.first().contacts.len(), &mut most[k % KEPT]);
        if k >= 100 && Some(count) <= *most {
            warm += 1;
            assert_eq!(seen.count_total, 0, "step {k}");
        }
        *most = (*most).max(Some(count));
    }
    assert!(warm > 400, "{warm}");
}

/// Checks a step without a solution, which runs through all stages. No iteration can converge if
/// the wrench is NaN.
#[test]
fn a_step_that_fails_allocates_nothing() {
    let world = cube_world(LIGHT);
    let run = thrown_run(&world, 1);
    let record = run.iter().find(|step| step.status() != StepStatus::Free).unwrap();
    let none = Wrench::zero();
    let states = record.states();
    let free = &[world.free_flight(0, &states[0], &none)];
    let previous = &StepSolution::free(states);
    let mut candidates = Candidates::from(record.first().contacts.clone());
    let mut solution = StepSolution::default();
    let mut solver = NativeSolver::new(&world);
    let mut solve = |wrench: &Wrench| {
        let (world, wrenches) = (&world, &[*wrench]);
        let (earlier, interrupt) = (None, None);
        let step = Step { world, states, wrenches, free, previous, earlier, interrupt };
        solver.solve(&step, &mut candidates, &mut solution).unwrap().status
    };
    assert_ne!(solve(&none), StepStatus::Failed);
    let mut status = StepStatus::End;
    let no_number = Wrench { torque: Vector3::repeat(f64::NAN), ..none };
    let seen = measure(|| status = solve(&no_number));
    assert_eq!((status, seen.count_total), (StepStatus::Failed, 0));
}

/// Solves resting cubes on two threads, each cube an island. The counter counts the calling thread
/// only. The worker threads allocate the memory of their islands. After that the queue of the
/// threads allocates one block for every 63 calls, and nothing else allocates.
#[test]
fn on_threads_only_their_queue_allocates() {
    let bodies: Vec<_> = cubes().into_iter().cycle().take(150).collect();
    let place = |place: usize| State {
        attitude: Vector4::new(1.0, 0.0, 0.0, 0.0),
        ..State::at_rest(Vector3::new(5.0 * place as f64, 0.0, 1.0))
    };
    let starts: Vec<_> = (0..bodies.len()).map(place).collect();
    let some = parameters(bodies[0].clone());
    let world = World::new(Parameters { bodies, ..some }).unwrap();
    let [alone, together] = [1, 2].map(|threads| {
        let threads = std::num::NonZeroUsize::new(threads).unwrap();
        let solver = NativeSolver::new(&world).with_threads(threads).unwrap();
        let motion = Motion::contact(solver);
        let starts = starts.iter().copied();
        let mut simulation = Simulation::new(world.clone(), starts, motion).unwrap();
        let mut record = StepRecord::new();
        let mut steps = |count: usize| {
            measure(|| (0..count).for_each(|_| simulation.step(&mut record).unwrap())).count_total
        };
        let cold = steps(10);
        (cold, steps(630))
    });
    assert_eq!(alone.1, 0, "{alone:?}");
    assert!(together.1 <= 11, "{together:?}");
    assert!(together.0 < alone.0 / 2, "{together:?} of {alone:?}");
}

/// Checks the counter itself: making a solver allocates.
#[test]
fn making_a_solver_is_seen_to_allocate() {
    let world = cube_world(SOLID);
    let seen = measure(|| drop(NativeSolver::new(&world)));
    assert!(seen.count_total > 0 && seen.count_current == 0, "{seen:?}");
}
