//! Helpers of the native solver's tests: models, runs, and single steps as the simulation solves
//! them.

// Every test program compiles this file separately and uses only a part of it.
#![allow(dead_code)]

use crate::common::draw::Draw;
use crate::common::steps::steps;
use crate::common::{body, certify, contacts, point_forces, solve_after, tutorial_parameters};
use nalgebra::{Matrix3, Vector3, Vector4};
use tumble_core::contact::{Certificate, Detection};
use tumble_core::mechanics::quaternion::left;
use tumble_core::mechanics::{RigidBody, State, Wrench};
use tumble_core::simulation::scene::TutorialScene;
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::solver::native::NativeSolver;
use tumble_core::step::{ContactForce, StepReport, StepSolution, StepSolver, StepStatus};
use tumble_core::world::{Parameters, World};

/// Inertia of the tutorial's cube, I/E₃ [kg m²].
pub const LIGHT: f64 = 0.01;
/// Inertia of a solid cube of the same mass and size, I/E₃ [kg m²]: m (2 m)²/6.
pub const SOLID: f64 = 6.666667;

/// Tutorial constants with another body.
pub fn parameters(body: RigidBody) -> Parameters {
    Parameters { bodies: vec![body], ..tutorial_parameters() }
}

/// Tutorial cube with another inertia.
pub fn cube(inertia: Matrix3<f64>) -> RigidBody {
    RigidBody::with_box_corners(10.0, inertia, Vector3::repeat(1.0)).unwrap()
}

/// Tutorial world with the inertia `inertia` E₃.
pub fn cube_world(inertia: f64) -> World {
    let inertia = Matrix3::from_diagonal_element(inertia);
    World::new(parameters(cube(inertia))).unwrap()
}

/// Cubes of three inertias: the tutorial's, a solid cube's, and one with moments close to 2, 5 and
/// 6 kg m² about axes that are rotated against the sides.
pub fn cubes() -> Vec<RigidBody> {
    let askew = Matrix3::new(4.584, 1.209, -0.554, 1.209, 2.648, 0.288, -0.554, 0.288, 5.768);
    [LIGHT, SOLID]
        .map(Matrix3::from_diagonal_element)
        .into_iter()
        .chain([askew])
        .map(cube)
        .collect()
}

/// Initial state of the thrown cube.
pub fn thrown(seed: u32) -> State {
    TutorialScene::drop().start(TutorialScene::drop().attitude(seed))
}

/// Simulation with the native solver.
pub fn native(world: &World, start: State) -> Simulation<'static> {
    let solver = Box::new(NativeSolver::new(world));
    let motion = Motion::Contact { detection: Detection::Predictive, solver };
    Simulation::new(world.clone(), [start], motion).unwrap()
}

/// Steps of a thrown cube's run of 1000 rows with the native solver.
pub fn thrown_run(world: &World, seed: u32) -> Vec<StepRecord> {
    native_run(world, thrown(seed), 999)
}

/// Steps of a run with the native solver.
pub fn native_run(world: &World, start: State, count: usize) -> Vec<StepRecord> {
    steps(&mut native(world, start), count, |_| true)
}

/// Largest residual of a run [m/s], after a check that no step failed.
pub fn worst_residual(run: &[StepRecord]) -> f64 {
    for step in run {
        assert_ne!(step.status(), StepStatus::Failed, "step {}", step.index);
    }
    run.iter().map(|step| step.residual()).fold(0.0, largest)
}

/// Larger of two numbers, or NaN if either is NaN.
pub fn largest(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Result of a single step.
pub struct Solved {
    pub report: StepReport,
    pub solution: StepSolution,
    pub certificate: Certificate,
}

/// Solves one step from `state` as the simulation does, without an external wrench and starting
/// from `previous`.
pub fn solve_step(
    solver: &mut dyn StepSolver,
    world: &World,
    state: &State,
    previous: &StepSolution,
) -> Solved {
    solve_step_after(solver, world, state, (previous, None))
}

/// Solves step `k` ≥ 2 of `run` again, with the same two solutions before it.
pub fn solve_again(
    solver: &mut dyn StepSolver,
    world: &World,
    run: &[StepRecord],
    k: usize,
) -> Solved {
    let past = (&run[k - 1].first().solution, Some(&run[k - 2].first().solution));
    solve_step_after(solver, world, run[k].state(), past)
}

fn solve_step_after(
    solver: &mut dyn StepSolver,
    world: &World,
    state: &State,
    past: (&StepSolution, Option<&StepSolution>),
) -> Solved {
    let wrench = &Wrench::zero();
    let free = world.free_flight(0, state, wrench);
    let mut candidates = Vec::new();
    let touches = Detection::Predictive.find(world, &[*state], &[free], &mut candidates);
    let (report, solution) = if touches {
        solve_after(solver, world, (state, wrench), &candidates, past)
    } else {
        (StepReport::without_problem(StepStatus::Free), StepSolution::free(&[free]))
    };
    let forces = point_forces(world, &solution);
    let certificate = certify(world, (state, &solution.states[0]), &forces, wrench);
    Solved { report, solution, certificate }
}

/// Solution with the pose `state` and forces at the contact points [N, world frame], as a start for
/// a step.
pub fn with_forces(world: &World, state: &State, forces: &[Vector3<f64>]) -> StepSolution {
    let mut solution = StepSolution::free(&[*state]);
    let contacts = contacts(world, state);
    solution.contacts.extend(contacts.iter().zip(forces).map(|(contact, force)| ContactForce {
        force: *force,
        normal_force: contact.normal().dot(force),
        ..ContactForce::none(contact.key)
    }));
    solution
}

/// State rotated by `angle` about the vertical.
pub fn turned(state: &State, angle: f64) -> State {
    let ((s, c), (half_s, half_c)) = (angle.sin_cos(), (0.5 * angle).sin_cos());
    let turn = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
    State {
        position: turn * state.position,
        attitude: left(&Vector4::new(half_c, 0.0, 0.0, half_s)) * state.attitude,
        velocity: turn * state.velocity,
        spin: state.spin,
    }
}

/// Largest difference of two states in position [m] and attitude.
pub fn pose_apart(a: &State, b: &State) -> f64 {
    let position = (a.position - b.position).amax();
    position.max((a.attitude - b.attitude).amax())
}

/// Largest difference of two states in velocity, with spins times the body's reach [m/s].
pub fn motion_apart(world: &World, a: &State, b: &State) -> f64 {
    let velocity = (a.velocity - b.velocity).amax();
    velocity.max((a.spin - b.spin).amax() * body(world).reach())
}

impl Draw {
    /// Pressing forces at every contact point. Their common scale is 0.1 N to 100 kN. The friction
    /// in each horizontal direction is at most 0.3 of the normal force.
    pub fn forces(&mut self, contacts: usize) -> Vec<Vector3<f64>> {
        let size = 10_f64.powf(6.0 * self.share() - 1.0);
        let mut force = || {
            let press = size * self.share();
            let friction = 0.3 * press;
            Vector3::new(
                friction * (2.0 * self.share() - 1.0),
                friction * (2.0 * self.share() - 1.0),
                press,
            )
        };
        (0..contacts).map(|_| force()).collect()
    }
}
