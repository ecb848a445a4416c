//! Adding, removing and holding bodies during a simulation. The remaining bodies follow the
//! physics, and bodies without contact to the changed one are unaffected to the last bit.

use crate::common::prelude::*;

const SIDE: f64 = 0.2;

fn cube() -> RigidBody {
    RigidBody::solid_box(2.0, Vector3::repeat(0.5 * SIDE)).unwrap()
}

fn world(bodies: usize) -> World {
    euler(Parameters::new(vec![cube(); bodies]))
}

fn simulation(states: &[State]) -> Simulation<'static> {
    let world = world(states.len());
    let motion = Motion::native(&world);
    Simulation::new(world, states.to_vec(), motion).unwrap()
}

fn solved(simulation: &mut Simulation<'_>, count: usize) -> Vec<StepRecord> {
    let statuses = [StepStatus::Free, StepStatus::Converged, StepStatus::Retried];
    steps(simulation, count, |record| statuses.contains(&record.status()))
}

/// Stack of cubes with small lateral offsets.
fn stack(height: usize) -> Vec<State> {
    let cube = |level: usize| {
        let aside = 0.01 * (level % 2) as f64;
        State::at_rest([aside, -0.5 * aside, SIDE * (level as f64 + 0.5)])
    };
    (0..height).map(cube).collect()
}

/// Bits of all body states except those of `skipped`.
fn motion(record: &StepRecord, skipped: Option<usize>) -> Vec<u64> {
    let states = record.next_states().iter().enumerate();
    let states = states.filter(|(body, _)| Some(*body) != skipped);
    states.flat_map(|(_, state)| state.to_vector().map(f64::to_bits).as_slice().to_vec()).collect()
}

#[test]
fn removing_a_distant_body_changes_no_other() {
    for place in [0, 2, 5] {
        let mut states = stack(5);
        states.insert(place, State::at_rest([7.0, 3.0, 0.5 * SIDE]));
        let (mut with, mut without) = (simulation(&states), simulation(&states));
        for run in [&mut with, &mut without] {
            solved(run, 40);
        }
        let (_, state) = without.remove_body(place).unwrap();
        assert_eq!(state, with.states()[place]);
        assert_eq!(without.world().bodies().len(), 5);
        for (with, without) in solved(&mut with, 60).iter().zip(&solved(&mut without, 60)) {
            assert_eq!(motion(with, Some(place)), motion(without, None), "{}", with.index);
            assert!(without.report().iterations <= with.report().iterations, "{}", with.index);
            let forces = |record: &StepRecord, skipped: Option<usize>| -> Vec<_> {
                let contacts = record.first().solution.contacts.iter();
                contacts.filter(|c| Some(c.key.body) != skipped).map(|c| c.force).collect()
            };
            assert_eq!(forces(with, Some(place)), forces(without, None));
        }
    }
}

#[test]
fn adding_a_distant_body_changes_no_other() {
    let states = stack(5);
    let (mut with, mut without) = (simulation(&states), simulation(&states));
    for run in [&mut with, &mut without] {
        solved(run, 40);
    }
    let drop = State::at_rest([7.0, 3.0, 1.0]);
    assert_eq!(with.add_body(cube(), drop).unwrap(), 5);
    for (with, without) in solved(&mut with, 60).iter().zip(&solved(&mut without, 60)) {
        assert_eq!(motion(with, Some(5)), motion(without, None), "{}", with.index);
    }
    // Fall h g Σ k of the scheme from rest.
    let fallen = 9.81 * 0.002 * 0.002 * (60.0 * 61.0 / 2.0);
    assert!((with.states()[5].position[2] - (1.0 - fallen)).abs() < 1e-12);
}

#[test]
fn a_body_that_is_put_on_a_stack_presses_on_it() {
    let mut run = simulation(&stack(3));
    solved(&mut run, 40);
    let top = run.states()[2].position;
    let new = run.add_body(cube(), State::at_rest([top[0], top[1], top[2] + SIDE])).unwrap();
    let record = solved(&mut run, 20).pop().unwrap();
    let weight = 2.0 * 9.81;
    assert!((record.first().solution.total_force(new)[2] - weight).abs() < 1e-6 * weight);
    let ground =
        record.first().solution.contacts.iter().filter(|c| c.key.partner == Partner::Ground);
    let carried: f64 = ground.map(|contact| contact.force[2]).sum();
    assert!((carried - 4.0 * weight).abs() < 1e-6 * weight, "{carried}");
}

#[test]
fn removing_a_support_drops_its_load() {
    let mut run = simulation(&stack(4));
    solved(&mut run, 40);
    run.remove_body(1).unwrap();
    let record = solved(&mut run, 1).pop().unwrap();
    for (body, falls) in [(0, false), (1, true), (2, true)] {
        let speed = record.next_states()[body].velocity[2];
        let expected = if falls { -9.81 * 0.002 } else { 0.0 };
        assert!((speed - expected).abs() < 1e-9, "{body}: {speed}");
    }
    // The stack comes to rest one level lower.
    let last = solved(&mut run, 400).pop().unwrap();
    for (body, level) in [0.5, 1.5, 2.5].into_iter().enumerate() {
        assert!((last.next_states()[body].position[2] - SIDE * level).abs() < 1e-3, "{body}");
    }
}

#[test]
fn loads_go_with_their_bodies() {
    let apart: Vec<_> =
        (0..4).map(|body| State::at_rest([f64::from(body), 0.0, 0.5 * SIDE])).collect();
    let mut run = simulation(&apart);
    let force = Polyline::constant([30.0, 0.0, 0.0].into()).unwrap();
    run.set_load(2, Load::new(force, Polyline::default(), Vector3::zeros()).unwrap()).unwrap();
    solved(&mut run, 3);
    run.remove_body(0).unwrap();
    let last = solved(&mut run, 10).pop().unwrap();
    // Speed (F/m − μ g) h after 13 steps.
    let speed = (15.0 - 0.5 * 9.81) * 0.002 * 13.0;
    assert!((last.next_states()[1].velocity[0] - speed).abs() < 1e-9);
    assert!(last.next_states()[2].velocity.norm() < 1e-12);
}

#[test]
fn a_body_that_is_held_stays_and_touches_nothing_until_it_is_let_go() {
    let mut run = simulation(&stack(4));
    solved(&mut run, 40);
    let (there, top) = (run.states()[1], run.states()[3].position[2]);
    run.hold_body(1, true).unwrap();
    let mut last = StepRecord::new();
    for record in solved(&mut run, 60) {
        let state = record.next_states()[1];
        assert_eq!((state.position, state.attitude), (there.position, there.attitude));
        assert!(
            record
                .first()
                .contacts
                .iter()
                .all(|contact| contact.key.bodies().all(|body| body != 1))
        );
        assert_eq!(record.residual().max(1e-9), 1e-9);
        last = record;
    }
    // The bodies above have begun to fall through it.
    assert!(last.next_states()[3].position[2] < top - 0.01);
    let Error::Overlap { .. } = run.hold_body(1, false).unwrap_err() else {
        panic!("it would be let go inside another one");
    };
    assert!(run.world().is_held(1));
    for body in [2, 3] {
        let state = State { position: [5.0 + body as f64, 0.0, 3.0].into(), ..run.states()[body] };
        run.set_state(body, state).unwrap();
    }
    run.hold_body(1, false).unwrap();
    let record = solved(&mut run, 30).pop().unwrap();
    assert!((record.next_states()[1].position - there.position).norm() < 1e-6);
    let weight = 2.0 * 9.81;
    assert!((record.first().solution.total_force(1)[2] - weight).abs() < 1e-6 * weight);
}

#[test]
fn a_body_that_floats_is_held_too() {
    let world = world(2);
    let world = euler(Parameters { ground: None, ..world.parameters().clone() });
    let states = [State::at_rest([0.0, 0.0, 1.0]), State::at_rest([3.0, 0.0, 1.0])];
    let mut run = Simulation::new(world, states, Motion::Floating).unwrap();
    run.hold_body(0, true).unwrap();
    let last = solved(&mut run, 20).pop().unwrap();
    assert_eq!(last.next_states()[0], states[0]);
    assert!(last.next_states()[1].position[2] < 1.0);
    assert!(last.residual() < 1e-12);
}

#[test]
fn joint_holds_its_bodies_until_removed() {
    let frames = [
        JointFrame::at([0.5 * SIDE, 0.0, 0.0].into()),
        JointFrame::at([-0.5 * SIDE, 0.0, 0.0].into()),
    ];
    let tied = world(3).with_joints(vec![Joint::spherical(1, Some(2), frames)]).unwrap();
    let states = [0.0, 1.0, 1.0 + SIDE].map(|x| State::at_rest([x, 0.0, 0.5 * SIDE]));
    let motion = Motion::native(&tied);
    let mut run = Simulation::new(tied, states, motion).unwrap();
    solved(&mut run, 5);
    for refused in [run.remove_body(2).err(), run.hold_body(1, true).err()] {
        assert!(matches!(refused, Some(Error::Tied { joint: 0, .. })), "{refused:?}");
    }
    // A body before the joint's bodies is removed, and the joint connects the same bodies under
    // their new indices.
    run.remove_body(0).unwrap();
    assert_eq!((run.world().joints()[0].body(), run.world().joints()[0].other()), (0, Some(1)));
    solved(&mut run, 5);
    assert!(matches!(run.remove_body(1), Err(Error::Tied { body: 1, joint: 0 })));
    run.remove_body_and_joints(1).unwrap();
    assert!(run.world().joints().is_empty());
    solved(&mut run, 5);
    assert!(run.remove_body(0).is_err(), "the last one");
}

#[test]
fn invalid_changes_of_bodies_are_rejected_and_change_nothing() {
    let states = stack(4);
    let (mut run, mut undisturbed) = (simulation(&states), simulation(&states));
    for run in [&mut run, &mut undisturbed] {
        solved(run, 20);
    }
    assert!(matches!(
        run.add_body(cube(), State::at_rest([0.0, 0.0, 0.3])),
        Err(Error::Overlap { .. })
    ));
    assert!(matches!(
        run.add_body(cube(), State::at_rest([3.0, 0.0, -0.3])),
        Err(Error::StartBelowGround { .. })
    ));
    assert!(run.remove_body(4).is_err());
    assert!(run.hold_body(4, true).is_err());
    assert_eq!(solved(&mut run, 30), solved(&mut undisturbed, 30));
}

#[cfg(feature = "save")]
#[test]
fn held_and_added_bodies_survive_a_restore() {
    let mut run = simulation(&stack(4));
    solved(&mut run, 40);
    run.remove_body(0).unwrap();
    run.add_body(cube(), State::at_rest([3.0, 0.0, 0.5 * SIDE])).unwrap();
    run.hold_body(1, true).unwrap();
    solved(&mut run, 5);
    for held in [true, false] {
        let saved = run.save();
        let mut again = simulation(&stack(4));
        again.restore(&saved).unwrap();
        assert_eq!(again.world().is_held(1), held);
        assert_eq!(solved(&mut again, 20), solved(&mut run, 20));
        let away = State { position: [0.0, 8.0, 2.0].into(), ..run.states()[2] };
        if held {
            run.set_state(2, away).unwrap();
            run.hold_body(1, false).unwrap();
        }
    }
}
