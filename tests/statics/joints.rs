//! Forces of joints and motors at rest.

use super::{GRAVITY, Scene, assert_close};
use nalgebra::Vector3;
use tumble::statics::{LoadCase, Structure, Verdict};
use tumble::{Drive, Gear, GearAxis, Joint, JointFrame, Motor};

/// Slide of a body in the world along `axis`, with a constant force along it.
pub fn slide(body: usize, place: &Vector3<f64>, axis: &Vector3<f64>, force: f64) -> Joint {
    let frames = [Vector3::zeros(), *place].map(|at| JointFrame::along(at, *axis).unwrap());
    Joint::prismatic(body, None, frames, Drive { force, ..Drive::NONE })
}

/// A rod of 1 kg and 2 m on a hinge at its end, level, with a drive. Returns its structure.
fn lever(drive: Drive) -> Structure {
    let mut scene = Scene::new(0.5);
    scene.has_ground = false;
    scene.add_box(1.0, [1.0, 0.05, 0.05], [1.0, 0.0, 0.0]);
    let frames = [Vector3::new(-1.0, 0.0, 0.0), Vector3::zeros()]
        .map(|at| JointFrame::along(at, -Vector3::y()).unwrap());
    let world = scene.world().with_joints(vec![Joint::revolute(0, None, frames, drive)]).unwrap();
    Structure::at_rest(&world, &scene.states, &[]).unwrap().0
}

/// Largest additional weight at the end of the lever (N); `None` if it falls without.
fn carried(drive: Drive) -> Option<f64> {
    let structure = lever(drive);
    let end = Vector3::new(1.0, 0.0, 0.0);
    match structure.verdict() {
        Verdict::None(_) => None,
        Verdict::Equilibrium(_) => {
            let case = LoadCase::push(&structure, 0, -Vector3::z(), end).unwrap();
            structure.largest_factor(&case).factor()
        }
        Verdict::Undecided => panic!("undecided"),
    }
}

#[test]
fn a_lever_is_held_by_friction_a_motor_or_a_stop() {
    let own = GRAVITY;
    let lasting = |torque: f64| (torque - own) / 2.0;
    assert_eq!(carried(Drive::NONE), None);
    assert_eq!(carried(Drive { friction: 0.9 * own, ..Drive::NONE }), None);
    let rubbing = Drive { friction: 1.5 * own, static_friction: Some(2.0 * own), ..Drive::NONE };
    assert_close(carried(rubbing).unwrap(), lasting(2.0 * own), 1e-6);
    let motor = Motor::Speed { target: 0.0, max_force: 3.0 * own };
    let held = Drive { motor: Some(motor), ..Drive::NONE };
    assert_close(carried(held).unwrap(), lasting(3.0 * own), 1e-6);
    // A spring and a motor with a target push with the force that they have at rest.
    let (stiffness, target, max_force) = (30.0, 2.0, 1.2 * own);
    let spring = Drive { stiffness, rest: 0.2, friction: 1.3 * own, ..Drive::NONE };
    assert_close(carried(spring).unwrap(), lasting(6.0 + 1.3 * own), 1e-6);
    let pushes = Motor::Position { target, stiffness, damping: 1.0, max_force };
    let driven = Drive { motor: Some(pushes), friction: 1.1 * own, ..Drive::NONE };
    assert_close(carried(driven).unwrap(), lasting(2.3 * own), 1e-6);
    let stopped = Drive { limits: Some([0.0, 1.0]), ..Drive::NONE };
    let structure = lever(stopped);
    assert!(matches!(structure.verdict(), Verdict::Equilibrium(_)));
    assert!(matches!(
        lever(Drive { limits: Some([-0.1, 1.0]), ..stopped }).verdict(),
        Verdict::None(_)
    ));
}

#[test]
fn a_gear_balances_two_links_that_share_a_body() {
    // A level link on a hinge of the world, and one on its end, of 1 kg and 2 m each. Gravity does the
    // work −m g (4 dq₁ + dq₂), which vanishes for q₁ = −q₂/4.
    let chain = |ratio: f64| {
        let mut scene = Scene::new(0.5);
        scene.has_ground = false;
        for x in [1.0, 3.0] {
            scene.add_box(1.0, [1.0, 0.05, 0.05], [x, 0.0, 0.0]);
        }
        let frames = |places: [f64; 2]| {
            places.map(|x| JointFrame::along(Vector3::x() * x, -Vector3::y()).unwrap())
        };
        let rubbing = Drive { friction: 6.0, ..Drive::NONE };
        let first = Joint::revolute(0, None, frames([-1.0, 0.0]), rubbing);
        let second = Joint::revolute(1, Some(0), frames([-1.0, 1.0]), Drive::NONE);
        let gear = Gear::new(GearAxis::new(0, 5), GearAxis::new(1, 5), ratio, 0.0);
        let world = scene.world().with_joints(vec![first, second]).unwrap();
        let world = world.with_gears(vec![gear]).unwrap();
        Structure::at_rest(&world, &scene.states, &[]).unwrap().0
    };
    assert!(matches!(chain(-0.5).verdict(), Verdict::None(_)));
    let structure = chain(-0.25);
    let end = Vector3::new(1.0, 0.0, 0.0);
    let case = LoadCase::push(&structure, 0, -Vector3::z(), end).unwrap();
    // Friction of the first hinge carries F (2 m).
    assert_close(structure.largest_factor(&case).factor().unwrap(), 3.0, 1e-6);
}
