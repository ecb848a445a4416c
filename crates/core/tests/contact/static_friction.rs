//! Static friction against closed forms, in runs and in derivatives of a step.

use crate::common::prelude::*;
use tumble_core::simulation::Interval;
use tumble_core::world::{Impacts, StickSpeed};

const G: f64 = 9.81;
const KINETIC: f64 = 0.3;
const STATIC: f64 = 0.6;

/// A flat block of 1 kg on a plane with its normal in the x-z plane, `angle` (rad) from z.
fn block(angle: f64, time_step: f64, integrator: Integrator) -> World {
    let body = RigidBody::solid_box(1.0, Vector3::new(0.5, 0.5, 0.02)).unwrap();
    let normal = Vector3::new(-angle.sin(), 0.0, angle.cos());
    let parameters = Parameters {
        ground: Some(Plane::new(normal, 0.0).unwrap()),
        friction: KINETIC,
        time_step,
        ..Parameters::new(vec![body])
    };
    let world = World::new(parameters).unwrap().with_integrator(integrator);
    world.with_coefficient(Coefficient::StaticFriction, STATIC).unwrap()
}

fn start(angle: f64, speed: f64) -> State {
    let turn = Vector4::new((0.5 * angle).cos(), 0.0, -(0.5 * angle).sin(), 0.0);
    State {
        position: Vector3::new(-angle.sin(), 0.0, angle.cos()) * 0.02,
        attitude: turn,
        velocity: Vector3::new(-angle.cos(), 0.0, -angle.sin()) * speed,
        spin: Vector3::zeros(),
    }
}

/// Takes `steps` solved steps and returns the speed along the plane. In windows of nanoseconds, the rounding of a gap
/// is a speed of 1e-8 m/s: there the certificate's own bound counts.
fn run(simulation: &mut Simulation<'_>, steps: usize) -> f64 {
    let mut record = StepRecord::new();
    for _ in 0..steps {
        simulation.step(&mut record).unwrap();
        let solved = matches!(record.status(), StepStatus::Converged | StepStatus::Retried);
        let is_exact =
            |interval: &Interval| interval.length < 1e-5 || interval.certificate.residual() < 1e-10;
        assert!(solved && record.intervals().iter().all(is_exact), "{:?}", record.report());
    }
    simulation.state().velocity.norm()
}

/// Checks a force that grows by 10 N/s: the block starts at μ_s m g and then has the kinetic friction,
/// v(t) = 5 (t² − t₀²) − μ g (t − t₀). It starts late by at most some steps.
#[test]
fn a_growing_force_overcomes_the_static_friction() {
    let begin = STATIC * G / 10.0;
    let expected = 5.0 * (1.0 - begin * begin) - KINETIC * G * (1.0 - begin);
    for integrator in [Integrator::Euler, Integrator::Leapfrog] {
        let mut errors = Vec::new();
        for steps in [250_u32, 1000] {
            let h = 1.0 / f64::from(steps);
            let world = block(0.0, h, integrator);
            let motion = Motion::native(&world);
            let mut simulation = Simulation::new(world, [start(0.0, 0.0)], motion).unwrap();
            let force = Polyline::new(vec![(0.0, Vector3::zeros()), (1.0, Vector3::x() * 10.0)]);
            let at = Vector3::new(0.0, 0.0, -0.02);
            let load = Load::new(force.unwrap(), Polyline::default(), at).unwrap();
            simulation.set_load(0, load).unwrap();
            let before = run(&mut simulation, (0.99 * begin / h) as usize);
            assert!(before < 1e-9, "{before}");
            let left = steps as usize - simulation.index() as usize;
            errors.push((run(&mut simulation, left) - expected).abs() / h);
        }
        // The force that is missed in a step is the jump of the friction.
        let jump = (STATIC - KINETIC) * G;
        assert!(errors.iter().all(|error| *error < 3.0 * jump), "{errors:?}");
    }
}

/// On a slope between both angles of friction a block that rests stays, and one that slides goes on with
/// g (sin α − μ cos α). One that slides up stops and stays.
#[test]
fn a_slope_between_the_angles_of_friction_has_two_motions() {
    let angle = 25.0_f64.to_radians();
    let (sine, cosine) = (angle.sin(), angle.cos());
    for integrator in [Integrator::Euler, Integrator::Leapfrog] {
        let world = block(angle, 0.001, integrator);
        let begin = |speed: f64| {
            let motion = Motion::native(&world);
            Simulation::new(world.clone(), [start(angle, speed)], motion).unwrap()
        };
        assert!(run(&mut begin(0.0), 500) < 1e-9);
        let down = run(&mut begin(0.1), 500);
        let expected = 0.1 + 0.5 * G * (sine - KINETIC * cosine);
        assert!((down - expected).abs() < 1e-3 * expected, "{down} {expected}");
        assert!(run(&mut begin(-0.5), 500) < 1e-9);
    }
}

/// A block that is thrown up a slope stops and stays, at whichever part of a step.
#[test]
fn a_slip_that_turns_around_stops() {
    let angle = 28.0_f64.to_radians();
    for integrator in [Integrator::Euler, Integrator::Leapfrog] {
        let world = block(angle, 0.002, integrator);
        for number in 0..20 {
            let speed = 0.3 + 0.0037 * f64::from(number);
            let motion = Motion::native(&world);
            let mut simulation =
                Simulation::new(world.clone(), [start(angle, -speed)], motion).unwrap();
            let end = run(&mut simulation, 100);
            assert!(end < 1e-9, "{integrator:?} {speed}: {end}");
        }
    }
}

/// The same with steps of 10 ms whose substeps end where the slip does.
#[test]
fn a_slip_that_turns_around_stops_in_substeps() {
    let angle = 20.0_f64.to_radians();
    let whole = block(angle, 0.01, Integrator::Leapfrog);
    let located = whole.clone().with_impacts(Impacts::Located);
    let accurate = whole.with_accuracy(Some(1e-6)).unwrap();
    for world in [located, accurate] {
        for number in 0..12 {
            let speed = 0.3 + 0.057 * f64::from(number);
            let motion = Motion::native(&world);
            let mut simulation =
                Simulation::new(world.clone(), [start(angle, -speed)], motion).unwrap();
            let end = run(&mut simulation, 40);
            assert!(end < 1e-9, "{speed}: {end}");
            // v²/(2 g (sin α + μ cos α)).
            let way = speed * speed / (2.0 * G * (angle.sin() + KINETIC * angle.cos()));
            let moved = (simulation.state().position - start(angle, 0.0).position).norm();
            assert!((moved - way).abs() < 1e-5, "{speed}: {moved} {way}");
        }
    }
}

/// A rod falls over its edge without slip: the edge moves on an arc about the centre, which is no slip. The
/// motion is the one with the static coefficient at any speed.
#[test]
fn an_edge_that_turns_does_not_slip() {
    let half = Vector3::new(0.01, 0.1, 0.5);
    let lean = 10.0_f64.to_radians();
    let fall = |friction: f64, most: f64, integrator: Integrator| {
        let parameters = Parameters {
            friction,
            ..Parameters::new(vec![RigidBody::solid_box(1.0, half).unwrap()])
        };
        let world = World::new(parameters).unwrap().with_integrator(integrator);
        let world = world.with_coefficient(Coefficient::StaticFriction, most).unwrap();
        let attitude = Vector4::new((0.5 * lean).cos(), 0.0, (0.5 * lean).sin(), 0.0);
        let state = State { attitude, ..start(0.0, 0.0) };
        let edge = state.pose().rotation * Vector3::new(half.x, 0.0, -half.z);
        let motion = Motion::native(&world);
        let mut simulation =
            Simulation::new(world, [State { position: -edge, ..state }], motion).unwrap();
        run(&mut simulation, 250);
        *simulation.state()
    };
    for integrator in [Integrator::Euler, Integrator::Leapfrog] {
        let (held, whole) = (fall(0.05, 0.9, integrator), fall(0.9, 0.9, integrator));
        let tilt = 2.0 * held.attitude[2].atan2(held.attitude[0]).to_degrees();
        assert!((tilt - 31.7).abs() < 0.3, "{integrator:?}: {tilt}");
        assert!((held.position - whole.position).norm() < 1e-9, "{integrator:?}");
    }
}

/// Coefficients of owners and pairs combine as those of kinetic friction do.
#[test]
fn static_coefficients_combine() {
    let world = block(0.0, 0.002, Integrator::Euler);
    assert_eq!(world.static_friction_between(0, Partner::Ground), Some(STATIC));
    let own = world
        .clone()
        .with_coefficient_of(Coefficient::StaticFriction, Partner::Body(0), 0.4)
        .unwrap();
    let mean = (0.4 * STATIC).sqrt();
    assert_eq!(own.static_friction_between(0, Partner::Ground), Some(mean));
    let pair =
        own.with_coefficient_between(Coefficient::StaticFriction, 0, Partner::Ground, 0.5).unwrap();
    assert_eq!(pair.static_friction_between(0, Partner::Ground), Some(0.5));
    let pair =
        pair.with_coefficient_between(Coefficient::Friction, 0, Partner::Ground, 0.7).unwrap();
    assert_eq!(pair.static_friction_between(0, Partner::Ground), None);
    assert_eq!(
        Constant::Coefficient(Coefficient::StaticFriction).values(&pair),
        [STATIC, 0.4, 0.5]
    );
    let error =
        world.clone().with_coefficient(Coefficient::StaticFriction, 0.2).unwrap_err().to_string();
    assert!(error.contains("static friction"), "{error}");
    assert!(world.with_coefficient_of(Coefficient::StaticFriction, Partner::Ground, 0.5).is_err());
}

/// The step that breaks loose has the kinetic friction, v⁺ = h (f − μ m g)/m.
#[test]
fn a_step_that_breaks_loose_has_the_kinetic_friction() {
    let (h, force) = (0.002, 8.0);
    let world = block(0.0, h, Integrator::Euler);
    let motion = Motion::native(&world);
    let mut simulation = Simulation::new(world, [start(0.0, 0.0)], motion).unwrap();
    let at = Vector3::new(0.0, 0.0, -0.02);
    let load = Polyline::constant(Vector3::x() * force).unwrap();
    simulation.set_load(0, Load::new(load, Polyline::default(), at).unwrap()).unwrap();
    let mut record = StepRecord::new();
    simulation.step(&mut record).unwrap();
    let speed = record.next_states()[0].velocity[0];
    assert!((speed - h * (force - KINETIC * G)).abs() < 1e-12, "{speed}");
    let mut derivative = StepDerivative::new();
    simulation.linearise(&record, &mut derivative).unwrap();
    let mut found: Vec<StateChange> = Vec::new();
    let mut by = |constant: Constant| {
        let constants: [(Constant, &[f64]); 1] = [(constant, &[1.0])];
        let change = StepChange { constants: &constants, ..StepChange::default() };
        derivative.jvp(&change, &mut found).unwrap();
        found[0].velocity[0]
    };
    let [of_static, of_kinetic] =
        [Constant::Coefficient(Coefficient::StaticFriction), Constant::Friction].map(&mut by);
    assert!((of_kinetic + h * G).abs() < 1e-9, "{of_kinetic}");
    assert!(of_static.abs() < 1e-15, "{of_static}");
}

/// Slip up to which the friction of [`falling`] falls (m/s).
const FALL: f64 = 0.5;

/// A block whose friction falls linearly with the slip, from the static to the kinetic coefficient.
fn falling(time_step: f64, integrator: Integrator) -> World {
    let table = StickSpeed::Table(vec![[0.0, 1.0], [FALL, 0.0]]);
    block(0.0, time_step, integrator).with_stick_speed(table).unwrap()
}

/// Within the table v⁺ = v − h g (μ_s − c v) and v(t) = μ_s/c + (v₀ − μ_s/c) exp(c g t); above it the friction
/// is kinetic.
#[test]
fn friction_over_the_slip() {
    let fall = (STATIC - KINETIC) / FALL;
    let begin = |h: f64, integrator: Integrator, speed: f64| {
        let world = falling(h, integrator);
        let motion = Motion::native(&world);
        Simulation::new(world, [start(0.0, speed)], motion).unwrap()
    };
    let mut simulation = begin(0.002, Integrator::Euler, 0.4);
    let mut speed = 0.4;
    for _ in 0..30 {
        speed -= 0.002 * G * (STATIC - fall * speed);
        let found = run(&mut simulation, 1);
        assert!((found - speed).abs() < 1e-10, "{found} {speed}");
    }
    let above = run(&mut begin(0.002, Integrator::Euler, 2.0), 100);
    assert!((above - (2.0 - 0.2 * KINETIC * G)).abs() < 1e-10, "{above}");
    let expected = STATIC / fall + (0.4 - STATIC / fall) * (fall * G * 0.06).exp();
    for integrator in [Integrator::Euler, Integrator::Leapfrog] {
        let error = |h: f64| {
            let found = run(&mut begin(h, integrator, 0.4), (0.06 / h).round() as usize);
            (found - expected).abs()
        };
        let (coarse, fine) = (error(0.002), error(0.0005));
        assert!(coarse < 0.01 && fine < 0.3 * coarse, "{integrator:?}: {coarse} {fine}");
    }
}

/// A step by its initial speed: ∂v⁺/∂v = 1 + h g c.
#[test]
fn derivatives_by_the_slip() {
    let (h, speed) = (0.002, 0.4);
    let world = falling(h, Integrator::Euler);
    let motion = Motion::native(&world);
    let mut simulation = Simulation::new(world, [start(0.0, speed)], motion).unwrap();
    let mut record = StepRecord::new();
    simulation.step(&mut record).unwrap();
    let mut derivative = StepDerivative::new();
    simulation.linearise(&record, &mut derivative).unwrap();
    let mut found: Vec<StateChange> = Vec::new();
    let faster = [StateChange { velocity: Vector3::x(), ..StateChange::zero() }];
    derivative.jvp(&StepChange { states: &faster, ..StepChange::default() }, &mut found).unwrap();
    let slope = (STATIC - KINETIC) / FALL;
    assert!((found[0].velocity[0] - (1.0 + h * G * slope)).abs() < 1e-9, "{:?}", found[0]);
    let mut by = |constant: Constant| {
        let constants: [(Constant, &[f64]); 1] = [(constant, &[1.0])];
        let change = StepChange { constants: &constants, ..StepChange::default() };
        derivative.jvp(&change, &mut found).unwrap();
        found[0].velocity[0]
    };
    // The block moves along −x.
    let share = 1.0 - speed / FALL;
    let of_static = by(Constant::Coefficient(Coefficient::StaticFriction));
    let of_kinetic = by(Constant::Friction);
    assert!((of_static - share * h * G).abs() < 1e-9, "{of_static}");
    assert!((of_kinetic - (1.0 - share) * h * G).abs() < 1e-9, "{of_kinetic}");
}

#[test]
fn wrong_tables_are_refused() {
    let world = block(0.0, 0.002, Integrator::Euler);
    let refused = |rows: &[[f64; 2]]| {
        world.clone().with_stick_speed(StickSpeed::Table(rows.to_vec())).unwrap_err().to_string()
    };
    assert!(refused(&[]).contains("rows of stick_speed"));
    for rows in [[[0.1, 1.0], [0.05, 0.0]], [[-0.1, 1.0], [0.1, 0.0]], [[0.0, 1.0], [2e3, 0.0]]] {
        assert!(refused(&rows).contains("slip of stick_speed"), "{}", refused(&rows));
    }
    for rows in [[[0.0, 1.5]], [[0.0, f64::NAN]]] {
        assert!(refused(&rows).contains("share of stick_speed"), "{}", refused(&rows));
    }
}
