//! Tests of batches of rollouts: many simulations of one scene, each with its own initial states,
//! inputs and constants.
//!
//! The reference is a loop over single simulations. A batch must have the same bits on any number
//! of threads.

mod driven;

use crate::common::prelude::*;
use crate::toss::*;
use allocation_counter::measure;
use std::num::NonZeroUsize;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use tumble::rollout::{
    Batch, Constant, RolloutError, RolloutOutputs, RolloutReport, RolloutTally, RolloutWatch,
    Varied, roll_out,
};

/// Number of steps of a rollout.
const T: usize = 150;

/// Native solver with its default settings, for one thread of a batch.
fn native_motion(world: &World) -> Result<Motion<'static>, Error> {
    Ok(Motion::native(world))
}

/// Batch without controls and with the constants of `world`. `starts` has one state per body, for
/// each rollout or for all of them.
fn batch<'a>(world: &'a World, starts: &'a [f64], rollouts: usize) -> Batch<'a> {
    Batch {
        world,
        motion: &native_motion,
        loads: &[],
        courses: &[],
        index: 0,
        rollouts,
        steps: T,
        starts,
        controls: &[],
        motors: &[],
        joint_forces: &[],
        parameters: &[],
    }
}

/// The 13 numbers of each state, one after another.
fn numbers<'a>(states: impl IntoIterator<Item = &'a State>) -> Vec<f64> {
    states.into_iter().flat_map(|state| state.to_vector().as_slice().to_vec()).collect()
}

/// Outputs of a batch.
#[derive(Debug, Clone, PartialEq)]
struct Out {
    states: Vec<f64>,
    forces: Vec<f64>,
    residuals: Vec<f64>,
    statuses: Vec<u8>,
    report: RolloutReport,
}

/// Runs the batch on `threads` threads with all outputs. Checks that the end states equal the last
/// states.
fn run(batch: &Batch<'_>, threads: usize) -> Result<Out, RolloutError> {
    let (rows, n) = (batch.rollouts * batch.steps, batch.world.bodies().len());
    let (mut states, mut forces) = (vec![0.0; rows * n * 13], vec![0.0; rows * n * 3]);
    let mut ends = vec![0.0; batch.rollouts * n * 13];
    let (mut residuals, mut statuses) = (vec![0.0; rows], vec![0; rows]);
    let outputs = RolloutOutputs {
        states: &mut states,
        ends: &mut ends,
        forces: &mut forces,
        residuals: &mut residuals,
        statuses: &mut statuses,
    };
    let threads = NonZeroUsize::new(threads).unwrap();
    let report = roll_out(batch, outputs, threads, RolloutWatch::default())?;
    let last = states.chunks(batch.steps * n * 13).flat_map(|run| &run[run.len() - n * 13..]);
    assert!(ends.iter().eq(last));
    Ok(Out { states, forces, residuals, statuses, report })
}

/// Outputs of a loop over the simulations, each with T steps. `push` is the wrench on the first
/// body in each rollout and step.
fn looped(simulations: Vec<Simulation<'static>>, push: impl Fn(usize, usize) -> Wrench) -> Out {
    let mut out = Out {
        states: Vec::new(),
        forces: Vec::new(),
        residuals: Vec::new(),
        statuses: Vec::new(),
        report: RolloutReport::default(),
    };
    let mut record = StepRecord::new();
    for (rollout, mut simulation) in simulations.into_iter().enumerate() {
        let mut tally = RolloutTally::default();
        for step in 0..T {
            simulation.set_wrench(0, push(rollout, step)).unwrap();
            simulation.step(&mut record).unwrap();
            out.states.extend(numbers(simulation.states()));
            for body in 0..simulation.states().len() {
                out.forces.extend(&record.first().solution.total_force(body));
            }
            let residual = record.residual();
            out.residuals.push(residual);
            let status = record.status();
            let place = StepStatus::ALL.iter().position(|known| *known == status).unwrap();
            out.statuses.push(place as u8);
            for tally in [&mut tally, &mut out.report.all] {
                tally.statuses[place] += 1;
                tally.tempered += u64::from(record.restitution_share() < 1.0);
                tally.largest_residual = tally.largest_residual.max(residual);
            }
        }
        out.report.each.push(tally);
    }
    out
}

/// Checks cubes that are thrown near the ground and pushed, each with its own friction,
/// restitution, mass, gravity and time step.
#[test]
fn a_batch_has_the_numbers_of_a_loop_on_any_number_of_threads() {
    const B: usize = 9;
    let world = cube_world(SOLID);
    let start = |seed: usize| State {
        position: Vector3::new(0.0, 0.0, 1.8),
        velocity: Vector3::new(1.0, 0.0, -3.0),
        ..thrown(seed as u32)
    };
    let starts: Vec<_> = (0..B).map(start).collect();
    let push = |rollout: usize, step: usize| Wrench {
        force: Vector3::new(rollout as f64, -(step as f64), 0.5),
        torque: Vector3::new(0.0, 3.0, rollout as f64),
    };
    let both = (0..B).flat_map(|b| (0..T).map(move |t| push(b, t)));
    let controls: Vec<f64> =
        both.flat_map(|w| w.force.iter().chain(&w.torque).copied().collect::<Vec<_>>()).collect();
    let friction: Vec<f64> = (0..B).map(|b| 0.1 * b as f64).collect();
    let mass: Vec<f64> = (0..B).map(|b| 8.0 + b as f64).collect();
    let restitution: Vec<f64> = (0..B).map(|b| 0.05 * b as f64).collect();
    let gravity: Vec<f64> = (0..B).flat_map(|b| [0.1 * b as f64, 0.0, -9.0]).collect();
    let time_step: Vec<f64> = (0..B).map(|b| 0.001 * (b + 1) as f64).collect();
    let parameters = [
        Varied { constant: Constant::Friction, values: &friction },
        Varied { constant: Constant::Restitution, values: &restitution },
        Varied { constant: Constant::Mass, values: &mass },
        Varied { constant: Constant::Gravity, values: &gravity },
        Varied { constant: Constant::TimeStep, values: &time_step },
    ];
    let start_numbers = numbers(&starts);
    let batch =
        Batch { controls: &controls, parameters: &parameters, ..batch(&world, &start_numbers, B) };
    let simulations = starts.iter().enumerate().map(|(b, start)| {
        let body = cube(Matrix3::from_diagonal_element(SOLID) * (mass[b] / 10.0));
        let body =
            RigidBody::from_pieces(mass[b], *body.inertia(), body.pieces().to_vec()).unwrap();
        let world = World::new(Parameters {
            bodies: vec![body],
            friction: friction[b],
            gravity: Vector3::from_column_slice(&gravity[3 * b..][..3]),
            time_step: time_step[b],
            ..world.parameters().clone()
        });
        native(
            &world.unwrap().with_coefficient(Coefficient::Restitution, restitution[b]).unwrap(),
            *start,
        )
    });
    let expected = looped(simulations.collect(), push);
    // 1 is the index of `Converged` in `StepStatus::ALL`: a solved step with contacts.
    let in_contact = expected.statuses.iter().filter(|status| **status == 1).count();
    assert!(in_contact > 200, "{in_contact} steps in contact");
    for threads in [1, 2, 3, 20] {
        assert_eq!(run(&batch, threads).unwrap(), expected, "{threads} threads");
    }
}

/// Checks two stacked boxes with a common start and common controls.
#[test]
fn several_bodies_share_starts_and_controls() {
    let body = |half: f64| RigidBody::solid_box(1.0, Vector3::repeat(half)).unwrap();
    let world =
        World::new(Parameters { bodies: vec![body(0.5), body(0.3)], ..parameters(body(1.0)) });
    let world = world.unwrap();
    let at = |z: f64| State::at_rest(Vector3::new(0.0, 0.0, z));
    let starts = [at(0.5), at(1.3)];
    let push = Wrench { force: Vector3::new(20.0, 0.0, 0.0), torque: Vector3::zeros() };
    let controls: Vec<f64> =
        (0..T).flat_map(|_| [[20.0, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0; 6]]).flatten().collect();
    let start_numbers = numbers(&starts);
    let batch = Batch { controls: &controls, ..batch(&world, &start_numbers, 3) };
    let simulation = || Simulation::new(world.clone(), starts, Motion::native(&world)).unwrap();
    let expected = looped((0..3).map(|_| simulation()).collect(), |_, _| push);
    assert_eq!(run(&batch, 2).unwrap(), expected);
    // The lower box is pulled away, and friction moves the upper one.
    let last = &expected.states[(T - 1) * 26..][..26];
    assert!(last[0] > last[13] && last[13] > 0.01, "{last:?}");
}

/// Solver that returns free flight, even into the ground.
struct Lazy;

impl StepSolver for Lazy {
    fn accepted_residual(&self) -> f64 {
        1e-9
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        solution.set_free(step.free);
        let none = |contact: &Contact| ContactForce::none(contact.key);
        solution.contacts.extend(candidates.contacts().iter().map(none));
        Ok(StepReport::without_problem(StepStatus::Converged))
    }
}

#[test]
fn steps_that_fail_are_listed_by_rollout_and_step() {
    let world = cube_world(SOLID);
    let start = |height: f64| State::at_rest(Vector3::new(0.0, 0.0, height));
    let starts = numbers(&[start(9.0), start(1.0), start(9.0), start(1.0)]);
    let lazy = |_: &World| Ok(Motion::contact(Lazy));
    let batch = Batch { motion: &lazy, steps: 2, ..batch(&world, &starts, 4) };
    for threads in [1, 4] {
        let report = run(&batch, threads).unwrap().report;
        let found: Vec<_> = report.unsolved.iter().map(|u| (u.rollout, u.step, u.status)).collect();
        let failed = StepStatus::Failed;
        assert_eq!(found, [(1, 0, failed), (1, 1, failed), (3, 0, failed), (3, 1, failed)]);
        // Falls from contact into the ground. The depth is g h² after the first step and g h² +
        // 2 g h² after the second. The residual is the depth over h.
        let residual = |index: usize| report.unsolved[index].residual / (9.81 * 0.002);
        assert!((residual(0) - 1.0).abs() < 1e-9 && (residual(1) - 3.0).abs() < 1e-9, "{report:?}");
        assert_eq!((report.steps(), report.all.largest_residual), (8, report.unsolved[1].residual));
    }
}

#[test]
fn arrays_of_wrong_length_and_invalid_rollouts_are_rejected_by_name() {
    let world = cube_world(SOLID);
    let start = numbers(&[thrown(0)]);
    let good = batch(&world, &start, 5);
    let refused = |batch: &Batch<'_>| run(batch, 3).unwrap_err().to_string();
    assert!(
        refused(&Batch { starts: &start[1..], ..good }).starts_with("numbers in the starts: 12")
    );
    assert!(refused(&Batch { controls: &start, ..good }).contains("(B or 1, T, N, 6)"));
    assert!(refused(&Batch { steps: 0, ..good }).starts_with("steps of a rollout: 0"));
    assert!(refused(&Batch { rollouts: 0, ..good }).starts_with("rollouts: 0"));
    let values = [0.1, 0.2, -0.3, 11.0, 0.5];
    let with = |values| [Varied { constant: Constant::Friction, values }];
    let parameters = with(&values[..4]);
    assert!(refused(&Batch { parameters: &parameters, ..good }).starts_with("friction: 4 given"));
    // The first of two wrong rollouts is reported, on any number of threads.
    let parameters = with(&values);
    let odd = Batch { parameters: &parameters, ..good };
    for threads in [1, 2, 5] {
        let error = run(&odd, threads).unwrap_err();
        assert_eq!(error.rollout, Some(2));
        let sentence = "rollout 2: coefficient of friction is -0.3; allowed: 0 to 10";
        assert_eq!(error.to_string(), sentence);
    }
    let mut states = [0.0; 12];
    let outputs = RolloutOutputs { states: &mut states, ..RolloutOutputs::default() };
    let error = roll_out(&good, outputs, NonZeroUsize::MIN, RolloutWatch::default()).unwrap_err();
    assert!(error.to_string().starts_with("numbers for states: 12 given"), "{error}");
}

/// Checks rollouts with varying size, radius and ground. Each must agree with a simulation of a
/// world made with these values.
#[test]
fn size_radius_and_ground_are_those_of_worlds_of_their_own() {
    let world = cube_world(SOLID);
    let start = State {
        position: Vector3::new(0.0, 0.0, 2.0),
        velocity: Vector3::new(1.0, 0.0, -5.0),
        ..thrown(3)
    };
    let (size, radius, ground) = ([1.0, 0.5, 0.8], [0.0, 0.05, 0.1], [0.0, 0.1, -0.2]);
    let parameters = [
        Varied { constant: Constant::Size, values: &size },
        Varied { constant: Constant::Radius, values: &radius },
        Varied { constant: Constant::Ground, values: &ground },
    ];
    let numbers = numbers(&[start]);
    let batch = Batch { parameters: &parameters, ..batch(&world, &numbers, 3) };
    let half = world.bodies()[0].contact_points().iter().map(|point| point.position.amax());
    let half = half.fold(0.0, f64::max);
    let simulations = (0..3).map(|b| {
        let inside = Vector3::repeat(size[b] * half - radius[b]);
        let core = Piece::cuboid(inside).unwrap();
        let piece = Piece::hull(core.core().vertices(), radius[b]).unwrap();
        let own = &world.bodies()[0];
        let body = RigidBody::from_pieces(own.mass(), *own.inertia(), vec![piece]).unwrap();
        let normal = *world.ground().unwrap().normal();
        let ground = Some(Plane::new(normal, ground[b]).unwrap());
        let parameters = world.parameters().clone();
        native(&World::new(Parameters { bodies: vec![body], ground, ..parameters }).unwrap(), start)
    });
    let expected = looped(simulations.collect(), |_, _| Wrench::zero());
    let found = run(&batch, 2).unwrap();
    assert_eq!(found.statuses, expected.statuses);
    // Not bit by bit: the corners of the pieces are products in another order.
    for (found, expected) in found.states.iter().zip(&expected.states) {
        assert!((found - expected).abs() < 1e-9, "{found}, {expected}");
    }
}

/// Checks that setting a constant to its current value changes nothing. A constant without effect
/// is refused.
#[test]
fn constants_are_read_as_they_are_set() {
    let world = cube_world(SOLID);
    for constant in Constant::ALL {
        let own = constant.values(&world);
        assert_eq!(own.len(), constant.width(&world), "{constant:?}");
        assert_eq!(Constant::from_name(constant.name()), Some(constant));
        let set = world.with_constants(&[(constant, &own)]).unwrap();
        assert_eq!(constant.values(&set), own, "{constant:?}");
        let number = constant.one_number(&world);
        for (a, b) in constant.from_one_number(&world, number).iter().zip(&own) {
            assert!((a - b).abs() <= 1e-15 * b.abs(), "{constant:?}: {a}, {b}");
        }
    }
    let refused = |world: &World, constant: Constant| {
        world.with_constants(&[(constant, &[0.5])]).unwrap_err().to_string()
    };
    let paired = world
        .clone()
        .with_coefficient_between(Coefficient::Friction, 0, Partner::Ground, 0.7)
        .unwrap();
    assert!(
        refused(&paired, Constant::Friction)
            .starts_with("friction: some pairs have their own coefficients")
    );
    assert!(paired.with_constants(&[(Constant::Restitution, &[0.5])]).is_ok());
    let paired = world
        .clone()
        .with_coefficient_between(Coefficient::Restitution, 0, Partner::Ground, 0.7)
        .unwrap();
    assert!(
        refused(&paired, Constant::Restitution)
            .starts_with("restitution: some pairs have their own coefficients")
    );
    let afloat = Parameters { ground: None, ..world.parameters().clone() };
    let afloat = World::new(afloat).unwrap();
    assert!(refused(&afloat, Constant::Ground).starts_with("ground: "));
    let wide = world.with_constants(&[(Constant::Radius, &[1.5])]).unwrap_err().to_string();
    assert!(wide.starts_with("radius (m) is 1.5"), "{wide}");
    let of = |pieces: &[Piece]| {
        let bodies = vec![RigidBody::solid(1.0, pieces).unwrap().0];
        World::new(Parameters { bodies, ..world.parameters().clone() }).unwrap()
    };
    let ball = Piece::sphere(0.1).unwrap();
    let beside = ball.moved_by(&Matrix3::identity(), &Vector3::x()).unwrap();
    let refusal = refused(&of(&[ball.clone(), beside]), Constant::Size);
    assert!(refusal.starts_with("size and radius: a body"), "{refusal}");
    // The radius of a ball has the factor of its size, and that of a cylinder does not exist.
    let smaller = of(&[ball]).with_constants(&[(Constant::Size, &[0.5])]).unwrap();
    assert_eq!(Constant::Radius.values(&smaller), [0.05]);
    let refusal = refused(&of(&[Piece::cylinder(0.1, 0.1, 24).unwrap()]), Constant::Radius);
    assert!(refusal.starts_with("radius: a cylinder"), "{refusal}");
}

#[test]
fn a_batch_ends_when_its_flag_is_raised_and_counts_its_steps() {
    let world = cube_world(SOLID);
    let start = numbers(&[thrown(0)]);
    let (flag, done) = (Arc::new(AtomicBool::new(false)), AtomicU64::new(0));
    let watch = RolloutWatch { interrupt: Some(&flag), done: Some(&done) };
    let two = NonZeroUsize::new(2).unwrap();
    roll_out(&batch(&world, &start, 4), RolloutOutputs::default(), two, watch).unwrap();
    assert_eq!(done.load(Ordering::Relaxed), 4 * T as u64);
    let endless = Batch { steps: 1_000_000_000, ..batch(&world, &start, 4) };
    let error = std::thread::scope(|scope| {
        scope.spawn(|| {
            while done.load(Ordering::Relaxed) < 10_000 {
                std::thread::yield_now();
            }
            flag.store(true, Ordering::Relaxed);
        });
        roll_out(&endless, RolloutOutputs::default(), two, watch).unwrap_err()
    });
    assert_eq!(error, RolloutError { rollout: None, error: Error::Interrupted });
}

/// Checks that steps do not allocate: ten times the steps need the same number of allocations.
#[test]
fn steps_of_a_rollout_allocate_nothing() {
    let world = cube_world(SOLID);
    let start = numbers(&[thrown(42)]);
    let count = |steps: usize| {
        let batch = Batch { steps, ..batch(&world, &start, 1) };
        let mut states = vec![0.0; steps * 13];
        let outputs = RolloutOutputs { states: &mut states, ..RolloutOutputs::default() };
        measure(|| {
            roll_out(&batch, outputs, NonZeroUsize::MIN, RolloutWatch::default()).unwrap();
        })
        .count_total
    };
    let (few, many) = (count(1000), count(10_000));
    assert_eq!(few, many);
}

/// States from their numbers, the inverse of [`numbers`].
fn batch_states(numbers: &[f64]) -> Vec<State> {
    let state = |numbers: &[f64]| {
        State::from_vector(&nalgebra::SVector::<f64, 13>::from_column_slice(numbers))
    };
    numbers.chunks_exact(13).map(state).collect()
}
