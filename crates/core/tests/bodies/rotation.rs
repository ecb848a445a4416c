//! The two forms of free rotation: their conserved quantities and their accuracy. Solvers, programs
//! and certificate all use the form of the world.

use crate::common::prelude::*;
use crate::common::{any_state, cases, inertia, tutorial_parameters, vector};
use proptest::prelude::*;
use tumble_core::mechanics::StepMap;
use tumble_core::mechanics::dynamics::rk4_step;
use tumble_core::simulation::energy;

/// World with a free brick of 3 kg with rotated principal axes, without gravity and ground.
fn askew(form: Rotation, h: f64) -> World {
    let axes = rotation(&Vector4::new(0.7, 0.3, -0.5, 0.4).normalize());
    let inertia = axes * Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 2.5)) * axes.transpose();
    let inertia = 0.5 * (inertia + inertia.transpose());
    let body = RigidBody::new(3.0, inertia, &[Vector3::new(1.0, 0.6, 0.4)]).unwrap();
    let usual = tutorial_parameters();
    let gravity = Vector3::zeros();
    let bodies = vec![body];
    let (ground, time_step) = (None, h);
    let given = Parameters { bodies, ground, gravity, time_step, rotation: form, ..usual };
    euler(given)
}

/// State that spins almost about the middle axis, where the body flips over repeatedly.
fn spinning(speed: f64) -> State {
    let axes = rotation(&Vector4::new(0.7, 0.3, -0.5, 0.4).normalize());
    State {
        position: Vector3::zeros(),
        attitude: Vector4::new(0.5, -0.5, 0.1, 0.7).normalize(),
        velocity: Vector3::new(1.0, 2.0, 3.0),
        spin: speed * (axes * Vector3::new(0.3, 1.0, 0.2)).normalize(),
    }
}

/// Angular momentum about the centre of mass at the state's time [N m s, world frame].
fn angular_momentum(world: &World, state: &State) -> Vector3<f64> {
    let (body, h) = (&world.bodies()[0], world.time_step());
    rotation(&state.attitude) * world.rotation().momentum(body.inertia(), &state.spin, h)
}

/// Largest relative error of the angular momentum and of the energy, and the trend of the energy
/// (last quarter against the first).
fn drift(form: Rotation, speed: f64, steps: usize) -> [f64; 3] {
    let world = askew(form, 0.002);
    let mut state = spinning(speed);
    let (l0, e0) = (angular_momentum(&world, &state), energy::total(&world, &[state]));
    let (mut momentum, mut energies) = (0.0_f64, Vec::new());
    for _ in 0..steps {
        state = world.free_flight(0, &state, &Wrench::zero());
        momentum = momentum.max((angular_momentum(&world, &state) - l0).norm() / l0.norm());
        energies.push((energy::total(&world, &[state]) - e0) / e0);
    }
    let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len() as f64;
    let trend = mean(&energies[3 * steps / 4..]) - mean(&energies[..steps / 4]);
    [momentum, energies.iter().fold(0.0, |most, e| most.max(e.abs())), trend]
}

/// Checks the conservation of the momentum form. Angular momentum holds to rounding of 10⁴ steps
/// and their Newton iterations. The energy oscillates by at most 0.1 (h|ω|)². Its trend over 20 s
/// is less than a tenth of that.
#[test]
fn the_momentum_form_keeps_angular_momentum_and_energy() {
    for speed in [1.0, 3.0, 10.0, 20.0, 50.0] {
        let [momentum, swing, trend] = drift(Rotation::Momentum, speed, 10_000);
        let square = (0.002 * speed).powi(2);
        assert!(momentum < 1e-12, "{speed}: {momentum:e}");
        assert!(swing < 0.1 * square, "{speed}: {swing:e}");
        assert!(trend.abs() < 0.01 * square, "{speed}: {trend:e}");
    }
}

/// Checks the losses of the tutorial's form in 20 s. At 1 rad/s they are 1.2e-3 of the angular
/// momentum and 1e-4 of the energy. At 10 rad/s they are an eighth and a fifth, at 50 rad/s most of
/// both.
#[test]
fn tutorial_form_loses_angular_momentum_and_energy() {
    for (speed, momentum, energy) in
        [(1.0, 1.16e-3, 9.9e-5), (10.0, 0.127, 0.189), (50.0, 0.767, 0.887)]
    {
        let [lost, fallen, trend] = drift(Rotation::Tutorial, speed, 10_000);
        assert!((lost / momentum - 1.0).abs() < 0.01, "{speed}: {lost:e}");
        assert!((fallen / energy - 1.0).abs() < 0.01, "{speed}: {fallen:e}");
        assert!(trend < 0.0, "{speed}: {trend:e}");
    }
}

/// Checks the orders of both forms: half the step divides the momentum form's error by four, the
/// tutorial's by two.
#[test]
fn the_momentum_form_is_of_second_order() {
    for speed in [1.0, 10.0] {
        for (form, order) in [(Rotation::Momentum, 4.0), (Rotation::Tutorial, 2.0)] {
            let [coarse, fine] = [200, 400].map(|steps| error(form, speed, steps));
            for (coarse, fine) in coarse.iter().zip(fine) {
                assert!((coarse / fine / order - 1.0).abs() < 0.06, "{form:?} {coarse:e} {fine:e}");
            }
        }
    }
}

/// Errors after one second of free rotation in `steps` steps: attitude, and relative body momentum.
/// The reference is a Runge–Kutta run with tiny steps from the spin I⁻¹ P⁻(ω).
fn error(form: Rotation, speed: f64, steps: i32) -> [f64; 2] {
    let world = askew(form, 1.0 / f64::from(steps));
    let (body, h) = (&world.bodies()[0], world.time_step());
    let momentum = |state: &State| form.momentum(body.inertia(), &state.spin, h);
    let start = spinning(speed);
    let end = (0..steps).fold(start, |state, _| world.free_flight(0, &state, &Wrench::zero()));
    let spin = body.inertia_inverse() * momentum(&start);
    let tiny = |state: State, _| rk4_step(body, &state, &Wrench::zero(), 1.0 / 40_000.0);
    let exact = (0..40_000).fold(State { spin, ..start }, tiny);
    let turned = rotation(&end.attitude) - rotation(&exact.attitude);
    let other = body.inertia() * exact.spin;
    [turned.norm(), (momentum(&end) - other).norm() / other.norm()]
}

/// Checks that a body of equal moments keeps its spin in both forms, to the error of Newton's
/// method, 4 ε. In 1000 steps of 2 ms it turns by 40 rad in the momentum form, to rounding of its
/// unit quaternion, and by 2000 atan(0.02) in the tutorial's form.
#[test]
fn without_torque_a_cube_keeps_its_spin() {
    let [momentum, tutorial] = Rotation::ALL.map(|rotation| {
        let cube = euler(Parameters { rotation, ..tutorial_parameters() });
        let step = |state, _| cube.free_flight(0, &state, &Wrench::zero());
        (0..1000).fold(spinning(20.0), step)
    });
    assert!((momentum.spin - tutorial.spin).amax() < 1e-13, "{momentum:?} {tutorial:?}");
    let start = spinning(20.0);
    let turned = |angle: f64| {
        let axis = start.spin.normalize() * (0.5 * angle).sin();
        left(&start.attitude) * Vector4::new((0.5 * angle).cos(), axis[0], axis[1], axis[2])
    };
    assert!((momentum.attitude - turned(40.0)).amax() < 1e-12, "{momentum:?}");
    assert!((tutorial.attitude - turned(2000.0 * 0.02_f64.atan())).amax() < 1e-12);
}

/// Checks two bricks with rotated axes that collide off-centre in empty space, with friction. The
/// total angular momentum is conserved, to the solver's residual.
#[test]
fn a_pair_in_free_space_keeps_its_angular_momentum() {
    let brick = |mass: f64, sides: [f64; 3]| {
        RigidBody::solid_box(mass, 0.5 * Vector3::from(sides)).unwrap()
    };
    let bodies = vec![brick(2.0, [0.4, 0.3, 0.2]), brick(1.0, [0.2, 0.5, 0.3])];
    let given = Parameters {
        bodies,
        ground: None,
        gravity: Vector3::zeros(),
        friction: 0.5,
        rotation: Rotation::Momentum,
        ..tutorial_parameters()
    };
    let world = euler(given);
    let place = |position: [f64; 3], velocity: [f64; 3], spin: [f64; 3]| State {
        position: position.into(),
        attitude: Vector4::new(0.9, 0.1, -0.3, 0.2).normalize(),
        velocity: velocity.into(),
        spin: spin.into(),
    };
    let starts = [
        place([-0.6, 0.08, 0.05], [3.0, 0.0, 0.0], [4.0, -6.0, 3.0]),
        place([0.0; 3], [0.0; 3], [-5.0, 2.0, 7.0]),
    ];
    let total = |states: &[State]| -> Vector3<f64> {
        let of = |(body, state): (&RigidBody, &State)| {
            let turning = rotation_of(&world, body, state);
            state.position.cross(&(body.mass() * state.velocity)) + turning
        };
        world.bodies().iter().zip(states).map(of).sum()
    };
    let motion = Motion::contact(NativeSolver::new(&world));
    let mut run = Simulation::new(world.clone(), starts, motion).unwrap();
    let mut record = StepRecord::new();
    let (start, mut touched, mut lacked) = (total(&starts), 0, 0.0);
    for k in 0..400 {
        run.step(&mut record).unwrap();
        assert_ne!(record.status(), StepStatus::Failed, "{k}");
        touched += usize::from(record.status() == StepStatus::Converged);
        lacked += record.certificate().dynamics;
        let away = (total(record.next_states()) - start).norm() / start.norm();
        assert!(away < 1e-12, "{k}: {away:e}, residuals {lacked:e}");
    }
    assert!(touched > 0, "they meet");
}

/// Angular momentum A P⁻(ω) of a body.
fn rotation_of(world: &World, body: &RigidBody, state: &State) -> Vector3<f64> {
    let momentum = world.rotation().momentum(body.inertia(), &state.spin, world.time_step());
    rotation(&state.attitude) * momentum
}

/// Checks that the certificate rejects a step of the other form. The error is h (G − G′), of order
/// h |ω|² times the reach.
#[test]
fn certificate_distinguishes_the_rotation_forms() {
    let (none, start) = (Wrench::zero(), spinning(10.0));
    let worlds = Rotation::ALL.map(|form| askew(form, 0.002));
    for (own, other) in [(0, 1), (1, 0)] {
        let next = worlds[own].free_flight(0, &start, &none);
        let judge = |world: &World| {
            let (states, next, wrenches) = (&[start], &[next], &[none]);
            let claim = Claim { states, next, wrenches, contacts: &[], joints: &[], gears: &[] };
            Certifier::new()
                .contact_step(world, &claim, std::iter::empty::<Vector3<f64>>())
                .dynamics
        };
        let (right, wrong) = (judge(&worlds[own]), judge(&worlds[other]));
        assert!(right < 1e-12 && wrong > 1e-4, "{right:e} {wrong:e}");
    }
}

/// Checks that the energy of a flight under gravity is constant to rounding. At rest it is the
/// potential energy.
#[test]
fn the_energy_of_a_flight_is_that_which_the_step_keeps() {
    let given = Parameters { rotation: Rotation::Momentum, ..tutorial_parameters() };
    let world = euler(given);
    let mut state = spinning(3.0);
    let start = energy::total(&world, &[state]);
    for _ in 0..1000 {
        state = world.free_flight(0, &state, &Wrench::zero());
        let now = energy::total(&world, &[state]);
        assert!((now - start).abs() < 1e-11 * 10.0 * 9.81 * 20.0, "{now} {start}");
    }
    let zero = Vector3::zeros();
    let rest = State { velocity: zero, spin: zero, ..state };
    let cube = &world.bodies()[0];
    assert_eq!(energy::kinetic(&world, cube, &rest), 0.0);
    assert_eq!(energy::total(&world, &[rest]), 10.0 * 9.81 * rest.position[2]);
}

proptest! {
    #![proptest_config(cases(256))]

    /// Checks that G is (P⁺(ω⁺) − P⁻(ω) − I (ω⁺ − ω))/h. P⁺(ω) is P⁻ with reversed time, and a step
    /// that turns with ω maps one to the other.
    #[test]
    fn gyroscopic_term_is_the_change_of_momentum_minus_inertia_times_spin(
        inertia in inertia(), old in any_state(), new in any_state(), h in 1e-3..0.1
    ) {
        let form = Rotation::Momentum;
        let momentum = |spin: &Vector3<f64>, h: f64| form.momentum(&inertia, spin, h);
        let (before, after) = (momentum(&old.spin, h), momentum(&new.spin, -h));
        let turned = inertia * (new.spin - old.spin);
        let term = form.gyroscopic(&inertia, &old.spin, &new.spin, h);
        let scale = after.norm() + before.norm();
        prop_assert!((after - before - turned - h * term).norm() < 1e-14 * scale.max(1.0));
        let q = old.attitude.normalize();
        let next = StepMap { form, time_step: h }.advance(&q, &new.spin);
        let (begun, ended) = (rotation(&q) * after, rotation(&next) * momentum(&new.spin, h));
        prop_assert!((begun - ended).norm() < 1e-13 * scale.max(1.0));
    }

    /// Checks the slope against central differences. For a cubic their error is d² times the third
    /// derivative.
    #[test]
    fn gyroscopic_jacobian_agrees_with_differences(
        inertia in inertia(), old in any_state(), new in any_state(), h in 1e-3..0.1,
        along in vector(1.0)
    ) {
        for form in Rotation::ALL {
            let term = |spin| form.gyroscopic(&inertia, &old.spin, &spin, h);
            let d = 1e-4;
            let difference = (term(new.spin + d * along) - term(new.spin - d * along)) / (2.0 * d);
            let slope = form.gyroscopic_slope(&inertia, &new.spin, h) * along;
            prop_assert!((difference - slope).norm() < 1e-8, "{form:?}");
        }
    }
}
