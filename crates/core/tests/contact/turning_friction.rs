//! Rolling and torsional resistance against closed forms and a computation of their law by hand.

use crate::common::prelude::*;
use tumble_core::contact::ContactLoad;
use tumble_core::problem::{ContactProblem, SolveOptions};
use tumble_core::simulation::energy::total;
use tumble_core::world::TurningFriction;

const G: f64 = 9.81;
const RADIUS: f64 = 0.1;
const FRICTION: TurningFriction = TurningFriction { rolling: 0.01, torsional: 0.01 };

fn with_both(world: World, friction: TurningFriction) -> World {
    let world = world.with_coefficient(Coefficient::RollingFriction, friction.rolling).unwrap();
    world.with_coefficient(Coefficient::TorsionalFriction, friction.torsional).unwrap()
}

fn solid_ball(mass: f64, radius: f64) -> RigidBody {
    RigidBody::solid(mass, &[Piece::sphere(radius).unwrap()]).unwrap().0
}

/// A solid ball of 2 kg on a plane with its normal in the x-z plane, `angle` (rad) from z.
fn ball(angle: f64, time_step: f64, integrator: Integrator) -> World {
    let normal = Vector3::new(-angle.sin(), 0.0, angle.cos());
    let parameters = Parameters {
        ground: Some(Plane::new(normal, 0.0).unwrap()),
        friction: 0.6,
        time_step,
        ..Parameters::new(vec![solid_ball(2.0, RADIUS)])
    };
    let world = World::new(parameters).unwrap().with_integrator(integrator);
    with_both(world, FRICTION)
}

fn simulate(world: &World, velocity: Vector3<f64>, spin: Vector3<f64>) -> Simulation<'static> {
    let normal = *world.ground().unwrap().normal();
    let attitude = Vector4::new(1.0, 0.0, 0.0, 0.0);
    let start = State { position: normal * RADIUS, attitude, velocity, spin };
    Simulation::new(world.clone(), [start], Motion::native(world)).unwrap()
}

/// Takes `steps` solved steps.
fn run(simulation: &mut Simulation<'_>, count: usize) {
    last_step(simulation, count, |record| is_solved(record) && record.residual() < 1e-10);
}

/// Checks a ball that rolls with v: it decelerates by a = μ_r g/(7/5 r) and stops after v²/2a.
#[test]
fn a_rolling_ball_stops_where_it_must() {
    let slowing = FRICTION.rolling * G / (1.4 * RADIUS);
    let (time, distance) = (1.0 / slowing, 0.5 / slowing);
    assert!((time - 1.4271).abs() < 1e-4 && (distance - 0.71357).abs() < 2e-5);
    // A step turns by 2 tan⁻¹(ωh/2), so that (ωh)²/12 of the distance is lost.
    for (integrator, allowed) in [(Integrator::Euler, 0.6), (Integrator::Leapfrog, 0.01)] {
        let h = 0.001;
        let world = ball(0.0, h, integrator);
        let mut simulation = simulate(&world, Vector3::x(), Vector3::y() / RADIUS);
        run(&mut simulation, (time / h) as usize - 1);
        assert!(simulation.state().velocity[0] > 0.0);
        run(&mut simulation, 3);
        let state = *simulation.state();
        assert!(
            (state.position[0] - distance).abs() < allowed * h,
            "{}",
            state.position[0] - distance
        );
        assert!(state.velocity.norm() < 1e-12 && state.spin.norm() < 1e-11, "{state:?}");
        run(&mut simulation, 50);
        assert!((simulation.state().position - state.position).norm() < 1e-15);
    }
}

/// Checks a ball that spins about the normal: it stops after I ω/(μ_s m g), having turned by half of ω t.
#[test]
fn a_spinning_ball_stops_when_it_must() {
    let slowing = FRICTION.torsional * G / (0.4 * RADIUS * RADIUS);
    let time = 10.0 / slowing;
    assert!((time - 0.4077).abs() < 1e-4);
    for (integrator, allowed) in [(Integrator::Euler, 6.0), (Integrator::Leapfrog, 0.08)] {
        let h = 0.001;
        let world = ball(0.0, h, integrator);
        let mut simulation = simulate(&world, Vector3::zeros(), Vector3::z() * 10.0);
        run(&mut simulation, (time / h) as usize - 1);
        assert!(simulation.state().spin[2] > 0.0);
        run(&mut simulation, 3);
        let state = simulation.state();
        let turned = 2.0 * state.attitude[3].atan2(state.attitude[0]);
        assert!((turned - 5.0 * time).abs() < allowed * h, "{}", turned - 5.0 * time);
        assert!(state.spin.norm() < 1e-10 && state.position.xy().norm() < 1e-13, "{state:?}");
    }
}

/// A ball stays on a slope below tan⁻¹(μ_r/r), and rolls down a steeper one with
/// 5/7 g (sin α − μ_r/r cos α).
#[test]
fn a_ball_stays_on_a_slope_below_its_angle() {
    let limit = (FRICTION.rolling / RADIUS).atan();
    for (angle, stays) in [(0.99 * limit, true), (1.5 * limit, false)] {
        let world = ball(angle, 0.002, Integrator::Leapfrog);
        let mut simulation = simulate(&world, Vector3::zeros(), Vector3::zeros());
        run(&mut simulation, 250);
        let speed = simulation.state().velocity.norm();
        let downhill = angle.sin() - FRICTION.rolling / RADIUS * angle.cos();
        let expected = if stays { 0.0 } else { 0.5 * G * downhill / 1.4 };
        assert!((speed - expected).abs() < 1e-6, "{angle} {speed} {expected}");
    }
}

/// A moment with a limit above μ r f_n keeps a sliding ball from turning: it stops like a block, after
/// v²/(2 μ g).
#[test]
fn a_ball_that_cannot_roll_slides_like_a_block() {
    for integrator in [Integrator::Euler, Integrator::Leapfrog] {
        let h = 0.001;
        let world = ball(0.0, h, integrator);
        let world = world.with_coefficient(Coefficient::RollingFriction, 1.0).unwrap();
        let mut simulation = simulate(&world, Vector3::x(), Vector3::zeros());
        run(&mut simulation, 400);
        let State { position, attitude, velocity, .. } = *simulation.state();
        let distance = 0.5 / (0.6 * G);
        let allowed = if integrator == Integrator::Euler { 0.6 * h } else { 1e-6 };
        assert!((position[0] - distance).abs() < allowed, "{}", position[0] - distance);
        assert!(velocity.norm() < 1e-12 && attitude.yz().norm() < 1e-12, "{attitude}");
    }
}

/// The work of moments belongs to that of an impact: with the whole restitution this box would gain 0.2 J, so it
/// bounces with a share.
#[test]
fn an_impact_with_rolling_resistance_makes_no_energy() {
    let parameters = Parameters {
        friction: 0.0,
        ..Parameters::new(vec![RigidBody::solid_box(1.0, Vector3::new(0.1, 0.05, 0.075)).unwrap()])
    };
    let world = euler(parameters).with_coefficient(Coefficient::Restitution, 0.9).unwrap();
    let world = world.with_coefficient(Coefficient::RollingFriction, 0.04).unwrap();
    let attitude = Vector4::new(-0.693, 0.601, -0.373, -0.140).normalize();
    let start = State {
        position: Vector3::new(0.0, 0.0, 0.108),
        attitude,
        velocity: Vector3::new(0.0, 0.6, -0.15),
        spin: Vector3::new(-8.5, 12.0, 16.0),
    };
    let motion = Motion::native(&world);
    let mut simulation = Simulation::new(world.clone(), [start], motion).unwrap();
    let energy = |states: &[State]| total(&world, states);
    let (mut record, mut shares) = (StepRecord::new(), Vec::new());
    for _ in 0..50 {
        let before = energy(simulation.step_states());
        simulation.step(&mut record).unwrap();
        assert!(record.status().is_solved(), "{:?}", record.report());
        assert!(record.residual() < 1e-9, "{:?}", record.certificate());
        let after = energy(simulation.step_states());
        assert!(after <= before + 1e-9, "{before} {after}");
        shares.push(record.restitution_share());
    }
    assert!(shares.iter().any(|share| *share < 1.0), "{shares:?}");
}

/// Bodies of revolution that roll about their axis decelerate by μ_r g r/(r² + I/m), whatever touches.
#[test]
fn capsules_and_cylinders_roll_to_rest() {
    let radius = 0.08;
    for piece in [Piece::capsule(0.2, radius), Piece::cylinder(0.15, radius, 24)] {
        let body = RigidBody::solid(3.0, &[piece.unwrap()]).unwrap().0;
        // The axis is z of the body; it lies along y, and −ω_z turns it forwards.
        let about = body.inertia()[(2, 2)] / body.mass();
        let slowing = FRICTION.rolling * G * radius / (radius * radius + about);
        let parameters = Parameters {
            ground: Some(Plane::new(Vector3::z(), 0.0).unwrap()),
            friction: 0.6,
            time_step: 0.001,
            ..Parameters::new(vec![body])
        };
        let world = World::new(parameters).unwrap().with_integrator(Integrator::Leapfrog);
        let world = with_both(world, FRICTION);
        let half = 0.5_f64.sqrt();
        let start = State {
            position: Vector3::z() * radius,
            attitude: Vector4::new(half, -half, 0.0, 0.0),
            velocity: Vector3::x() * 0.5,
            spin: Vector3::z() * (0.5 / radius),
        };
        let mut simulation =
            Simulation::new(world.clone(), [start], Motion::native(&world)).unwrap();
        run(&mut simulation, 900);
        let state = simulation.state();
        let distance = 0.125 / slowing;
        assert!((state.position[0] - distance).abs() < 2e-5, "{} {distance}", state.position[0]);
        assert!(state.velocity.norm() < 1e-11, "{state:?}");
    }
}

/// The same motion at a thousandth and at a thousand times the size, with times as √size.
#[test]
fn rolling_is_similar_at_any_size() {
    let distance = |size: f64| {
        let parameters = Parameters {
            ground: Some(Plane::new(Vector3::z(), 0.0).unwrap()),
            friction: 0.6,
            time_step: 0.002 * size.sqrt(),
            ..Parameters::new(vec![solid_ball(size.powi(3), 0.1 * size)])
        };
        let TurningFriction { rolling, torsional } = FRICTION;
        let friction = TurningFriction { rolling: rolling * size, torsional: torsional * size };
        let world = with_both(World::new(parameters).unwrap(), friction);
        let start = State {
            velocity: Vector3::x() * size.sqrt(),
            spin: Vector3::new(0.0, 10.0, 5.0) / size.sqrt(),
            ..State::at_rest(Vector3::z() * (0.1 * size))
        };
        let mut simulation =
            Simulation::new(world.clone(), [start], Motion::native(&world)).unwrap();
        run(&mut simulation, 750);
        simulation.state().position[0] / size
    };
    let usual = distance(1.0);
    for size in [1e-3, 1e3] {
        assert!((distance(size) - usual).abs() < 1e-9, "{size} {} {usual}", distance(size));
    }
}

/// A ball on a loose block of another mass moves alike, whichever of them comes first.
#[test]
fn the_order_of_the_bodies_plays_no_part() {
    let block = RigidBody::solid_box(0.7, Vector3::new(0.4, 0.4, 0.05)).unwrap();
    let bodies = [block, solid_ball(2.0, RADIUS)];
    let attitude = Vector4::new(1.0, 0.0, 0.0, 0.0);
    let rest = State { attitude, ..State::at_rest(Vector3::z() * 0.05) };
    let rolling = State {
        position: Vector3::new(0.05, 0.0, 0.1 + RADIUS),
        velocity: Vector3::new(0.3, 0.1, 0.0),
        spin: Vector3::new(-1.0, 9.0, 6.0),
        ..rest
    };
    let ends = [[0, 1], [1, 0]].map(|order| {
        let parameters = Parameters {
            ground: Some(Plane::new(Vector3::z(), 0.0).unwrap()),
            friction: 0.3,
            ..Parameters::new(order.map(|of| bodies[of].clone()).to_vec())
        };
        let world = with_both(World::new(parameters).unwrap(), FRICTION);
        let starts = order.map(|of| [rest, rolling][of]);
        let mut simulation =
            Simulation::new(world.clone(), starts, Motion::native(&world)).unwrap();
        run(&mut simulation, 300);
        order.map(|of| simulation.states()[of])
    });
    for (one, other) in ends[0].iter().zip(&ends[1]) {
        assert!((one.to_vector() - other.to_vector()).amax() < 1e-9, "{one:?} {other:?}");
    }
}

/// A claim with an unbounded force or moment has a residual above any tolerance, and no panic.
#[test]
fn unbounded_claims_are_refused() {
    let world = ball(0.0, 0.001, Integrator::Euler);
    let mut simulation = simulate(&world, Vector3::x(), Vector3::y() / RADIUS);
    let mut record = StepRecord::new();
    simulation.step(&mut record).unwrap();
    let claim = Claim {
        states: record.states(),
        next: record.next_states(),
        wrenches: &record.first().wrenches,
        contacts: &record.first().contacts,
        joints: &[],
        gears: &[],
    };
    let force = record.first().solution.contacts[0].force;
    let moment = record.first().solution.moment(0);
    let residual = |force: Vector3<f64>, moment: Vector3<f64>| {
        let load = ContactLoad { force, moment };
        Certifier::new().contact_step(&world, &claim, [load]).residual()
    };
    assert!(residual(force, moment) < 1e-11);
    for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX] {
        let wild = Vector3::repeat(number);
        for found in [residual(wild, moment), residual(force, wild), residual(wild, wild)] {
            assert!(found.is_nan() || found > 1.0, "{number} {found}");
        }
    }
    assert!(residual(force, 1.01 * moment) > 1e-6 && residual(force, -moment) > 1e-3);
}

/// A ball on a plate that is free to slide on smooth ice: both moments act on both bodies, momentum and
/// angular momentum are conserved, and both end with the same motion.
#[test]
fn moments_act_on_both_bodies() {
    let plate = RigidBody::solid_box(3.0, Vector3::new(1.0, 1.0, 0.05)).unwrap();
    let sphere = solid_ball(2.0, RADIUS);
    let parameters = Parameters {
        ground: Some(Plane::new(Vector3::z(), 0.0).unwrap()),
        friction: 0.0,
        time_step: 0.0005,
        ..Parameters::new(vec![plate, sphere])
    };
    let world = World::new(parameters)
        .unwrap()
        .with_coefficient_between(Coefficient::Friction, 1, Partner::Body(0), 0.8)
        .unwrap();
    let (body, partner) = (1, Partner::Body(0));
    let world = [
        (Coefficient::RollingFriction, FRICTION.rolling),
        (Coefficient::TorsionalFriction, FRICTION.torsional),
    ]
    .into_iter()
    .try_fold(world, |world, (turning, friction)| {
        world.with_coefficient_between(turning, body, partner, friction)
    })
    .unwrap();
    let attitude = Vector4::new(1.0, 0.0, 0.0, 0.0);
    let still = State { attitude, ..State::at_rest(Vector3::z() * 0.05) };
    let rolling = State {
        position: Vector3::new(0.0, 0.0, 0.1 + RADIUS),
        velocity: Vector3::new(0.3, 0.2, 0.0),
        spin: Vector3::new(-2.0, 3.0, 8.0),
        ..still
    };
    let momenta = |states: &[State]| {
        let mut linear = Vector3::zeros();
        let mut angular = 0.0;
        for (body, state) in world.bodies().iter().zip(states) {
            let turn = rotation(&state.attitude);
            linear += state.velocity * body.mass();
            angular += (state.position.cross(&state.velocity) * body.mass()
                + turn * (body.inertia() * state.spin))[2];
        }
        (linear, angular)
    };
    let motion = Motion::native(&world);
    let mut simulation = Simulation::new(world.clone(), [still, rolling], motion).unwrap();
    let before = momenta(simulation.states());
    run(&mut simulation, 4000);
    let after = momenta(simulation.states());
    assert!((before.0 - after.0).xy().norm() < 1e-11, "{} {}", before.0, after.0);
    // A momentum of the step differs from I ω by (ωh)²/4 of it.
    assert!((before.1 - after.1).abs() < 1e-6, "{} {}", before.1, after.1);
    let [plate, sphere] = simulation.states() else { panic!() };
    let apart = sphere.position - plate.position;
    let relative = sphere.velocity - plate.velocity - plate.spin.cross(&apart);
    // They turn together, by h ω² r of each step.
    assert!(relative.norm() < 1e-6, "{relative}");
    let turning = rotation(&sphere.attitude) * sphere.spin;
    assert!((plate.spin - turning).norm() < 1e-6, "{turning}");
}

/// A record's moment obeys its law, computed from the states by hand, under random pushes of random bodies.
/// The impulses of the step solve its contact problem, which is also solved from nothing.
#[test]
fn moments_obey_their_law() {
    let (h, friction) = (0.004, TurningFriction { rolling: 0.02, torsional: 0.03 });
    let bodies = vec![
        solid_ball(1.0, 0.1),
        RigidBody::solid_box(2.0, Vector3::new(0.2, 0.1, 0.05)).unwrap(),
        solid_ball(0.5, 0.07),
    ];
    let parameters = Parameters {
        ground: Some(Plane::new(Vector3::z(), 0.0).unwrap()),
        friction: 0.4,
        time_step: h,
        ..Parameters::new(bodies)
    };
    let world = with_both(euler(parameters), friction);
    let attitude = Vector4::new(1.0, 0.0, 0.0, 0.0);
    let at = |x: f64, z: f64, spin: Vector3<f64>| State {
        position: Vector3::new(x, 0.0, z),
        attitude,
        velocity: Vector3::new(-x, 0.2, 0.0),
        spin,
    };
    let starts = [
        at(0.5, 0.12, Vector3::new(3.0, -20.0, 9.0)),
        at(0.0, 0.3, Vector3::new(1.0, 2.0, 3.0)),
        at(-0.4, 0.2, Vector3::new(-7.0, 4.0, -30.0)),
    ];
    let mut simulation = Simulation::new(world.clone(), starts, Motion::native(&world)).unwrap();
    let mut record = StepRecord::new();
    let (mut rolls, mut holds) = (0, 0);
    for step in 0..400_u32 {
        if step % 40 == 0 {
            let push = Vector3::new(3.0, -2.0, 0.5) * (1.0 - 0.01 * f64::from(step));
            let at = Vector3::new(0.02, 0.0, 0.03);
            let load =
                Load::new(Polyline::constant(push).unwrap(), Polyline::default(), at).unwrap();
            simulation.set_load(step as usize / 40 % 3, load).unwrap();
        }
        let before = simulation.states().to_vec();
        simulation.step(&mut record).unwrap();
        assert!(record.residual() < 1e-10, "{step} {:?}", record.certificate());
        let (problem, impulses) = ContactProblem::from_interval(&world, record.first()).unwrap();
        assert_eq!(impulses.len(), 6 * record.first().contacts.len());
        let found = problem.evaluate(&impulses);
        assert!(found.residual < 1e-10 && found.relative_error < 1e-9, "{step} {found:?}");
        for problem in [problem.to_local().unwrap(), problem] {
            let solution = problem.solve(&SolveOptions::default()).unwrap();
            assert!(solution.is_solved(), "{step} {}", solution.residual);
        }
        let after = record.next_states();
        for (place, contact) in record.first().contacts.iter().enumerate() {
            let (force, moment) =
                (&record.first().solution.contacts[place], record.first().solution.moment(place));
            let turning = |body: usize| {
                let turn = rotation(&before[body].attitude);
                turn * after[body].spin
            };
            let other = contact.key.partner.body().map_or(Vector3::zeros(), turning);
            let (turned, n) = (turning(contact.key.body) - other, contact.normal());
            let (along, about) = (n.dot(&turned), n.dot(&moment));
            let (rolled, rolling) = (turned - n * along, moment - n * about);
            let limits =
                (friction.rolling * force.normal_force, friction.torsional * force.normal_force);
            assert!(rolling.norm() <= limits.0 + 1e-8 && about.abs() <= limits.1 + 1e-8);
            if rolled.norm() > 1e-6 {
                assert!((rolling + rolled / rolled.norm() * limits.0).norm() < 1e-5, "{step}");
                rolls += 1;
            } else if force.normal_force > 0.1 {
                holds += 1;
            }
            if along.abs() > 1e-6 {
                assert!((about + along.signum() * limits.1).abs() < 1e-5, "{step}");
            }
        }
    }
    assert!(rolls > 100 && holds > 20, "{rolls} {holds}");
}

/// Random mixtures of balls, boxes, capsules and coefficients in 10⁵ steps: at least 99.99 % are solved, and moments make
/// no more steps need shorter ones.
#[test]
#[ignore = "slow"]
fn random_steps_with_moments_are_solved() {
    let [with, without] = [1.0, 0.0].map(|factor| {
        let runs = (1..6).map(|seed| random_steps(seed, factor));
        runs.fold([0; 3], |sums, more| std::array::from_fn(|k| sums[k] + more[k]))
    });
    println!("steps, failed, substepped: {with:?}, without moments {without:?}");
    assert!(with[1] * 10_000 <= with[0] && with[2] <= without[2], "{with:?} {without:?}");
}

/// Numbers of steps, failed ones and substepped ones, with `factor` times random turning friction.
fn random_steps(mut seed: u64, factor: f64) -> [usize; 3] {
    let mut counts = [0; 3];
    let mut draw = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as f64 / f64::from(u32::MAX >> 1) - 0.5
    };
    for scene in 0..100 {
        let shape = |kind: usize, size: f64| match kind {
            0 => Piece::sphere(size),
            1 => Piece::cuboid(Vector3::new(size, 0.6 * size, 0.4 * size)),
            _ => Piece::capsule(size, 0.4 * size),
        };
        let bodies: Vec<_> = (0..4)
            .map(|body| {
                let piece = shape((scene + 2 * body) % 3, 0.08 * (1.0 + draw())).unwrap();
                RigidBody::solid(1.5 + draw(), &[piece]).unwrap().0
            })
            .collect();
        let count = bodies.len();
        let parameters = Parameters {
            bodies,
            ground: Some(Plane::new(Vector3::z(), 0.0).unwrap()),
            gravity: Vector3::new(2.0 * draw(), 2.0 * draw(), -G),
            friction: 0.5 + draw(),
            time_step: 0.002,
            rotation: Rotation::Momentum,
        };
        let friction = TurningFriction {
            rolling: (0.02 * factor * draw()).max(0.0),
            torsional: (0.05 * factor * draw()).max(0.0),
        };
        let world = with_both(World::new(parameters).unwrap(), friction);
        let starts: Vec<_> = (0..count)
            .map(|body| State {
                position: Vector3::new(0.1 * draw(), 0.1 * draw(), 0.2 + 0.35 * body as f64),
                attitude: Vector4::new(1.0 + draw(), draw(), draw(), draw()).normalize(),
                velocity: Vector3::new(draw(), draw(), draw()),
                spin: Vector3::new(draw(), draw(), draw()) * 10.0,
            })
            .collect();
        let mut simulation =
            Simulation::new(world.clone(), starts, Motion::native(&world)).unwrap();
        let mut record = StepRecord::new();
        for step in 0..250 {
            simulation.step(&mut record).unwrap();
            let status = record.status();
            let is_failed =
                !status.is_solved() || status != StepStatus::Substepped && record.residual() > 1e-9;
            if is_failed {
                println!("{scene} {step}: {status} {:?}", record.certificate());
            }
            counts[0] += 1;
            counts[1] += usize::from(is_failed);
            counts[2] += usize::from(status == StepStatus::Substepped);
        }
    }
    counts
}
