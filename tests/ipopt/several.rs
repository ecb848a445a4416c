//! Ipopt for several bodies, fixed pieces and rounded points. Its steps are compared with the
//! native solver's where the laws determine the motion. Also its ladder, and refused worlds.

use nalgebra::{Vector3, Vector4};
use std::sync::atomic::AtomicBool;
use tumble::ipopt::Options;
use tumble::solver::ipopt::{
    Formulation, IpoptSolver, LADDER_RESIDUAL, Ladder, MOST_BODIES, Rung, ladder_for,
};
use tumble_core::contact::certificate::{Certifier, Claim};
use tumble_core::contact::{Candidates, Plane};
use tumble_core::error::Error;
use tumble_core::geometry::Piece;
use tumble_core::mechanics::{RigidBody, Rotation, State, Wrench};
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::solver::native::NativeSolver;
use tumble_core::step::{Step, StepReport, StepSolution, StepSolver, StepStatus};
use tumble_core::world::{Fixed, Parameters, World};

/// World, initial states, and the force on the first body [N].
struct Scene {
    world: World,
    starts: Vec<State>,
    push: Vector3<f64>,
}

fn world(bodies: Vec<RigidBody>, gravity: f64, friction: f64) -> World {
    let gravity = Vector3::new(0.0, 0.0, -gravity);
    let (ground, time_step) = (Plane::level(), 0.002);
    World::new(Parameters {
        bodies,
        ground: Some(ground),
        gravity,
        friction,
        time_step,
        rotation: Rotation::Momentum,
    })
    .unwrap()
}

fn at(position: [f64; 3]) -> State {
    State {
        position: position.into(),
        attitude: Vector4::new(1.0, 0.0, 0.0, 0.0),
        velocity: Vector3::zeros(),
        spin: Vector3::zeros(),
    }
}

fn cube(mass: f64) -> RigidBody {
    RigidBody::solid_box(mass, Vector3::repeat(0.1)).unwrap()
}

fn ball(mass: f64, radius: f64) -> RigidBody {
    RigidBody::solid(mass, &[Piece::sphere(radius).unwrap()]).unwrap().0
}

/// Stack of cubes of 0.2 m. The lowest one is pushed.
fn stack(count: usize, push: f64) -> Scene {
    let starts = (0..count).map(|i| at([0.0, 0.0, 0.1 + 0.2 * i as f64])).collect();
    let world = world((0..count).map(|_| cube(1.0)).collect(), 9.81, 0.5);
    Scene { world, starts, push: Vector3::new(push, 0.0, 0.0) }
}

/// Ball that falls off-centre on a box and rolls.
fn ball_on_box() -> Scene {
    let world = world(vec![cube(2.0), ball(0.5, 0.05)], 9.81, 0.5);
    let mut starts = vec![at([0.0, 0.0, 0.1]), at([0.01, 0.02, 0.26])];
    starts[1].spin = Vector3::new(3.0, 2.0, 1.0);
    Scene { world, starts, push: Vector3::zeros() }
}

/// Two boxes that collide without gravity, a corner of one on a face of the other.
fn pair_in_space() -> Scene {
    let world = world(vec![cube(1.0), cube(3.0)], 0.0, 0.3);
    let mut starts = vec![at([0.0, 0.0, 10.0]), at([0.33, 0.03, 10.05])];
    starts[0].velocity = Vector3::new(1.0, 0.0, 0.0);
    starts[0].spin = Vector3::new(0.3, 2.0, 1.5);
    starts[0].attitude = Vector4::new(0.9, 0.2, 0.3, 0.1).normalize();
    Scene { world, starts, push: Vector3::zeros() }
}

fn ladder(world: &World, rungs: &[Rung]) -> Ladder {
    ladder_with(world, IpoptSolver::options(1e-6, 300), rungs)
}

fn ladder_with(world: &World, options: Options, rungs: &[Rung]) -> Ladder {
    let ipopt = IpoptSolver::new(world, Formulation::Reduced, options).unwrap();
    Ladder::new(world, ipopt, rungs)
}

fn simulation<'a>(scene: &Scene, motion: Motion<'a>) -> Simulation<'a> {
    let starts = scene.starts.iter().copied();
    let mut simulation = Simulation::new(scene.world.clone(), starts, motion).unwrap();
    let push = Wrench { force: scene.push, torque: Vector3::zeros() };
    simulation.set_wrench(0, push).unwrap();
    simulation
}

fn run(scene: &Scene, steps: usize, motion: Motion<'_>) -> Vec<StepRecord> {
    let mut simulation = simulation(scene, motion);
    let mut record = StepRecord::new();
    let step = |_| {
        simulation.step(&mut record).unwrap();
        record.clone()
    };
    (0..steps).map(step).collect()
}

/// Solves one step with `solver` from `states` with the contacts `candidates`.
fn solve(
    solver: &mut dyn StepSolver,
    scene: &Scene,
    states: &[State],
    mut candidates: Candidates,
    previous: &StepSolution,
    interrupt: Option<&AtomicBool>,
) -> Result<(StepReport, StepSolution, f64), Error> {
    let (world, mut solution) = (&scene.world, StepSolution::default());
    let mut wrenches = vec![Wrench::zero(); states.len()];
    wrenches[0].force = scene.push;
    let flights = states.iter().zip(&wrenches).enumerate();
    let free: Vec<_> = flights.map(|(i, (x, wrench))| world.free_flight(i, x, wrench)).collect();
    let (wrenches, free) = (&wrenches[..], &free[..]);
    let step = Step { world, states, wrenches, free, previous, earlier: None, interrupt };
    let report = solver.solve(&step, &mut candidates, &mut solution)?;
    assert_eq!(solution.contacts.len(), candidates.contacts().len());
    let contacts = candidates.contacts();
    let claim =
        Claim { states, next: &solution.states, wrenches, contacts, joints: &[], gears: &[] };
    let residual = Certifier::new().contact_step(world, &claim, solution.forces()).residual();
    Ok((report, solution, residual))
}

/// Compares steps of native runs with Ipopt alone: a push below the friction limit, rolling and
/// falling, and free space. With the residual δ each contact's impulse, in its own scale, obeys the
/// laws within δ along the normal and in friction. The motion is the sum of the impulses. With K
/// contacts velocities, and spins at the reach, may differ by 2 K (δ + δ').
#[test]
fn ipopt_agrees_with_the_native_solver_where_the_motion_is_determined() {
    let scenes = [
        ("stack", stack(2, 4.0), 40),
        ("ball on a box", ball_on_box(), 120),
        ("pair in space", pair_in_space(), 120),
    ];
    for (name, scene, steps) in &scenes {
        let native = run(scene, *steps, Motion::native(&scene.world));
        let rungs = [Rung::Warm, Rung::Previous, Rung::NativeStart, Rung::FreeFlight];
        let mut ipopt = ladder(&scene.world, &rungs);
        let (mut compared, mut touching) = (0, 0);
        for (index, record) in native.iter().enumerate() {
            if record.solution.contacts.is_empty() {
                continue;
            }
            touching += 1;
            let none = StepSolution::free(&record.states);
            let before = if index == 0 { &none } else { &native[index - 1].solution };
            let found = Candidates::from(record.contacts.clone());
            let (report, ours, residual) =
                solve(&mut ipopt, scene, &record.states, found, before, None).unwrap();
            if report.status == StepStatus::Failed {
                continue;
            }
            compared += 1;
            let count = record.contacts.len() as f64;
            let allowed = 2.0 * count * (residual + record.certificate.residual());
            for (body, (a, b)) in ours.states.iter().zip(&record.solution.states).enumerate() {
                let reach = scene.world.bodies()[body].reach();
                let apart = (a.velocity - b.velocity).amax();
                let apart = apart.max((a.spin - b.spin).amax() * reach);
                assert!(apart <= allowed, "{name} {index}: {apart:e}, {allowed:e} allowed");
            }
        }
        assert!(compared > 2 && 20 * compared >= 19 * touching, "{name}: {compared} of {touching}");
    }
}

/// Checks complete runs. No step fails, few use the native fallback, and every residual is within
/// the ladder's limit. A stack stays in place, to the residuals of its steps.
#[test]
#[ignore = "slow"]
fn whole_runs_are_solved_and_stand() {
    for (name, scene, steps) in [
        ("stack of 5", stack(5, 0.0), 60),
        ("ball on a box", ball_on_box(), 120),
        ("pair in space", pair_in_space(), 120),
    ] {
        let records = run(&scene, steps, Motion::contact(ladder(&scene.world, &Rung::ALL)));
        let limit = LADDER_RESIDUAL * scene.world.speed_scale();
        let mut fallbacks = 0;
        for record in &records {
            let (status, residual) = (record.report.status, record.certificate.residual());
            assert_ne!(status, StepStatus::Failed, "{name} {}", record.index);
            assert!(residual <= limit, "{name} {}: {residual:e}", record.index);
            fallbacks += usize::from(status == StepStatus::Fallback);
        }
        assert!(20 * fallbacks <= steps, "{name}: {fallbacks} fallbacks");
        if name == "stack of 5" {
            let end = &records[steps - 1].solution.states;
            let moved =
                end.iter().zip(&scene.starts).map(|(a, b)| (a.position - b.position).amax());
            assert!(moved.fold(0.0, f64::max) < 1e-8);
        }
    }
}

/// Checks that a pair without gravity conserves its momentum. The tolerance is Ipopt's residual in
/// the equations of motion (1e-6 m/s in each of 120 steps, for masses of 3 kg).
#[test]
fn a_pair_in_space_keeps_its_momentum() {
    let scene = pair_in_space();
    let momentum = |states: &[State]| -> Vector3<f64> {
        let bodies = scene.world.bodies().iter().zip(states);
        bodies.map(|(body, state)| body.mass() * state.velocity).sum()
    };
    let records = run(&scene, 120, Motion::contact(ladder(&scene.world, &Rung::ALL)));
    assert!(
        records.iter().any(|record| record.solution.contacts.iter().any(|c| c.carries_force()))
    );
    let dynamics: f64 = records.iter().map(|record| record.certificate.dynamics).sum();
    let changed = momentum(&records[119].solution.states) - momentum(&scene.starts);
    assert!(dynamics < 120e-6, "{dynamics:e}");
    assert!(changed.amax() <= 4.0 * dynamics + 1e-13, "{changed}: {dynamics:e}");
}

/// Checks a ball on the ground. The tutorial's program does not support rounded points, but the
/// reduced one does. The ball rests with its centre one radius above the ground (to the residual
/// times h).
#[test]
fn a_ball_lies_on_the_ground() {
    let world = world(vec![ball(1.0, 0.1)], 9.81, 0.5);
    let options = IpoptSolver::options(1e-6, 300);
    let refused = IpoptSolver::new(&world, Formulation::Clamped, options.clone()).err().unwrap();
    assert!(refused.to_string().contains("rounded points"), "{refused}");
    let solver = ladder_for(&world, Formulation::Reduced, options).unwrap();
    let scene = Scene { world, starts: vec![at([0.0, 0.0, 0.11])], push: Vector3::zeros() };
    let records = run(&scene, 60, Motion::Contact { detection: Default::default(), solver });
    assert!(records.iter().all(|record| record.report.status != StepStatus::Failed));
    let height = records[59].next().position[2];
    assert!((height - 0.1).abs() < 1e-6, "{height}");
}

/// Checks that a body without contacts falls freely. The tutorial's program has rows for all points
/// and is not used.
#[test]
fn a_body_without_contacts_falls_through_the_ground() {
    let world = world(vec![cube(1.0)], 9.81, 0.5).with_untouched(0).unwrap();
    let solver = ladder(&world, &Rung::ALL);
    let scene = Scene { world, starts: vec![at([0.0, 0.0, 0.1])], push: Vector3::zeros() };
    let steps = run(&scene, 20, Motion::contact(solver));
    let end = steps.last().unwrap().next();
    assert!(end.position.z < 0.1 - 1e-3, "{}", end.position.z);
}

/// Checks a ball that rolls without slip on a fixed block: Ipopt finds the native solver's motion.
/// Sticking friction is a reaction, so the motion is determined.
#[test]
fn fixed_pieces_hold() {
    let block = Piece::cuboid(Vector3::new(1.0, 1.0, 0.2)).unwrap();
    let world = world(vec![ball(1.0, 0.1)], 9.81, 0.5);
    let world = world.with_fixed(vec![Fixed { piece: block, friction: Some(0.8) }]).unwrap();
    let mut start = at([0.0, 0.0, 0.3]);
    (start.velocity, start.spin) = (Vector3::new(0.5, 0.0, 0.0), Vector3::new(0.0, 5.0, 0.0));
    let solver = ladder(&world, &Rung::ALL);
    let scene = Scene { world, starts: vec![start], push: Vector3::zeros() };
    let ours = run(&scene, 50, Motion::contact(solver));
    let theirs = run(&scene, 50, Motion::native(&scene.world));
    assert!(ours.iter().all(|record| record.report.status != StepStatus::Failed));
    let residuals: f64 = ours.iter().map(|record| record.certificate.residual()).sum();
    let apart = (ours[49].next().position - theirs[49].next().position).amax();
    // Each step's velocity has an error of some residuals, for a tenth of a second.
    assert!(apart < 0.1 * 4.0 * residuals + 1e-12, "{apart:e}: {residuals:e}");
}

/// Checks a step without candidates. Free flight moves the ball into the box and the box into the
/// ground. The missed contacts are added, and Ipopt alone solves the step.
#[test]
fn missed_contacts_join() {
    let scene = ball_on_box();
    let mut ipopt = ladder(&scene.world, &[Rung::FreeFlight]);
    let none = StepSolution::free(&scene.starts);
    let mut states = scene.starts.clone();
    states[1].position[2] = 0.250_005;
    states[1].velocity = Vector3::new(0.0, 0.0, -0.01);
    let (report, solution, residual) =
        solve(&mut ipopt, &scene, &states, Candidates::new(), &none, None).unwrap();
    assert_eq!(report.status, StepStatus::Retried);
    assert_eq!(solution.contacts.iter().filter(|c| c.carries_force()).count(), 5);
    assert!(residual < LADDER_RESIDUAL, "{residual:e}");
}

/// Checks that the native solution is used, with a mark, if Ipopt may not iterate.
#[test]
fn without_iterations_the_native_solution_stands_in() {
    let scene = stack(2, 4.0);
    let options = IpoptSolver::options(1e-6, 1);
    let rungs = [Rung::Previous, Rung::FreeFlight, Rung::Native];
    let mut ipopt = ladder_with(&scene.world, options, &rungs);
    let native = run(&scene, 1, Motion::native(&scene.world));
    let found = || Candidates::from(native[0].contacts.clone());
    let none = StepSolution::free(&scene.starts);
    let (report, solution, residual) =
        solve(&mut ipopt, &scene, &scene.starts, found(), &none, None).unwrap();
    assert_eq!((report.status, report.start), (StepStatus::Fallback, Some("native")));
    assert!(residual < 1e-9, "{residual:e}");
    let mut native = NativeSolver::new(&scene.world);
    let (_, theirs, _) = solve(&mut native, &scene, &scene.starts, found(), &none, None).unwrap();
    assert_eq!(solution, theirs);
}

#[test]
fn a_raised_interrupt_ends_the_step() {
    let scene = stack(3, 0.0);
    let mut ipopt = ladder(&scene.world, &Rung::ALL);
    let native = run(&scene, 1, Motion::native(&scene.world));
    let (found, none) =
        (Candidates::from(native[0].contacts.clone()), StepSolution::free(&scene.starts));
    let raised = AtomicBool::new(true);
    let ended = solve(&mut ipopt, &scene, &scene.starts, found, &none, Some(&raised));
    assert_eq!(ended.err(), Some(Error::Interrupted));
}

#[test]
fn many_bodies_are_refused_in_a_sentence_that_names_the_native_solver() {
    let scene = stack(MOST_BODIES + 1, 0.0);
    let options = IpoptSolver::options(1e-6, 300);
    let refused = ladder_for(&scene.world, Formulation::Reduced, options.clone()).err().unwrap();
    let said = refused.to_string();
    assert!(
        said.contains("11 bodies") && said.contains("native") && !said.contains('\n'),
        "{said}"
    );
    let allowed = stack(MOST_BODIES, 0.0);
    assert!(ladder_for(&allowed.world, Formulation::Reduced, options).is_ok());
}

/// Checks a stack that starts up to 1e-9 m too deep, as Ipopt's tolerance allows. Lifting it out
/// gains no energy, so that no step is unphysical.
#[test]
fn what_is_lifted_within_the_tolerance_is_not_wild() {
    let mut scene = stack(2, 0.0);
    for (start, depth) in scene.starts.iter_mut().zip([1e-9, 2e-9]) {
        start.position[2] -= depth;
    }
    let solver = ladder_with(&scene.world, IpoptSolver::options(1e-8, 50), &Rung::ALL);
    let records = run(&scene, 40, Motion::contact(solver));
    let height = |record: &StepRecord| record.solution.states[1].position[2];
    assert!(height(&records[39]) > scene.starts[1].position[2] + 1e-9);
    assert!(records.iter().all(|record| record.report.status != StepStatus::Wild));
}

/// Checks that the overlap after a step is the overlap of the shapes. A search that ignores small
/// depths stores only a bound of it.
#[test]
fn the_overlap_after_a_step_is_that_of_the_shapes() {
    let scene = ball_on_box();
    let mut states = scene.starts.clone();
    // A box rotated out of another one: the last axis is not the axis of least overlap.
    let world = world(vec![cube(1.0), cube(1.0)], 9.81, 0.5);
    states[1] = at([0.198, 0.0, 0.1]);
    let mut candidates = Candidates::new();
    candidates.deepest_overlap(&world, &states);
    states[1] = at([0.150, 0.199, 0.1]);
    candidates.admit_missed(&world, &scene.starts, &states, 1.0);
    let found = candidates.deepest_overlap(&world, &states).unwrap().0;
    assert!((found - 0.001).abs() < 1e-9, "{found}");
}

/// Checks that a run has the same bytes, regardless of earlier solves.
#[test]
fn the_same_run_twice_is_the_same() {
    let scene = ball_on_box();
    let twice = [0, 1].map(|_| run(&scene, 60, Motion::contact(ladder(&scene.world, &Rung::ALL))));
    assert_eq!(twice[0].last().unwrap().solution, twice[1].last().unwrap().solution);
}
