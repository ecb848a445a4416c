//! Ipopt's steps of one body: missed contacts, the native solution in its place, interrupts, and
//! refused worlds.

use crate::common::prelude::*;
use std::sync::atomic::AtomicBool;
use tumble::ipopt::Options;
use tumble::solver::ipopt::{IpoptSolver, LADDER_RESIDUAL, Ladder, Rung, ladder_for};

fn world(bodies: Vec<RigidBody>, friction: f64) -> World {
    World::new(Parameters { friction, ..Parameters::new(bodies) }).unwrap()
}

fn at(height: f64) -> State {
    State::at_rest(Vector3::new(0.0, 0.0, height))
}

fn cube() -> RigidBody {
    RigidBody::solid_box(1.0, Vector3::repeat(0.1)).unwrap()
}

fn options() -> Options {
    IpoptSolver::options(1e-6, 300)
}

fn ladder(world: &World, options: Options, rungs: &[Rung]) -> Ladder {
    Ladder::new(world, IpoptSolver::new(world, options).unwrap(), rungs)
}

fn run(world: &World, start: State, steps: usize, motion: Motion<'_>) -> Vec<StepRecord> {
    let mut simulation = Simulation::new(world.clone(), [start], motion).unwrap();
    let mut record = StepRecord::new();
    let step = |_| {
        simulation.step(&mut record).unwrap();
        record.clone()
    };
    (0..steps).map(step).collect()
}

/// Solves one step with `solver` from `state` with the contacts `candidates`.
fn solve(
    solver: &mut dyn StepSolver,
    world: &World,
    state: State,
    mut candidates: Candidates,
    interrupt: Option<&AtomicBool>,
) -> Result<(StepReport, StepSolution, f64), Error> {
    let (states, wrenches) = (&[state], &[Wrench::zero()]);
    let free = &[world.free_flight(0, &state, &wrenches[0])];
    let (previous, mut solution) = (&StepSolution::free(states), StepSolution::default());
    let step = Step { world, states, wrenches, free, previous, earlier: None, interrupt };
    let report = solver.solve(&step, &mut candidates, &mut solution)?;
    assert_eq!(solution.contacts.len(), candidates.contacts().len());
    let (next, contacts) = (&solution.states, candidates.contacts());
    let claim = Claim { states, next, wrenches, contacts, joints: &[], gears: &[] };
    let residual = Certifier::new().contact_step(world, &claim, solution.forces()).residual();
    Ok((report, solution, residual))
}

/// Candidates of a cube that rests on a face.
fn resting(world: &World) -> Candidates {
    Candidates::from(run(world, at(0.1), 1, Motion::native(world))[0].first().contacts.clone())
}

/// Checks a step without candidates. Free flight moves the cube into the ground. The missed contacts
/// are added, and Ipopt alone solves the step.
#[test]
fn missed_contacts_are_added_to_the_program() {
    let world = world(vec![cube()], 0.5);
    let mut ipopt = ladder(&world, options(), &[Rung::FreeFlight]);
    let mut state = at(0.100_005);
    state.velocity[2] = -0.01;
    let (report, solution, residual) =
        solve(&mut ipopt, &world, state, Candidates::new(), None).unwrap();
    assert_eq!(report.status, StepStatus::Retried);
    assert_eq!(solution.contacts.iter().filter(|c| c.carries_force()).count(), 4);
    assert!(residual < LADDER_RESIDUAL, "{residual:e}");
}

/// Checks that the native solution is used, with a mark, if Ipopt may not iterate.
#[test]
fn without_iterations_the_native_solution_stands_in() {
    let world = world(vec![cube()], 0.5);
    let rungs = [Rung::Previous, Rung::FreeFlight, Rung::Native];
    let mut ipopt = ladder(&world, IpoptSolver::options(1e-6, 1), &rungs);
    let mut state = at(0.1);
    state.velocity = Vector3::new(1.0, 0.0, -0.5);
    let (report, solution, residual) =
        solve(&mut ipopt, &world, state, resting(&world), None).unwrap();
    assert_eq!((report.status, report.start), (StepStatus::Fallback, Some("native")));
    assert!(residual < 1e-9, "{residual:e}");
    let mut native = NativeSolver::new(&world);
    let (_, theirs, _) = solve(&mut native, &world, state, resting(&world), None).unwrap();
    assert_eq!(solution, theirs);
}

#[test]
fn a_raised_interrupt_ends_the_step() {
    let world = world(vec![cube()], 0.5);
    let mut ipopt = ladder(&world, options(), &Rung::ALL);
    let raised = AtomicBool::new(true);
    let ended = solve(&mut ipopt, &world, at(0.1), resting(&world), Some(&raised));
    assert_eq!(ended.err(), Some(Error::Interrupted));
}

/// Checks that worlds outside the program are refused in one sentence that names the native solver.
#[test]
fn other_worlds_are_refused_in_a_sentence_that_names_the_native_solver() {
    let usual = || world(vec![cube()], 0.5);
    let ball = RigidBody::solid(1.0, &[Piece::sphere(0.1).unwrap()]).unwrap().0;
    let piece = Piece::cuboid(Vector3::new(1.0, 1.0, 0.2)).unwrap();
    let block = vec![piece];
    let without_ground =
        World::new(Parameters { ground: None, ..usual().parameters().clone() }).unwrap();
    for (other, word) in [
        (world(vec![cube(), cube()], 0.5), "one body"),
        (world(vec![ball], 0.5), "rounded points"),
        (usual().with_fixed(block), "fixed pieces"),
        (usual().with_coefficient(Coefficient::Restitution, 0.5).unwrap(), "restitution"),
        (
            usual()
                .with_coefficient_between(Coefficient::Friction, 0, Partner::Ground, 0.3)
                .unwrap(),
            "coefficient",
        ),
        (usual().with_untouched(0).unwrap(), "touch the ground"),
        (without_ground, "ground"),
    ] {
        for refused in
            [ladder_for(&other, options()).err(), IpoptSolver::tutorial(&other, options()).err()]
        {
            let said = refused.unwrap().to_string();
            let is_sentence = said.contains(word) && said.contains("native");
            assert!(is_sentence && !said.contains('\n'), "{said}");
        }
    }
    assert!(ladder_for(&usual(), options()).is_ok());
}

/// Checks a cube that starts 1e-9 m too deep, as Ipopt's tolerance allows. Lifting it out gains no
/// energy, so that no step is unphysical.
#[test]
fn overlap_within_tolerance_is_not_unphysical() {
    let world = world(vec![cube()], 0.5);
    let start = at(0.1 - 1e-9);
    let solver = ladder(&world, IpoptSolver::options(1e-8, 50), &Rung::ALL);
    let records = run(&world, start, 40, Motion::contact(solver));
    assert!(records[39].next().position[2] > start.position[2] + 5e-10);
    assert!(records.iter().all(|record| record.status() != StepStatus::Wild));
}
