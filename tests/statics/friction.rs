//! Smallest friction, and the worst case of a range of friction.

use super::{GRAVITY, Scene, assert_close, stands};
use nalgebra::Vector3;
use tumble::statics::{FrictionLimit, LoadCase, Structure};
use tumble::{Coefficient, Partner};

#[test]
fn a_stack_stands_without_friction_and_a_slope_does_not() {
    let mut scene = Scene::new(0.3);
    scene.add_box(1.0, [0.1; 3], [0.0, 0.0, 0.1]).add_box(1.0, [0.1; 3], [0.0, 0.0, 0.3]);
    assert!(matches!(scene.structure().smallest_friction(), FrictionLimit::Frictionless(_)));
    let structure = scene.structure();
    let tilt = LoadCase::tilt(&structure, Vector3::y()).unwrap();
    let wrench = tumble::Wrench {
        force: Vector3::new(tilt.wrenches[1].linear.x * 0.2, 0.0, 0.0),
        torque: Vector3::zeros(),
    };
    let world = scene.world();
    let pushed = [tumble::Wrench::zero(), wrench];
    let structure = Structure::at_rest(&world, &scene.states, &pushed).unwrap().0;
    assert_close(0.3 * structure.smallest_friction().factor().unwrap(), 0.2, 3e-6);
}

#[test]
fn the_worst_friction_is_the_smallest_in_every_pair() {
    let mut scene = Scene::new(0.4);
    scene.add_box(1.0, [0.1; 3], [0.0, 0.0, 0.1]);
    let structure = scene.structure();
    let worst = structure.worst_friction(0.3, 0.5).unwrap();
    assert_eq!(worst.len(), 1);
    let case = LoadCase::push(&structure, 0, Vector3::x(), Vector3::new(0.0, 0.0, -0.05)).unwrap();
    let factor = worst[0].largest_factor(&case).factor().unwrap();
    assert_close(factor, 0.3 * GRAVITY, 1e-6);
}

#[test]
fn friction_of_a_moving_surface_is_a_load() {
    // A block on a belt that drags it against a fixed block: more friction presses more.
    let mut scene = Scene::new(0.4);
    scene.add_box(1.0, [0.1; 3], [0.0, 0.0, 0.1]);
    let wall = tumble::Piece::cuboid(Vector3::new(0.1, 1.0, 1.0)).unwrap();
    let turn = nalgebra::Matrix3::identity();
    scene.fixed.push(wall.moved_by(&turn, &Vector3::new(0.2, 0.0, 0.0)).unwrap());
    let world = scene.world().with_surface(Partner::Ground, Vector3::x()).unwrap();
    let structure = Structure::at_rest(&world, &scene.states, &[]).unwrap().0;
    assert!(stands(&structure));
    assert_eq!(structure.worst_friction(0.2, 0.5).unwrap().len(), 2);
    // A pull away from the wall is held by the belt: μ m g.
    let case = LoadCase::push(&structure, 0, -Vector3::x(), Vector3::zeros()).unwrap();
    let factors = structure.worst_friction(0.2, 0.5).unwrap();
    let factors: Vec<_> =
        factors.iter().map(|of| of.largest_factor(&case).factor().unwrap()).collect();
    assert_close(factors[0], 0.2 * GRAVITY, 1e-6);
    assert_close(factors[1], 0.5 * GRAVITY, 1e-6);
    // Against the belt's motion alone nothing stands.
    scene.fixed.clear();
    let world = scene.world().with_surface(Partner::Ground, Vector3::x()).unwrap();
    assert!(!stands(&Structure::at_rest(&world, &scene.states, &[]).unwrap().0));
}

#[test]
fn static_rolling_and_torsional_friction_hold_a_body_at_rest() {
    let mut scene = Scene::new(0.3);
    scene.add_box(1.0, [0.1; 3], [0.0, 0.0, 0.1]);
    let world = scene.world().with_coefficient(Coefficient::StaticFriction, 0.45).unwrap();
    let largest = |world: &tumble::World, states: &[tumble::State], point: Vector3<f64>| {
        let structure = Structure::at_rest(world, states, &[]).unwrap().0;
        let case = LoadCase::push(&structure, 0, Vector3::x(), point).unwrap();
        structure.largest_factor(&case).factor().unwrap()
    };
    let low = Vector3::new(0.0, 0.0, -0.1);
    assert_close(largest(&world, &scene.states, low), 0.45 * GRAVITY, 1e-6);
    // A ball that is pushed at its centre rolls from ρ m g/r on.
    let ball = tumble::Piece::sphere(0.2).unwrap();
    let mut scene = Scene::new(0.5);
    scene.add(tumble::RigidBody::solid(1.0, &[ball]).unwrap().0, [0.0, 0.0, 0.2]);
    let world = scene.world().with_coefficient(Coefficient::RollingFriction, 0.01).unwrap();
    let world = world.with_coefficient(Coefficient::TorsionalFriction, 0.003).unwrap();
    assert_close(largest(&world, &scene.states, Vector3::zeros()), 0.01 * GRAVITY / 0.2, 1e-6);
    let structure = Structure::at_rest(&world, &scene.states, &[]).unwrap().0;
    let mut twist = LoadCase::none(1);
    twist.wrenches[0].angular.z = 1.0;
    assert_close(structure.largest_factor(&twist).factor().unwrap(), 0.003 * GRAVITY, 1e-6);
}

#[test]
fn friction_that_depends_on_the_direction() {
    let mut scene = Scene::new(0.5);
    scene.add_box(1.0, [0.1; 3], [0.0, 0.0, 0.1]);
    let world = scene.world().with_friction_axis(Partner::Ground, Vector3::x(), 0.4).unwrap();
    let structure = Structure::at_rest(&world, &scene.states, &[]).unwrap().0;
    for angle in [0.0, 0.5, std::f64::consts::FRAC_PI_2] {
        let push = Vector3::new(f64::cos(angle), f64::sin(angle), 0.0);
        let low = Vector3::new(0.0, 0.0, -0.1);
        let case = LoadCase::push(&structure, 0, push, low).unwrap();
        let factor = structure.largest_factor(&case).factor().unwrap();
        let expected = 0.5 * GRAVITY / (push.x / 0.4).hypot(push.y);
        assert_close(factor, expected, 1e-6);
    }
}
