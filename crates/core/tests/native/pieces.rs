//! Piece of the contact law on which each contact of a solved step lies, and its margin to the next
//! piece.

use crate::common::prelude::*;
use crate::common::{contacts, solve_after};
use crate::toss::*;
use tumble_core::solver::native::{ContactPiece, MapPiece};

/// Solid cube of 2 m flat on the ground.
fn at_rest() -> State {
    State::at_rest(Vector3::z())
}

/// Push by the fraction `part` of the friction limit. It acts at the height of the ground, so that
/// all corners carry the same force.
fn push(world: &World, part: f64) -> Wrench {
    let weight = world.bodies()[0].mass() * -world.gravity()[2];
    let force = part * 0.3 * weight;
    Wrench { force: Vector3::x() * force, torque: Vector3::y() * -force }
}

fn solved(
    solver: &mut NativeSolver,
    world: &World,
    wrench: &Wrench,
    past: (&StepSolution, Option<&StepSolution>),
) -> (StepReport, StepSolution, Vec<ContactPiece>) {
    let state = at_rest();
    let touching = contacts(world, &state);
    let touching: Vec<_> = touching.into_iter().filter(|contact| contact.gap <= 0.0).collect();
    assert_eq!(touching.len(), 4);
    let (report, solution) = solve_after(solver, world, (&state, wrench), &touching, past);
    (report, solution, solver.pieces())
}

/// Checks the margins of a pushed block. The projection argument of a sticking corner is w_t h
/// F/4m. Its cone allows w_t μ h g/4.
#[test]
fn a_push_brings_a_stuck_block_to_its_cone_and_over_it() {
    let world = cube_world(SOLID);
    let mut solver = NativeSolver::new(&world);
    assert_eq!(solver.pieces(), []);
    let start = StepSolution::free(&[at_rest()]);
    let mut margins = |part: f64| {
        let (_, solution, pieces) =
            solved(&mut solver, &world, &push(&world, part), (&start, None));
        assert_eq!(pieces.len(), 4);
        let expected = if part < 1.0 { MapPiece::Stick } else { MapPiece::Slip };
        assert!(pieces.iter().all(|at| at.piece == expected), "{part}: {pieces:?}");
        (pieces[0].margin, solution)
    };
    let (alone, _) = margins(0.0);
    for part in [0.3, 0.9, 0.999] {
        let (margin, _) = margins(part);
        // The compliance 1e-6 of the selection rule changes the projection argument by a relative
        // 1e-6.
        assert!((margin / alone - (1.0 - part)).abs() < 1e-5, "{part}: {margin} of {alone}");
    }
    // Beyond the limit the excess force moves the block. The margin is then its slip: at least w_t
    // h F/4m beyond the cone, growing with the excess.
    let (just, _) = margins(1.001);
    let (far, solution) = margins(2.0);
    assert!(just > 0.0 && far > 100.0 * just, "{just} {far}");
    assert!(solution.contacts[0].slip[0] > 0.0);
}

/// Checks that impulses accepted from the last step also have pieces.
#[test]
fn settled_impulses_have_their_pieces() {
    let world = cube_world(SOLID);
    let mut solver = NativeSolver::new(&world);
    let (start, wrench) = (StepSolution::free(&[at_rest()]), push(&world, 0.5));
    let (first, solution, expected) = solved(&mut solver, &world, &wrench, (&start, None));
    assert!(first.iterations > 0);
    let past = (&solution, Some(&solution));
    let (again, _, pieces) = solved(&mut solver, &world, &wrench, past);
    assert_eq!(again.iterations, 0);
    for (at, expected) in pieces.iter().zip(&expected) {
        assert_eq!(at.piece, expected.piece);
        assert!((at.margin - expected.margin).abs() <= 1e-9 * expected.margin);
    }
}

/// Checks a candidate that stays open. Its margin is its gap speed.
#[test]
fn separating_contact_is_open_by_its_gap_speed() {
    let world = cube_world(SOLID);
    let mut solver = NativeSolver::new(&world);
    let mut state = at_rest();
    state.velocity[2] = 3.0;
    let touching = contacts(&world, &state);
    let free = StepSolution::free(&[state]);
    let past = (&free, None);
    solve_after(&mut solver, &world, (&state, &Wrench::zero()), &touching, past);
    let (pieces, h) = (solver.pieces(), world.time_step());
    for (at, contact) in pieces.iter().zip(&touching) {
        let speed = 3.0 + h * world.gravity()[2] + contact.gap / h;
        assert_eq!(at.piece, MapPiece::Open);
        assert!((at.margin - speed).abs() < 1e-12 * speed, "{} {speed}", at.margin);
    }
}
