//! Simulations on many threads at once, by Ipopt and by the native solver: the same doubles
//! as alone.

mod common;
mod toss;

use std::thread;
use toss::*;
use tumble::contact::detection::Detection;
use tumble::mechanics::state::State;
use tumble::simulation::{Motion, Simulation, StepRecord};
use tumble::solver::ipopt::{Formulation, IpoptSolver, Ladder, Rung};
use tumble::solver::native::NativeSolver;
use tumble::step::StepStatus;
use tumble::world::ContactModel;

const THREADS: usize = 8;
/// Steps by Ipopt: from shortly before the first touch to well into the contact.
const STEPS: usize = 60;

/// One job: a thrown cube, from ten steps before it touches the ground.
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

/// The state ten steps before the first contact step of the native solver.
fn before_the_touch(model: &ContactModel, seed: u32) -> State {
    let run = native_run(model, thrown(seed), 400);
    let contact = run.iter().position(|step| step.report.status != StepStatus::Free);
    run[contact.expect("contact") - 10].state
}

fn ladder_run(model: &ContactModel, start: State) -> Vec<StepRecord> {
    let ipopt =
        IpoptSolver::new(model, Formulation::default(), IpoptSolver::options(model, 1e-6, 300))
            .unwrap();
    let solver = Box::new(Ladder::new(model, ipopt, &Rung::ALL));
    let motion = Motion::Contact { detection: Detection::Predictive, solver };
    let mut simulation = Simulation::new(model.clone(), start, motion).unwrap();
    let mut record = StepRecord::new(&start, model.contact_count());
    let mut run = Vec::with_capacity(STEPS);
    for _ in 0..STEPS {
        simulation.step(&mut record).unwrap();
        run.push(record.clone());
    }
    run
}

/// Everything that a job computes: all numbers as bits, flags, statuses, iterations.
fn outcome(job: Job) -> Vec<(Vec<u64>, Vec<bool>, String)> {
    let model = cube_model(LIGHT);
    let run = match job {
        Job::Ladder(seed) => ladder_run(&model, before_the_touch(&model, seed)),
        Job::Native(seed) => native_run(&model, before_the_touch(&model, seed), 600),
    };
    let step = |step: StepRecord| {
        let certificate = step.certificate.parts().map(|(_, value)| value);
        let state = step.state.to_vector();
        let numbers = step.solution.as_slice().iter().chain(&certificate).chain(&state);
        let bits = numbers.map(|number| number.to_bits()).collect();
        (bits, step.active, format!("{:?}", step.report))
    };
    run.into_iter().map(step).collect()
}

/// Ipopt and MUMPS keep global state behind the wrapper's lock; the order in which the threads
/// get it is another on every run.
#[test]
fn eight_threads_of_both_solvers_give_the_same_doubles_as_one() {
    let alone = JOBS.map(outcome);
    for (job, steps) in JOBS.iter().zip(&alone) {
        let contact = steps.iter().filter(|(_, active, _)| active.contains(&true)).count();
        assert!(contact >= 10, "{job:?}: {contact} steps in contact");
    }
    let threads: Vec<_> = (0..THREADS)
        .map(|first| {
            thread::spawn(move || {
                // An Ipopt job and a native one, other ones on the neighbouring threads.
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

/// A native solver belongs to no thread: one that has solved steps here goes on there.
#[test]
fn a_native_solver_that_moves_to_another_thread_gives_the_same_doubles() {
    let model = cube_model(LIGHT);
    let run = native_run(&model, before_the_touch(&model, 42), 200);
    let mut solver = NativeSolver::new(&model);
    for pair in run.windows(2) {
        let (before, step) = (pair[0].clone(), pair[1].clone());
        let model = model.clone();
        let moved = thread::spawn(move || {
            let solved = solve_step(&mut solver, &model, &step.state, &before.solution);
            assert_eq!(solved.decision, step.solution, "step {}", step.index);
            solver
        });
        solver = moved.join().unwrap();
    }
}
