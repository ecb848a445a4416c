//! Derivatives by constants of single bodies, pairs and joints. Coefficients are compared with
//! closed forms, anchors of every joint with central differences.

use super::draw::Draw;
use super::{Tally, compare, on_a_slope, step};
use crate::common::prelude::*;
use rand_mt::Mt;
use tumble_core::solver::native::StepGradient;

/// Component of the first body's δv along `way`, by one number of a constant, forwards and
/// backwards.
fn by_one(
    (world, states): &(World, Vec<State>),
    way: Vector3<f64>,
    (constant, place): (Constant, usize),
) -> f64 {
    let (simulation, base) = step(world, states, &[]).unwrap();
    let mut derivative = StepDerivative::new();
    simulation.linearise(&base, &mut derivative).unwrap();
    let mut numbers = vec![0.0; constant.width(world)];
    numbers[place] = 1.0;
    let (mut end, mut gradient) = (Vec::new(), StepGradient::default());
    let constants = [(constant, &numbers[..])];
    derivative
        .jvp(&StepChange { constants: &constants, ..StepChange::default() }, &mut end)
        .unwrap();
    let found = way.dot(&end[0].velocity);
    let mut by_end = vec![StateChange::zero(); states.len()];
    by_end[0].velocity = way;
    derivative.vjp(&by_end, &[constant], &mut gradient).unwrap();
    let back = gradient.constants[0][place];
    assert!((found - back).abs() < 1e-9, "{constant:?}: {found} {back}");
    found
}

/// Checks v⁺ = v + h g (sin α − μ cos α) by μ of the pair and by μ of the body. With the ground's
/// coefficient the latter enters as √(μ_a μ_b).
#[test]
fn sliding_velocity_derivative_by_pair_and_body_friction() {
    let (angle, h, g): (f64, f64, f64) = (0.5, 0.002, 9.81);
    let way = Vector3::new(angle.cos(), 0.0, -angle.sin());
    let by_friction = -h * g * angle.cos();
    let (world, states) = on_a_slope(angle, 0.3, 1.0);
    let close =
        |found: f64, expected: f64| assert!((found - expected).abs() < 1e-11, "{found} {expected}");
    let paired = world
        .clone()
        .with_coefficient_between(Coefficient::Friction, 0, Partner::Ground, 0.2)
        .unwrap();
    let scene = (paired, states.clone());
    close(by_one(&scene, way, (Constant::PairFriction, 0)), by_friction);
    close(by_one(&scene, way, (Constant::Friction, 0)), 0.0);
    let of_body = world.with_coefficient_of(Coefficient::Friction, Partner::Body(0), 0.1);
    let scene = (of_body.unwrap(), states);
    let (own, other) = (0.1, 0.3_f64);
    close(
        by_one(&scene, way, (Constant::BodyFriction, 0)),
        by_friction * 0.5 * (other / own).sqrt(),
    );
    close(by_one(&scene, way, (Constant::Friction, 0)), by_friction * 0.5 * (own / other).sqrt());
}

/// Checks a ball that arrives with v and leaves with e v: by e of the pair and of the body.
#[test]
fn a_bounce_by_restitution_of_its_own() {
    let ball = Piece::sphere(0.1).unwrap();
    let body = RigidBody::solid(2.0, &[ball]).unwrap().0;
    let ground = Plane::new(Vector3::z(), 0.0).unwrap();
    let parameters = Parameters {
        ground: Some(ground),
        gravity: Vector3::zeros(),
        friction: 0.3,
        ..Parameters::new(vec![body])
    };
    let states = vec![State {
        velocity: Vector3::new(0.0, 0.0, -3.0),
        ..State::at_rest(Vector3::new(0.0, 0.0, 0.101))
    }];
    let world = euler(parameters.clone()).with_coefficient(Coefficient::Restitution, 0.4).unwrap();
    let close =
        |found: f64, expected: f64| assert!((found - expected).abs() < 1e-9, "{found} {expected}");
    let paired = world
        .clone()
        .with_coefficient_between(Coefficient::Restitution, 0, Partner::Ground, 0.5)
        .unwrap();
    let scene = (paired, states.clone());
    close(by_one(&scene, Vector3::z(), (Constant::PairRestitution, 0)), 3.0);
    close(by_one(&scene, Vector3::z(), (Constant::Restitution, 0)), 0.0);
    let of_body = world.with_coefficient_of(Coefficient::Restitution, Partner::Body(0), 0.9);
    let scene = (of_body.unwrap(), states);
    close(
        by_one(&scene, Vector3::z(), (Constant::BodyRestitution, 0)),
        3.0 * 0.5 * (0.4_f64 / 0.9).sqrt(),
    );
    close(
        by_one(&scene, Vector3::z(), (Constant::Restitution, 0)),
        3.0 * 0.5 * (0.9_f64 / 0.4).sqrt(),
    );
}

/// Checks that each constant is written where it is read, and that a coefficient out of range is
/// refused.
#[test]
fn coefficients_are_set_where_they_are_read() {
    let (world, _) = on_a_slope(0.0, 0.3, 0.0);
    let mut parameters = world.parameters().clone();
    let body = parameters.bodies[0].clone();
    parameters.bodies = vec![body; 3];
    let plate = Piece::cuboid(Vector3::repeat(1.0)).unwrap();
    let mut world = euler(parameters).with_fixed(vec![plate]);
    for (of, owner, own) in [
        (Coefficient::Friction, Partner::Body(1), 0.1),
        (Coefficient::Restitution, Partner::Body(1), 0.2),
        (Coefficient::Friction, Partner::Body(2), 0.4),
        (Coefficient::Restitution, Partner::Fixed(0), 0.1),
    ] {
        world = world.with_coefficient_of(of, owner, own).unwrap();
    }
    let world =
        world.with_coefficient_between(Coefficient::Friction, 2, Partner::Body(0), 0.6).unwrap();
    let world =
        world.with_coefficient_between(Coefficient::Restitution, 0, Partner::Ground, 0.7).unwrap();
    for (constant, own, new) in [
        (Constant::BodyFriction, vec![0.1, 0.4], vec![0.2, 0.5]),
        (Constant::BodyRestitution, vec![0.2], vec![0.3]),
        (Constant::FixedFriction, vec![], vec![]),
        (Constant::FixedRestitution, vec![0.1], vec![0.4]),
        (Constant::PairFriction, vec![0.6], vec![0.8]),
        (Constant::PairRestitution, vec![0.7], vec![0.9]),
    ] {
        assert_eq!(constant.values(&world), own);
        assert_eq!(constant.shape(&world), [own.len()]);
        let set = world.with_constants(&[(constant, &new)]).unwrap();
        assert_eq!(constant.values(&set), new);
        assert_eq!(Constant::Friction.values(&set), [0.3]);
        let wide = vec![11.0; own.len()];
        assert_eq!(world.with_constants(&[(constant, &wide)]).is_err(), !own.is_empty());
    }
    let set = world.with_constants(&[(Constant::BodyFriction, &[0.2, 0.5])]).unwrap();
    assert_eq!(set.friction_between(2, Partner::Body(1)), 0.1_f64.sqrt());
    assert_eq!(set.friction_between(2, Partner::Body(0)), 0.6);
    let both: [(Constant, &[f64]); 2] =
        [(Constant::PairFriction, &[0.5]), (Constant::Friction, &[0.2])];
    let set = world.with_constants(&both).unwrap();
    assert_eq!([set.friction_between(0, Partner::Body(2)), set.friction()], [0.5, 0.2]);
    assert!(world.with_constants(&both[1..]).is_err());
}

/// Every kind of joint, between two bodies or between a body and the world.
fn kinds(
    body: usize,
    other: Option<usize>,
    frames: [JointFrame; 2],
    draw: &mut Draw,
) -> Vec<Joint> {
    let motor = Motor::Position { target: 0.4, stiffness: 30.0, damping: 2.0, max_force: 1e3 };
    let drive = Drive {
        stiffness: 20.0 + 5.0 * draw.unit(),
        damping: 1.0,
        armature: 0.3,
        motor: Some(motor),
        ..Drive::NONE
    };
    let free = Axis::Free(drive);
    let revolute = Joint::revolute(body, other, frames, drive);
    vec![
        Joint::fixed(body, other, frames),
        Joint::prismatic(body, other, frames, drive),
        Joint::cylindrical(body, other, frames, [drive, drive]),
        Joint::planar(body, other, frames),
        Joint::spherical(body, other, frames),
        Joint::ball(body, other, frames, 1.0, drive),
        Joint::universal(body, other, frames),
        Joint::gimbal(body, other, frames, [drive; 3]),
        revolute.clone().with_axes([free, Axis::Locked, free], [Axis::Locked; 3]),
        revolute,
    ]
}

/// Frame of a body at `state` that coincides with `frame` of the world.
pub(super) fn seen_from(state: &State, frame: &JointFrame) -> JointFrame {
    let anchor = state.pose().rotation.tr_mul(&(frame.anchor - state.position));
    let back = Vector4::new(1.0, -1.0, -1.0, -1.0).component_mul(&state.attitude);
    JointFrame { anchor, attitude: left(&back) * frame.attitude }
}

/// Checks the derivatives by anchors for two moving bodies. Any kind of joint ties the first to the
/// world and the second to the first. Another case is two carriages on slides with a gear.
#[test]
fn every_joint_by_its_anchors() {
    let mut draw = Draw(Mt::new(5));
    let mut tally = Tally::default();
    for number in 0..24 {
        let mut state = || State {
            position: draw.vector(0.5),
            attitude: draw.attitude(),
            velocity: draw.vector(1.0),
            spin: draw.vector(3.0),
        };
        let states = vec![state(), state()];
        let at = [0; 2].map(|_| JointFrame { anchor: draw.vector(0.7), attitude: draw.attitude() });
        let half = [0; 2].map(|_| Vector3::repeat(0.1) + draw.vector(0.05));
        let bodies = half.map(|half| RigidBody::solid_box(1.5 + draw.unit(), half).unwrap());
        let parameters = Parameters {
            bodies: bodies.to_vec(),
            ground: None,
            gravity: draw.vector(10.0),
            friction: 0.3,
            time_step: 0.005,
            rotation: if number % 2 == 0 { Rotation::Momentum } else { Rotation::Tutorial },
        };
        let world = euler(parameters);
        let to_world = [seen_from(&states[0], &at[0]), at[0]];
        let between = [seen_from(&states[1], &at[1]), seen_from(&states[0], &at[1])];
        let world = if number < 20 {
            let first = kinds(0, None, to_world, &mut draw).remove(number % 10);
            let second =
                kinds(1, Some(0), between, &mut draw).remove((number * 3 + number / 10) % 10);
            world.with_joints(vec![first, second]).unwrap()
        } else {
            let other = [seen_from(&states[1], &at[1]), at[1]];
            let slides = [(0, to_world), (1, other)];
            let slides =
                slides.map(|(body, frames)| Joint::prismatic(body, None, frames, Drive::NONE));
            let axis = |joint| GearAxis { joint, axis: JointAxis::Linear(2) };
            let gear = Gear::new(axis(0), axis(1), -1.5, 0.0);
            world.with_joints(slides.to_vec()).unwrap().with_gears(vec![gear]).unwrap()
        };
        compare(&world, &states, &mut || draw.unit(), &format!("mechanism {number}"), &mut tally);
    }
    println!(
        "{} compared, {} left out, {} kinks, worst {:.1e}",
        tally.compared, tally.left_out, tally.kinks, tally.worst
    );
    assert!(tally.missed.is_empty(), "{}", tally.missed.join("\n"));
    assert!(tally.compared > 8 * 24 && tally.kinks == 0 && tally.scattered == 0);
}

/// Checks a body fixed to the world, which follows its anchors: δv = −A δa_A/h and δv = δa_B/h.
#[test]
fn body_fixed_to_the_world_follows_its_anchors() {
    let (world, _) = on_a_slope(0.0, 0.3, 0.0);
    let mut parameters = world.parameters().clone();
    parameters.ground = None;
    let turn = Vector4::new(0.4, -0.7, 0.3, 0.5).normalize();
    let state = State { attitude: turn, ..State::at_rest(Vector3::new(0.3, 0.2, 0.1)) };
    let at = JointFrame::at(Vector3::new(0.2, 0.4, -0.1));
    let joint = Joint::fixed(0, None, [seen_from(&state, &at), at]);
    let world = euler(parameters).with_joints(vec![joint]).unwrap();
    let rotation: Matrix3<f64> = state.pose().rotation;
    let scene = (world, vec![state]);
    for way in 0..3 {
        let along = Vector3::ith(way, 1.0);
        for k in 0..3 {
            let close = |found: f64, expected: f64| {
                assert!((found - expected).abs() < 1e-6, "{found} {expected}")
            };
            close(by_one(&scene, along, (Constant::Anchor, k)), -rotation[(way, k)] / 0.002);
            let expected = if way == k { 500.0 } else { 0.0 };
            close(by_one(&scene, along, (Constant::Anchor, 3 + k)), expected);
        }
    }
}

/// Checks the margin of a ball that hits a resting box. The corners of the box neither arrive nor
/// separate. So it is undecided which of two rows counts, and with restitution the margin is zero.
#[test]
fn ball_striking_a_resting_box_has_zero_margin() {
    let boxed = RigidBody::solid_box(2.0, Vector3::new(0.15, 0.1, 0.05)).unwrap();
    let inertia = Matrix3::from_diagonal_element(0.4 * 0.5 * 0.08 * 0.08);
    let ball = Piece::sphere(0.08).unwrap();
    let ball = RigidBody::from_pieces(0.5, inertia, vec![ball]).unwrap();
    let world = World::new(Parameters { friction: 0.3, ..Parameters::new(vec![boxed, ball]) });
    let at = |z: f64, speed: f64| State {
        velocity: Vector3::new(0.0, 0.0, speed),
        ..State::at_rest(Vector3::new(0.0, 0.0, z))
    };
    let states = [at(0.05, 0.0), at(0.18, -0.2)];
    for (restitution, is_kink) in [(0.0, false), (0.5, true)] {
        let world = world.clone().unwrap().with_integrator(Integrator::Euler);
        let world = world.with_coefficient(Coefficient::Restitution, restitution).unwrap();
        let (simulation, record) = step(&world, &states, &[]).unwrap();
        let mut derivative = StepDerivative::new();
        simulation.linearise(&record, &mut derivative).unwrap();
        assert_eq!(derivative.margin() < 1e-12, is_kink, "{}", derivative.margin());
    }
}
