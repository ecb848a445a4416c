//! Wrong certificates are rejected.

use super::{GRAVITY, Scene};
use nalgebra::Vector3;
use tumble::statics::{ForceState, Limit, LoadCase, Mechanism, Structure, Verdict};

/// A block of 2 kg on another one, and the limit of a push on the upper one.
fn pushed() -> (Structure, LoadCase, f64, ForceState, Mechanism) {
    let mut scene = Scene::new(0.5);
    scene.add_box(2.0, [0.2, 0.2, 0.1], [0.0, 0.0, 0.1]).add_box(
        2.0,
        [0.1, 0.1, 0.1],
        [0.0, 0.0, 0.3],
    );
    let structure = scene.structure();
    let case = LoadCase::push(&structure, 1, Vector3::x(), Vector3::zeros()).unwrap();
    match structure.largest_factor(&case) {
        Limit::Factor { lower, forces, mechanism, .. } => {
            (structure, case, lower, forces, mechanism)
        }
        other => panic!("{}", other.name()),
    }
}

#[test]
fn certificates_of_a_limit_hold_at_it_and_not_elsewhere() {
    let (structure, case, factor, forces, mechanism) = pushed();
    let at = |factor: f64| structure.loads().plus(factor, &case);
    assert!((factor - 0.5 * 2.0 * GRAVITY).abs() < 1e-6 * factor, "{factor}");
    assert!(structure.check_forces(&forces, &at(factor)).holds);
    assert!(!structure.check_forces(&forces, &at(1.001 * factor)).holds);
    assert!(structure.check_mechanism(&mechanism, &at(factor * (1.0 + 1e-6))).holds);
    assert!(!structure.check_mechanism(&mechanism, &at(0.999 * factor)).holds);
}

#[test]
fn planted_forces_are_rejected() {
    let (structure, case, factor, forces, _) = pushed();
    let loads = structure.loads().plus(factor, &case);
    let plant = |change: &dyn Fn(&mut ForceState)| {
        let mut planted = forces.clone();
        change(&mut planted);
        structure.check_forces(&planted, &loads)
    };
    for contact in 0..forces.contacts.len() {
        // A force that pulls, one outside of its cone, one that breaks the balance.
        let normal = structure.contacts()[contact].normal;
        assert!(!plant(&|of| of.contacts[contact].force = -normal).holds);
        let outside = plant(&|of| of.contacts[contact].force += Vector3::y() * 100.0);
        assert!(!outside.holds && outside.cone_margin < 0.0);
        let heavy = plant(&|of| of.contacts[contact].force += normal * 1e-3);
        assert!(!heavy.holds && (1e-3..3e-3).contains(&heavy.imbalance), "{heavy:?}");
        assert!(!plant(&|of| of.contacts[contact].moment = normal * 1e-3).holds);
        assert!(!plant(&|of| of.contacts[contact].force.x = f64::NAN).holds);
    }
    assert!(!plant(&|of| of.contacts.truncate(1)).holds);
}

#[test]
fn planted_mechanisms_are_rejected() {
    let (structure, case, factor, _, mechanism) = pushed();
    let loads = structure.loads().plus(1.001 * factor, &case);
    assert!(structure.check_mechanism(&mechanism, &loads).holds);
    let plant = |change: &dyn Fn(&mut Mechanism)| {
        let mut planted = mechanism.clone();
        change(&mut planted);
        structure.check_mechanism(&planted, &loads).holds
    };
    // Sinking, sliding without dilation, no motion, backwards.
    assert!(!plant(&|of| of.velocities[1].linear.z -= 1e-3));
    assert!(!plant(&|of| of.velocities[1].linear.x += 1e-3));
    assert!(!plant(&|of| *of = of.times(0.0)));
    assert!(!plant(&|of| *of = of.times(-1.0)));
    assert!(!plant(&|of| of.velocities[1].angular.y = f64::NAN));
    assert!(!plant(&|of| of.velocities.truncate(1)));
}

#[test]
fn held_bodies_do_not_move_in_a_mechanism() {
    let mut scene = Scene::new(0.5);
    scene.has_ground = false;
    scene.add_box(1.0, [0.2; 3], [0.0, 0.0, 0.2]).add_box(1.0, [0.2; 3], [3.0, 0.0, 0.0]);
    let world = scene.world().with_held(0, true).unwrap();
    let structure = Structure::at_rest(&world, &scene.states, &[]).unwrap().0;
    let Verdict::None(mut mechanism) = structure.verdict() else { panic!("it falls") };
    assert!(structure.check_mechanism(&mechanism, structure.loads()).holds);
    mechanism.velocities[0].linear.z = -0.1;
    assert!(!structure.check_mechanism(&mechanism, structure.loads()).holds);
    let world = world.with_held(1, true).unwrap();
    let structure = Structure::at_rest(&world, &scene.states, &[]).unwrap().0;
    assert!(matches!(structure.verdict(), Verdict::Equilibrium(_)));
    let push = LoadCase::push(&structure, 0, Vector3::x(), Vector3::zeros()).unwrap();
    assert!(matches!(structure.largest_factor(&push), Limit::Unlimited(_)));
}
