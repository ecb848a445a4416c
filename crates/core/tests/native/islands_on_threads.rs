//! Islands solved in parallel: the same numbers, reports and errors on any number of threads.

use crate::common::prelude::*;
use std::num::NonZeroUsize;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

const THREADS: [usize; 3] = [2, 3, 8];

fn solver(world: &World, threads: usize) -> NativeSolver {
    let threads = NonZeroUsize::new(threads).unwrap();
    NativeSolver::new(world).with_threads(threads).unwrap()
}

fn simulation(world: &World, starts: &[State], threads: usize) -> Simulation<'static> {
    let motion = Motion::contact(solver(world, threads));
    Simulation::new(world.clone(), starts.iter().copied(), motion).unwrap()
}

fn world(bodies: Vec<RigidBody>) -> World {
    let gravity = Vector3::new(0.0, 0.0, -9.81);
    let (ground, friction, time_step) = (Plane::level(), 0.5, 0.002);
    euler(Parameters {
        ground: Some(ground),
        gravity,
        friction,
        time_step,
        ..Parameters::new(bodies)
    })
}

/// World with `heaps` piles of five falling boxes, and as many single boxes that are thrown.
fn heaps_and_singles(heaps: usize) -> (World, Vec<State>) {
    let mut draws = Draws::new(7);
    let (mut bodies, mut starts) = (Vec::new(), Vec::new());
    for place in 0..heaps {
        for layer in 0..6 {
            let alone = layer == 5;
            let mut side = || 0.1 + 0.1 * draws.unit();
            let half_sides = Vector3::new(side(), side(), side());
            bodies.push(RigidBody::solid_box(1.0, half_sides).unwrap());
            let (y, z) = if alone { (2.0, 0.4) } else { (0.0, 0.4 + 0.7 * f64::from(layer)) };
            let thrown = if alone { 1.0 } else { 0.0 };
            starts.push(State {
                position: Vector3::new(2.0 * place as f64, y, z),
                attitude: draws.attitude(),
                velocity: Vector3::new(0.5, 1.0, 0.0) * thrown,
                spin: Vector3::new(4.0, 2.0, 5.0) * thrown,
            });
        }
    }
    (world(bodies), starts)
}

/// All numbers of a solution as bits.
fn bits(solution: &StepSolution) -> Vec<u64> {
    let states = solution.states.iter().flat_map(|state| state.to_vector().data.0[0]);
    let forces = solution.contacts.iter().flat_map(|contact| {
        let numbers = contact.force.iter().chain(&contact.slip).copied();
        numbers.chain([contact.normal_force]).collect::<Vec<_>>()
    });
    states.chain(forces).map(f64::to_bits).collect()
}

/// Number of islands with several bodies, and number of islands with one body.
fn count_islands(record: &StepRecord) -> (usize, usize) {
    let mut first: Vec<usize> = (0..record.states().len()).collect();
    let mut touches = vec![false; first.len()];
    for contact in &record.first().contacts {
        let a = first[contact.key.body];
        touches[contact.key.body] = true;
        if let Partner::Body(b) = contact.key.partner {
            let b = first[b];
            first.iter_mut().filter(|label| **label == b).for_each(|label| *label = a);
        }
    }
    let size = |label| first.iter().filter(|of| **of == label).count();
    let mut labels: Vec<_> = (0..first.len()).filter(|b| touches[*b]).map(|b| first[b]).collect();
    labels.sort_unstable();
    labels.dedup();
    let several = labels.iter().filter(|label| size(**label) > 1).count();
    (several, labels.len() - several)
}

/// Compares runs bit for bit, with contacts, status, stage, iterations and certificate. The runs
/// have impacts, piles that merge and separate, and rest.
#[test]
#[ignore = "slow"]
fn a_run_is_the_same_on_any_number_of_threads() {
    let (world, starts) = heaps_and_singles(10);
    let mut alone = Simulation::new(world.clone(), starts.clone(), Motion::native(&world)).unwrap();
    let mut runs = THREADS.map(|threads| (threads, simulation(&world, &starts, threads)));
    let (mut expected, mut found) = (StepRecord::new(), StepRecord::new());
    let (mut mixed, mut retried) = (0, 0);
    for k in 0..700 {
        alone.step(&mut expected).unwrap();
        for (threads, run) in &mut runs {
            run.step(&mut found).unwrap();
            let same = bits(&found.first().solution) == bits(&expected.first().solution)
                && found == expected;
            assert!(
                same,
                "k = {k}, {threads} threads: {:?} {:?}",
                found.report(),
                expected.report()
            );
        }
        let (several, single) = count_islands(&expected);
        mixed += usize::from(several >= 4 && single >= 4 && expected.first().contacts.len() >= 64);
        retried += usize::from(expected.status() == StepStatus::Retried);
    }
    assert!(mixed > 200, "{mixed} steps of at least four islands of each kind");
    assert!(retried > 0, "no step needed another start");
}

/// Checks that copies of a solver share its threads and work independently, on any thread.
#[test]
fn copies_of_a_solver_share_its_threads() {
    let (world, starts) = heaps_and_singles(6);
    let last = |motion: Motion<'static>| {
        let mut run = Simulation::new(world.clone(), starts.clone(), motion).unwrap();
        let mut record = StepRecord::new();
        (0..300).for_each(|_| run.step(&mut record).unwrap());
        bits(&record.first().solution)
    };
    let expected = last(Motion::native(&world));
    let solver = solver(&world, 3);
    let found = std::thread::scope(|scope| {
        let work = || last(Motion::contact(solver.clone()));
        let together = [0; 4].map(|_| scope.spawn(work));
        together.map(|thread| thread.join().unwrap())
    });
    assert!(found.iter().all(|found| *found == expected));
}

/// Solves the step of `record` again. The torque on the body `absurd` is NaN.
fn solve_again(
    world: &World,
    record: &StepRecord,
    absurd: Option<usize>,
    solver: &mut NativeSolver,
    interrupt: Option<&AtomicBool>,
) -> Result<(StepReport, Vec<u64>), Error> {
    let states = record.states();
    let none = Wrench::zero();
    let mut wrenches = vec![none; states.len()];
    let free: Vec<_> =
        states.iter().enumerate().map(|(i, s)| world.free_flight(i, s, &none)).collect();
    if let Some(body) = absurd {
        wrenches[body].torque = Vector3::repeat(f64::NAN);
    }
    let previous = &StepSolution::free(states);
    let (wrenches, free, earlier) = (&wrenches[..], &free[..], None);
    let step = Step { world, states, wrenches, free, previous, earlier, interrupt };
    let mut candidates = Candidates::new();
    assert!(candidates.find(Detection::default(), world, states, free));
    let mut solution = StepSolution::default();
    let report = solver.solve(&step, &mut candidates, &mut solution)?;
    assert_eq!(solution.contacts.len(), candidates.contacts().len());
    Ok((report, bits(&solution)))
}

/// Record of a step in which many islands have contacts.
fn busy_step(world: &World, starts: &[State]) -> StepRecord {
    let mut run = simulation(world, starts, 1);
    let mut record = StepRecord::new();
    (0..350).for_each(|_| run.step(&mut record).unwrap());
    let (several, single) = count_islands(&record);
    assert!(several >= 5 && single >= 5, "{several} {single}");
    // Enough contacts for the solver to use its threads.
    assert!(record.first().contacts.len() >= 64, "{}", record.first().contacts.len());
    record
}

/// Checks a step in which one island has a NaN torque and cannot converge. The step has failed. It
/// contains the best point of that island and the solutions of all others, for every choice of the
/// island.
#[test]
fn an_island_that_fails_is_reported_the_same() {
    let (world, starts) = heaps_and_singles(10);
    let record = busy_step(&world, &starts);
    let solve = |absurd, threads| {
        solve_again(&world, &record, absurd, &mut solver(&world, threads), None).unwrap()
    };
    let touched = record.first().contacts.iter().map(|contact| contact.key.body);
    let (first, last) = (touched.clone().min().unwrap(), touched.max().unwrap());
    for absurd in [None, Some(first), Some(last)] {
        let expected = solve(absurd, 1);
        let failed = expected.0.status == StepStatus::Failed;
        assert_eq!(failed, absurd.is_some(), "{absurd:?}: {:?}", expected.0);
        for threads in THREADS {
            assert_eq!(solve(absurd, threads), expected, "{absurd:?}, {threads} threads");
        }
    }
}

/// Checks that a raised flag ends the step with an error. The same solver then finds what a new one
/// finds.
#[test]
fn an_interrupted_step_is_an_error_and_leaves_no_trace() {
    let (world, starts) = heaps_and_singles(10);
    let record = busy_step(&world, &starts);
    let expected = solve_again(&world, &record, None, &mut solver(&world, 1), None);
    for threads in [1, 2, 8] {
        let mut solver = solver(&world, threads);
        let flag = AtomicBool::new(true);
        let end = solve_again(&world, &record, None, &mut solver, Some(&flag));
        assert_eq!(end, Err(Error::Interrupted), "{threads} threads");
        flag.store(false, Ordering::Relaxed);
        let again = solve_again(&world, &record, None, &mut solver, Some(&flag));
        assert_eq!(again, expected, "{threads} threads");
    }
}

/// Interrupts a run of sliding plates with 31² contact points each. No step that begins after the
/// interrupt is taken, and the interrupted step leaves no trace.
#[test]
fn an_interrupt_ends_the_steps_of_islands() {
    let (side, plates) = (31, 4);
    let at = |i: usize| i as f64 / (side - 1) as f64 - 0.5;
    let grid = (0..side * side).map(|k| Vector3::new(at(k % side), at(k / side), -0.1));
    let points: Vec<_> = grid.collect();
    let inertia = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 1.6));
    let world = world(vec![RigidBody::new(10.0, inertia, &points).unwrap(); plates]);
    let starts: Vec<_> = (0..plates)
        .map(|place| State {
            velocity: Vector3::new(1.0, 0.2, 0.0),
            spin: Vector3::new(0.0, 0.0, 0.5),
            ..State::at_rest(Vector3::new(3.0 * place as f64, 0.0, 0.1))
        })
        .collect();
    let (mut simulation, mut record) = (simulation(&world, &starts, 2), StepRecord::new());
    let flag = Arc::new(AtomicBool::new(false));
    simulation.interrupt_by(Arc::clone(&flag));
    simulation.step(&mut record).unwrap();
    let mut last = record.next_states().to_vec();
    let end = std::thread::scope(|scope| {
        scope.spawn(|| flag.store(true, Ordering::Relaxed));
        loop {
            let is_raised = flag.load(Ordering::Relaxed);
            match simulation.step(&mut record) {
                Ok(()) => {
                    assert!(!is_raised, "step {} was taken", record.index);
                    last = record.next_states().to_vec();
                }
                Err(error) => break error,
            }
        }
    });
    assert_eq!(end, Error::Interrupted);
    assert_eq!(simulation.states(), last);
    assert_eq!(record, StepRecord::new());
}

#[test]
fn too_many_threads_are_refused() {
    let (world, _) = heaps_and_singles(1);
    let error = NativeSolver::new(&world).with_threads(NonZeroUsize::new(1025).unwrap());
    assert_eq!(error.unwrap_err().to_string(), "threads: 1025 given; allowed: 1 to 1024");
}
