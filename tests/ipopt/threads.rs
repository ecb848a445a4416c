//! Simulations on many threads, with Ipopt and with the native solver: the same doubles as on one
//! thread.

use crate::common::prelude::*;
use crate::toss::*;
use std::thread;
use tumble::solver::ipopt::{IpoptSolver, Ladder, Rung};
use tumble_core::contact::ContactKey;

const THREADS: usize = 8;
/// Number of steps with Ipopt: from shortly before the first touch until well into the contact.
const STEPS: usize = 60;

/// Run of a thrown cube, from ten steps before it touches the ground, with its seed.
#[derive(Debug, Clone, Copy)]
enum Job {
    Ladder(u32),
    Native(u32),
}

const JOBS: [Job; 8] = [
    Job::Ladder(42),
    Job::Native(0),
    Job::Ladder(0),
    Job::Native(42),
    Job::Ladder(1),
    Job::Native(1),
    Job::Ladder(2),
    Job::Native(2),
];

/// State ten steps before the first contact step of the native solver.
fn before_the_touch(world: &World, seed: u32) -> State {
    let run = native_run(world, thrown(seed), 400);
    let contact = run.iter().position(|step| step.status() != StepStatus::Free);
    *run[contact.expect("contact") - 10].state()
}

fn ladder_run(world: &World, start: State) -> Vec<StepRecord> {
    let options = IpoptSolver::options(1e-6, 300);
    let ipopt = IpoptSolver::new(world, options).unwrap();
    let solver = Box::new(Ladder::new(world, ipopt, &Rung::ALL));
    let motion = Motion::Contact { detection: Detection::Predictive, solver };
    let mut simulation = Simulation::new(world.clone(), [start], motion).unwrap();
    let mut record = StepRecord::new();
    let mut run = Vec::with_capacity(STEPS);
    for _ in 0..STEPS {
        simulation.step(&mut record).unwrap();
        run.push(record.clone());
    }
    run
}

/// Results of a job: all numbers as bits, contacts, statuses, iterations.
fn outcome(job: Job) -> Vec<(Vec<u64>, Vec<ContactKey>, String)> {
    let world = cube_world(LIGHT);
    let run = match job {
        Job::Ladder(seed) => ladder_run(&world, before_the_touch(&world, seed)),
        Job::Native(seed) => native_run(&world, before_the_touch(&world, seed), 600),
    };
    let step = |step: StepRecord| {
        let mut numbers = step.certificate().parts().map(|(_, value)| value).to_vec();
        numbers.extend(&step.state().to_vector());
        numbers.extend(&step.next().to_vector());
        for contact in &step.first().solution.contacts {
            numbers.extend(contact.force.iter().chain(&contact.slip));
            numbers.push(contact.normal_force);
        }
        let bits = numbers.into_iter().map(f64::to_bits).collect();
        let pressed =
            step.first().solution.contacts.iter().filter(|contact| contact.carries_force());
        (bits, pressed.map(|contact| contact.key).collect(), format!("{:?}", step.report()))
    };
    run.into_iter().map(step).collect()
}

/// Checks both solvers on eight threads. Ipopt and MUMPS keep global state behind the wrapper's
/// lock, and the threads get it in a different order on every run.
#[test]
fn eight_threads_of_both_solvers_give_the_same_doubles_as_one() {
    let alone = JOBS.map(outcome);
    for (job, steps) in JOBS.iter().zip(&alone) {
        let contact = steps.iter().filter(|(_, pressed, _)| !pressed.is_empty()).count();
        // Between impacts no contact carries a force.
        assert!(contact >= 3, "{job:?}: {contact} steps in contact");
    }
    let threads: Vec<_> = (0..THREADS)
        .map(|first| {
            thread::spawn(move || {
                // One Ipopt job and one native job. The neighbouring threads have other jobs.
                [first, first + 1].map(|k| (k % JOBS.len(), outcome(JOBS[k % JOBS.len()])))
            })
        })
        .collect();
    for thread in threads {
        for (k, together) in thread.join().unwrap() {
            for (step, (found, expected)) in together.iter().zip(&alone[k]).enumerate() {
                assert_eq!(found, expected, "{:?}, step {step}", JOBS[k]);
            }
            assert_eq!(together.len(), alone[k].len());
        }
    }
}

/// Checks that a native solver can move to another thread between steps.
#[test]
fn a_native_solver_that_moves_to_another_thread_gives_the_same_doubles() {
    let world = cube_world(LIGHT);
    let run = native_run(&world, before_the_touch(&world, 42), 200);
    let mut solver = NativeSolver::new(&world);
    for k in 2..run.len() {
        let (world, run) = (&world, &run);
        solver = thread::scope(|scope| {
            let moved = scope.spawn(move || {
                let solved = solve_again(&mut solver, world, run, k);
                assert_eq!(solved.solution, run[k].first().solution, "step {k}");
                solver
            });
            moved.join().unwrap()
        });
    }
}
