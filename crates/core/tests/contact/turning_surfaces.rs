//! Surfaces that turn, against closed forms and against a body that turns.

use crate::common::prelude::*;
use tumble_core::simulation::energy::total;
use tumble_core::world::SurfaceMotion;

const G: f64 = 9.81;
const TURN: f64 = 2.0;

/// World of this body on level ground whose surface, or that of a fixed plate in its place, has this motion.
fn on(body: RigidBody, motion: SurfaceMotion, is_fixed: bool, friction: f64, h: f64) -> World {
    let parameters = Parameters {
        ground: (!is_fixed).then(Plane::level),
        friction,
        time_step: h,
        ..Parameters::new(vec![body])
    };
    let world = World::new(parameters).unwrap();
    if !is_fixed {
        return world.with_surface_motion(Partner::Ground, motion).unwrap();
    }
    let plate = Piece::cuboid(Vector3::new(5.0, 5.0, 0.1)).unwrap();
    let plate = plate.moved_by(&Matrix3::identity(), &(Vector3::z() * -0.1)).unwrap();
    let world = world.with_fixed(vec![plate]);
    world.with_surface_motion(Partner::Fixed(0), motion).unwrap()
}

fn turning(centre: Vector3<f64>) -> SurfaceMotion {
    SurfaceMotion { spin: Vector3::z() * TURN, centre, ..SurfaceMotion::default() }
}

/// Takes `count` solved steps.
fn run(simulation: &mut Simulation<'_>, count: usize) -> StepRecord {
    last_step(simulation, count, |record| is_solved(record) && record.residual() < 1e-10)
}

/// A ball rolls on a turntable that turns at W: its velocity turns at 2/7 W, so that it runs along a circle, to
/// second order.
#[test]
fn a_ball_runs_along_a_circle() {
    let centre = Vector3::new(0.3, -0.2, 0.0);
    for is_fixed in [false, true] {
        let off = [0.01, 0.005, 0.0025].map(|h| {
            let ball = RigidBody::solid(0.1, &[Piece::sphere(0.05).unwrap()]).unwrap().0;
            let world = on(ball, turning(centre), is_fixed, 2.0, h);
            // Without slip: v + ω × (−r e_z) = W × p.
            let start = State {
                velocity: Vector3::new(0.0, 0.3, 0.0),
                spin: Vector3::new(14.0, 0.0, 0.0),
                ..State::at_rest(centre + Vector3::new(0.5, 0.0, 0.05))
            };
            let mut simulation = simulate(&world, &[start]);
            run(&mut simulation, (1.0 / h).round() as usize);
            let rate = 2.0 / 7.0 * TURN;
            let expected = [0.5 - 0.3 / rate * (1.0 - rate.cos()), 0.3 / rate * rate.sin()];
            let found = simulation.state().position - centre;
            (found.x - expected[0]).hypot(found.y - expected[1])
        });
        assert!(off[0] <= 4e-4, "{off:?}");
        assert!(off[1] <= 0.3 * off[0] && off[2] <= 0.3 * off[1], "{off:?}");
    }
}

/// A puck is carried round at rest on the table while ω² r < μ g, also by its static friction, and slips outwards beyond.
#[test]
fn a_puck_is_carried_as_far_as_friction_reaches() {
    let limit = 0.5 * G / (TURN * TURN);
    for (share, statics) in [(0.98, false), (1.02, false), (0.98, true), (1.02, true)] {
        let radius = share * limit;
        let puck = RigidBody::solid_box(1.0, Vector3::new(0.02, 0.02, 0.005)).unwrap();
        let friction = if statics { 0.2 } else { 0.5 };
        let world = on(puck, turning(Vector3::zeros()), false, friction, 0.001);
        let world = if statics {
            world.with_coefficient(Coefficient::StaticFriction, 0.5).unwrap()
        } else {
            world
        };
        let start = State {
            velocity: Vector3::y() * (TURN * radius),
            spin: Vector3::z() * TURN,
            ..State::at_rest(Vector3::new(radius, 0.0, 0.005))
        };
        let mut simulation = simulate(&world, &[start]);
        run(&mut simulation, 1000);
        let State { position, .. } = simulation.state();
        let found = position.xy().norm();
        if share < 1.0 {
            assert!((found - radius).abs() < 2e-5, "{statics} {found} {radius}");
            let angle = position.y.atan2(position.x);
            assert!((angle - TURN).abs() < 1e-4, "{statics} {angle}");
        } else {
            assert!(found > radius + 0.01, "{statics} {found} {radius}");
        }
    }
}

/// A parcel on a curved belt moves with ω × (r − c) after it has slid for a while, and turns with the belt.
#[test]
fn a_curved_belt_turns_parcels() {
    let centre = Vector3::new(0.0, 1.5, 0.0);
    let parcel = RigidBody::solid_box(0.5, Vector3::new(0.1, 0.08, 0.05)).unwrap();
    let motion = SurfaceMotion { spin: Vector3::z() * 0.6, centre, ..SurfaceMotion::default() };
    let world = on(parcel, motion, true, 0.6, 0.001);
    let mut simulation = simulate(&world, &[State::at_rest(Vector3::z() * 0.05)]);
    run(&mut simulation, 1500);
    let State { position, velocity, spin, .. } = simulation.state();
    let expected = motion.spin.cross(&(position - centre));
    assert!((velocity - expected).norm() < 2e-3, "{velocity} {expected}");
    assert!((spin.z - 0.6).abs() < 2e-3, "{spin}");
}

/// A ball and a box on a surface that turns move as on a heavy body that turns, and the energy balance has the work.
#[test]
fn a_surface_moves_bodies_as_a_turntable_does() {
    let bodies = || {
        let ball = RigidBody::solid(0.2, &[Piece::sphere(0.05).unwrap()]).unwrap().0;
        vec![ball, RigidBody::solid_box(0.3, Vector3::new(0.06, 0.04, 0.03)).unwrap()]
    };
    let starts = [
        State {
            velocity: Vector3::new(0.2, 0.1, 0.0),
            ..State::at_rest(Vector3::new(0.5, 0.0, 0.05))
        },
        State { spin: Vector3::z(), ..State::at_rest(Vector3::new(-0.4, 0.1, 0.03)) },
    ];
    let h = 0.001;
    let parameters = Parameters { time_step: h, ..Parameters::new(bodies()) };
    let world = World::new(parameters).unwrap();
    let world = world.with_surface_motion(Partner::Ground, turning(Vector3::zeros())).unwrap();
    let mut simulation = simulate(&world, &starts);
    let mut record = StepRecord::new();
    for _ in 0..1000 {
        simulation.step(&mut record).unwrap();
        assert!(is_solved(&record), "{:?}", record.report());
        let taken = record.first();
        let world = taken.world(&world);
        let balance = taken.balance(&world);
        let [before, after] = [taken.energy(&world), taken.end_energy(&world)];
        let sum: f64 = balance.terms().iter().sum();
        assert!((after - before - sum).abs() < 1e-11, "{balance:?}");
    }
    let table = Piece::cylinder(0.05, 3.0, 64).unwrap();
    let table = RigidBody::solid(100.0, &[table]).unwrap().0;
    let mut all = bodies();
    all.push(table);
    let motor = Motor::Speed { target: TURN, max_force: 1e7 };
    let frames = [JointFrame::at(Vector3::zeros()), JointFrame::at(Vector3::z() * -0.05)];
    let hinge = Joint::revolute(2, None, frames, Drive { motor: Some(motor), ..Drive::NONE });
    let parameters = Parameters { ground: None, time_step: h, ..Parameters::new(all) };
    let world = World::new(parameters).unwrap().with_joints(vec![hinge]).unwrap();
    let turned = State { spin: Vector3::z() * TURN, ..State::at_rest(Vector3::z() * -0.05) };
    let mut other = simulate(&world, &[starts[0], starts[1], turned]);
    for _ in 0..1000 {
        other.step(&mut record).unwrap();
    }
    for (one, other) in simulation.states().iter().zip(other.states()) {
        assert!((one.position - other.position).norm() < 2e-4, "{one:?} {other:?}");
        assert!((one.velocity - other.velocity).norm() < 2e-3, "{one:?} {other:?}");
    }
}

/// The surface of a loose plate turns under a ball. Both together keep their momentum and their angular momentum.
#[test]
fn a_surface_of_a_body_acts_on_both() {
    let plate = RigidBody::solid_box(3.0, Vector3::new(1.0, 1.0, 0.05)).unwrap();
    let ball = RigidBody::solid(2.0, &[Piece::sphere(0.1).unwrap()]).unwrap().0;
    let parameters = Parameters {
        ground: None,
        gravity: Vector3::zeros(),
        time_step: 0.001,
        ..Parameters::new(vec![plate, ball])
    };
    let world = World::new(parameters).unwrap();
    let motion = SurfaceMotion { velocity: Vector3::x() * 0.1, ..turning(Vector3::y() * 0.1) };
    let world = world.with_surface_motion(Partner::Body(0), motion).unwrap();
    let pull = world.with_coefficient(Coefficient::Adhesion, 20.0).unwrap();
    let starts = [State::at_rest(Vector3::zeros()), State::at_rest(Vector3::new(0.3, 0.0, 0.15))];
    let mut simulation = simulate(&pull, &starts);
    run(&mut simulation, 300);
    let mut linear = Vector3::zeros();
    let mut angular = Vector3::zeros();
    for (body, state) in pull.bodies().iter().zip(simulation.states()) {
        linear += state.velocity * body.mass();
        angular += state.position.cross(&state.velocity) * body.mass()
            + rotation(&state.attitude) * (body.inertia() * state.spin);
    }
    assert!(simulation.states()[1].velocity.norm() > 0.1, "{:?}", simulation.states());
    assert!(linear.norm() < 1e-9 && angular.norm() < 1e-4, "{linear} {angular}");
    assert!(total(&pull, simulation.states()).is_finite());
}

#[test]
fn wrong_motions_are_refused() {
    let body = || RigidBody::solid_box(1.0, Vector3::repeat(0.1)).unwrap();
    let world = || World::new(Parameters::new(vec![body()])).unwrap();
    let wrong = Vector3::new(0.0, f64::NAN, 0.0);
    let ground = Partner::Ground;
    let motion = SurfaceMotion { spin: wrong, ..SurfaceMotion::default() };
    assert!(world().with_surface_motion(ground, motion).is_err());
    let motion = SurfaceMotion { centre: Vector3::x() * 1e7, ..SurfaceMotion::default() };
    assert!(world().with_surface_motion(ground, motion).is_err());
    let fixed = world().with_surface_motion(Partner::Fixed(0), turning(Vector3::zeros()));
    assert!(fixed.is_err());
}
