//! Invalid steps for the solvers.

use super::{Panics, contact_lists, contacts_of, lists, tower, world_of};
use crate::common::prelude::*;

#[test]
fn a_step_of_any_lists_does_not_make_the_native_solver_panic() {
    look_at_solvers(&|world| vec![Box::new(NativeSolver::new(world))], &[1, 2], false);
}

#[test]
fn a_step_of_any_lists_makes_no_solver_of_ipopt_panic() {
    use tumble::solver::ipopt::{IpoptSolver, ladder_for};
    let options = || IpoptSolver::options(1e-6, 20);
    let solvers = |world: &World| -> Vec<Box<dyn StepSolver>> {
        vec![
            ladder_for(world, options()).unwrap(),
            Box::new(IpoptSolver::new(world, options()).unwrap()),
        ]
    };
    look_at_solvers(&solvers, &[1], true);
}

/// Passes invalid steps of worlds with these numbers of `bodies` to solvers. If `of_one_world` is
/// true, a solver accepts steps of its own world only.
fn look_at_solvers(
    solvers_for: &dyn Fn(&World) -> Vec<Box<dyn StepSolver>>,
    bodies: &[usize],
    of_one_world: bool,
) {
    let mut panics = Panics::default();
    for &bodies in bodies {
        let world_of = |bodies| {
            let world = world_of(bodies);
            // Ipopt's program has no restitution.
            if of_one_world {
                world.with_coefficient(Coefficient::Restitution, 0.0).unwrap()
            } else {
                world
            }
        };
        let world = world_of(bodies);
        let (good, wrenches) = (tower(bodies), vec![Wrench::zero(); bodies]);
        let mut free = good.clone();
        free.iter_mut().for_each(|state| state.position.z -= 0.01);
        let previous = StepSolution::free(&good);
        let step = Step {
            world: &world,
            states: &good,
            wrenches: &wrenches,
            free: &free,
            previous: &previous,
            earlier: None,
            interrupt: None,
        };
        let solve = |step: &Step<'_>, contacts: Vec<Contact>| {
            let solvers = solvers_for(&world).into_iter();
            let results = solvers.map(|mut solver| {
                let mut solution = StepSolution::default();
                solver.solve(step, &mut Candidates::from(contacts.clone()), &mut solution)
            });
            results.collect::<Vec<_>>()
        };
        let found = contacts_of(&world, &good);
        let mut refused = |name: &str, step: &Step<'_>, contacts: &[Contact]| {
            panics.look(name, || {
                for result in solve(step, contacts.to_vec()) {
                    assert!(result.is_err(), "{result:?}");
                }
            });
        };
        let (few, many) = (tower(bodies - 1), tower(bodies + 1));
        for list in [&few, &many] {
            refused("states", &Step { states: list, ..step }, &found);
            refused("free", &Step { free: list, ..step }, &found);
            let wrenches = vec![Wrench::zero(); list.len()];
            refused("wrenches", &Step { wrenches: &wrenches, ..step }, &found);
        }
        for contacts in &contact_lists(&world, bodies)[..3] {
            refused("contacts", &step, contacts);
        }
        let (other, states) = (world_of(bodies + 1), tower(bodies + 1));
        let (wrenches, previous) = (vec![Wrench::zero(); bodies + 1], StepSolution::free(&states));
        let free = &states;
        let of_other = Step {
            world: &other,
            states: &states,
            wrenches: &wrenches,
            free,
            previous: &previous,
            ..step
        };
        if of_one_world {
            refused("another world", &of_other, &contacts_of(&other, &states));
        }
        let nowhere = lists(bodies).pop().unwrap();
        panics.look("NaN", || drop(solve(&Step { states: &nowhere, ..step }, found.clone())));
        panics.look("NaN", || drop(solve(&Step { free: &nowhere, ..step }, found.clone())));
        for list in [few, many, nowhere] {
            let previous = StepSolution::free(&list);
            panics.look("previous", || {
                drop(solve(&Step { previous: &previous, ..step }, found.clone()));
            });
        }
    }
}
