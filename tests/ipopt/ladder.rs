//! The ladder of starts: its result if no rung has a start, and its choice among several results
//! that have not converged.

use crate::common;
use crate::common::prelude::*;

use crate::common::{certify, point_forces, tutorial_world};
use crate::toss::*;
use tumble::solver::ipopt::{IpoptSolver, Ladder, Rung};

fn ladder(world: &World, rungs: &[Rung], most_iterations: u32) -> Ladder {
    let options = IpoptSolver::options(1e-6, most_iterations);
    let ipopt = IpoptSolver::new(world, options).unwrap();
    Ladder::new(world, ipopt, rungs)
}

/// Contact steps of a thrown cube, one in `every`, each with the step before it.
fn contact_steps(world: &World, every: usize) -> Vec<(StepRecord, StepRecord)> {
    let run = thrown_run(world, 42);
    let pairs = run.windows(2).map(|pair| (pair[0].clone(), pair[1].clone()));
    pairs.filter(|(_, step)| !step.first().contacts.is_empty()).step_by(every).collect()
}

/// Checks a ladder without a usable rung. A warm start needs an earlier point of Ipopt. The result
/// is the free flight of the step without forces, with the status failed.
#[test]
fn without_a_start_the_end_is_free_flight_and_failed() {
    let world = tutorial_world();
    let none = Wrench::zero();
    for rungs in [&[][..], &[Rung::Warm], &[Rung::Warm, Rung::Warm]] {
        let mut ladder = ladder(&world, rungs, 300);
        for (before, step) in contact_steps(&world, 50) {
            let (state, candidates) = (step.state(), &step.first().contacts);
            let of_step = (state, &none);
            let (report, solution) =
                common::solve(&mut ladder, &world, of_step, candidates, &before.first().solution);
            let name = format!("{rungs:?}, step {}", step.index);
            assert_eq!(report, StepReport::without_problem(StepStatus::Failed), "{name}");
            assert_eq!(solution.states, [world.free_flight(0, state, &none)], "{name}");
            assert_eq!(solution.contacts.len(), candidates.len(), "{name}");
            for (found, candidate) in solution.contacts.iter().zip(candidates) {
                assert_eq!(found.key, candidate.key, "{name}");
                assert!(!found.carries_force() && found.force.norm() == 0.0, "{name}");
            }
        }
    }
}

/// Checks the same in a run. The cube falls freely through the ground, and each step reports its
/// failure.
#[test]
fn a_run_without_rungs_falls_freely() {
    let world = tutorial_world();
    let start = *contact_steps(&world, 1)[0].1.state();
    for rungs in [&[][..], &[Rung::Warm]] {
        let motion = Motion::contact(ladder(&world, rungs, 300));
        let mut simulation = Simulation::new(world.clone(), [start], motion).unwrap();
        let (mut record, mut expected) = (StepRecord::new(), start);
        for k in 0..20 {
            simulation.step(&mut record).unwrap();
            expected = world.free_flight(0, &expected, &Wrench::zero());
            assert_eq!((record.status(), record.next()), (StepStatus::Failed, &expected));
            assert!(record.certificate().penetration > 0.1, "step {k}: {:?}", record.certificate());
        }
    }
}

/// Solves one step with a new ladder and returns its residual too.
fn climb(
    world: &World,
    rungs: &[Rung],
    most_iterations: u32,
    (before, step): (&StepRecord, &StepRecord),
) -> (StepReport, StepSolution, f64) {
    let (mut ladder, none) = (ladder(world, rungs, most_iterations), Wrench::zero());
    let (state, candidates): (&State, &[Contact]) = (step.state(), &step.first().contacts);
    let of_step = (state, &none);
    let (report, solution) =
        common::solve(&mut ladder, world, of_step, candidates, &before.first().solution);
    let forces = point_forces(world, &solution);
    let residual = certify(world, (state, &solution.states[0]), &forces, &none).residual();
    (report, solution, residual)
}

/// Checks rungs that are cut off after one to three iterations, so that none converges. The ladder
/// reports the result with the smallest residual, the name of its rung, and the sum of all
/// iterations.
#[test]
fn the_best_of_the_unsolved_ends_is_reported() {
    let world = tutorial_world();
    // The native start is close to the solution and would always be the best.
    let rungs = [Rung::Previous, Rung::FreeFlight, Rung::SharedWeight];
    let mut best_at = [0; 3];
    for most_iterations in 1..=3 {
        for (before, step) in contact_steps(&world, 25) {
            let pair = (&before, &step);
            let (report, solution, residual) = climb(&world, &rungs, most_iterations, pair);
            let alone = rungs.map(|rung| climb(&world, &[rung], most_iterations, pair));
            if alone.iter().any(|(report, ..)| report.status != StepStatus::Failed) {
                continue;
            }
            let best = (0..3).min_by(|&a, &b| alone[a].2.total_cmp(&alone[b].2)).unwrap();
            let name = format!("{most_iterations} iterations, step {}", step.index);
            assert_eq!(report.status, StepStatus::Failed, "{name}");
            assert_eq!(residual, alone[best].2, "{name}");
            assert_eq!(report.start, Some(rungs[best].name()), "{name}");
            assert_eq!(solution, alone[best].1, "{name}");
            let iterations: u32 = alone.iter().map(|(report, ..)| report.iterations).sum();
            assert_eq!(report.iterations, iterations, "{name}");
            best_at[best] += 1;
        }
    }
    // The best rung is not always the last or the first.
    let elsewhere: u32 = best_at[..2].iter().sum();
    assert!(
        elsewhere > 20 && best_at.iter().filter(|count| **count > 0).count() > 1,
        "{best_at:?}"
    );
}
