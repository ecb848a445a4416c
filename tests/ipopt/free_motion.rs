//! Motion without contact: the tutorial's recorded flight, Ipopt's solution in the air, and the
//! laws of a free body.

use crate::common::prelude::*;
use crate::common::{
    SEEDS, any_state, any_world, any_wrench, body, cases, certify, points, solve, state,
    tutorial_parameters, tutorial_rows, tutorial_world, vector, wrench_of,
};
use proptest::prelude::*;
use tumble::ipopt::Options;
use tumble::solver::ipopt::IpoptSolver;
use tumble::step_nlp::{ProgramPoint, SMOOTHING, StepNlp, layout};
use tumble_core::mechanics::dynamics::{free_flight, rk4_step};
use tumble_core::simulation::scene::TutorialScene;

/// Simulation of the tutorial's cube, with the tutorial's rule for contact flags.
fn flight(start: State) -> Simulation<'static> {
    let world = tutorial_world();
    let solver = IpoptSolver::new(&world, Options::default()).unwrap();
    let motion = Motion::Contact { detection: Detection::Height, solver: Box::new(solver) };
    Simulation::new(world, [start], motion).unwrap()
}

/// Compares the flight with the tutorial's.
///
/// The recorded corner forces in the air are up to 1e-8 N, because Ipopt relaxes their bounds. With
/// these forces one of our steps equals the recorded one to the tolerance of a converged Newton
/// iteration. Without them a whole flight differs by their effect in k steps.
#[test]
fn the_flight_to_the_ground_is_the_tutorials() {
    for seed in SEEDS {
        let rows = tutorial_rows(seed);
        let scene = TutorialScene::drop();
        let start = scene.start(scene.attitude(seed));
        assert!((start.to_vector() - rows[0].state().to_vector()).amax() < 3e-16, "seed {seed}");
        let mut whole = flight(start);
        let mut record = StepRecord::new();
        let airborne = rows.windows(2).take_while(|pair| pair[1].flagged() == 0 && pair[1].solved);
        let mut steps = 0.0;
        for pair in airborne {
            let (old, new, forces) = (pair[0].state(), pair[1].state(), pair[1].forces());
            assert!(forces.iter().all(|force| force.amax() <= 1e-8), "seed {seed}");
            let mut single = flight(old);
            let wrench = wrench_of(body(single.world()), &old, &forces);
            single.set_wrench(0, wrench).unwrap();
            single.step(&mut record).unwrap();
            assert_eq!(record.status(), StepStatus::Free);
            let apart = (single.state().to_vector() - new.to_vector()).amax();
            assert!(apart < 1e-13, "seed {seed}, k = {}: {apart:e}", pair[1].k);

            whole.step(&mut record).unwrap();
            assert_eq!(record.status(), StepStatus::Free);
            steps += 1.0;
            // 8 corners, each with at most √3 · 1e-8 N at a lever of √2 m about an axis.
            let speed = steps * 0.002 * 8e-8 / 10.0 + 1e-12;
            let spin = steps * 0.002 * 8e-8 * 6.0_f64.sqrt() / 0.01;
            assert!((whole.state().velocity - new.velocity).amax() < speed);
            assert!((whole.state().position - new.position).amax() < steps * 0.002 * speed);
            assert!((whole.state().spin - new.spin).amax() < spin);
            assert!((whole.state().attitude - new.attitude).amax() < steps * 0.002 * spin);
        }
        // 204 to 237 steps: the fall of 2.5 m minus the corner's reach.
        assert!(steps > 200.0, "seed {seed}: {steps}");
    }
}

/// Checks that Ipopt finds free flight and no force. Rows hold to the tolerance 1e-8. With all the
/// tutorial's rows Ipopt has fewer free variables than equations and relaxes the bounds by 1e-8 N.
/// With 8 corners, h/m, and h/I times the levers above, that is 1.6e-11 m/s and 3.9e-8 rad/s.
#[test]
fn ipopt_in_the_air_finds_free_flight_and_no_force() {
    let world = tutorial_world();
    let wrench =
        Wrench { force: Vector3::new(3.0, -2.0, 5.0), torque: Vector3::new(0.3, 0.1, -0.2) };
    let options = Options { tolerance: 1e-8, ..Options::default() };
    let tutorial = IpoptSolver::tutorial(&world, options.clone()).unwrap();
    let solvers = [tutorial, IpoptSolver::new(&world, options).unwrap()];
    for (mut solver, name) in solvers.into_iter().zip(["tutorial", "posed"]) {
        for seed in SEEDS {
            let state = TutorialScene::drop().start(TutorialScene::drop().attitude(seed));
            let (step, start) = ((&state, &wrench), StepSolution::free(&[state]));
            let (report, solution) = solve(&mut solver, &world, step, &[], &start);
            assert_eq!(report.status, StepStatus::Converged, "{name} {seed}");
            assert!(solution.contacts.is_empty());
            let free = world.free_flight(0, &state, &wrench);
            let apart = (solution.states[0].to_vector() - free.to_vector()).abs();
            assert!(apart.rows(0, 10).max() < 1e-8, "{name} {seed}: {apart}");
            assert!(apart.rows(10, 3).max() < 5e-8, "{name} {seed}: {apart}");
        }
    }
}

/// Brick with rotated principal axes, at the time step `h`.
fn askew_brick(h: f64, gravity: Vector3<f64>) -> World {
    let axes = rotation(&Vector4::new(0.7, 0.3, -0.5, 0.4).normalize());
    let inertia = axes * Matrix3::from_diagonal(&Vector3::new(1.0, 2.0, 2.5)) * axes.transpose();
    let inertia = 0.5 * (inertia + inertia.transpose());
    let body = RigidBody::new(3.0, inertia, &[Vector3::new(1.0, 0.6, 0.4)]).unwrap();
    let usual = tutorial_parameters();
    let parameters = Parameters { bodies: vec![body], gravity, time_step: h, ..usual };
    World::new(parameters).unwrap()
}

/// The same world with another equation of rotation.
fn in_form(world: &World, rotation: Rotation) -> World {
    World::new(Parameters { rotation, ..world.parameters().clone() }).unwrap()
}

fn thrown() -> State {
    state(&[0.1, 0.2, 5.0, 0.5, 0.5, -0.5, 0.5, 1.0, 2.0, 3.0, 1.0, 4.0, -2.0])
}

/// Checks that the error R(q⁺) I ω⁺ − R(q) I ω of a torque-free step is of order h². Halving h
/// divides it by 4, up to the next order, h|ω| = 0.5 %.
#[test]
fn angular_momentum_in_the_world_is_kept_to_second_order_a_step() {
    let momentum = |world: &World, state: &State| {
        rotation(&state.attitude) * (body(world).inertia() * state.spin)
    };
    let drift = |h: f64| {
        let world = askew_brick(h, Vector3::zeros());
        let next = world.free_flight(0, &thrown(), &Wrench::zero());
        (momentum(&world, &next) - momentum(&world, &thrown())).norm()
    };
    let ratio = drift(1e-3) / drift(5e-4);
    assert!((ratio - 4.0).abs() < 0.02, "{ratio}");
}

/// Checks convergence under gravity, a force and a torque. A flight of 0.1 s approaches the
/// fourth-order method (itself exact to 1e-10 here) with first order. Halving h halves the error,
/// up to the next order, 2 %.
#[test]
fn the_step_converges_to_the_equations_of_motion() {
    let gravity = Vector3::new(2.0, -1.0, -9.0);
    let wrench =
        Wrench { force: Vector3::new(5.0, 1.0, -4.0), torque: Vector3::new(2.0, -3.0, 4.0) };
    let body = body(&askew_brick(0.1, gravity)).clone();
    let total = Wrench { force: wrench.force + gravity * body.mass(), ..wrench };
    let exact = (0..100).fold(thrown(), |state, _| rk4_step(&body, &state, &total, 1e-3));
    let error = |steps: i32| {
        let world = askew_brick(0.1 / f64::from(steps), gravity);
        let end = (0..steps).fold(thrown(), |state, _| world.free_flight(0, &state, &wrench));
        (end.to_vector() - exact.to_vector()).abs()
    };
    let (coarse, fine) = (error(200), error(400));
    for (coarse, fine) in coarse.iter().zip(&fine) {
        assert!(*coarse < 1e-3, "{coarse:e}");
        // A constant force leaves only rounding in the velocity: 1e-12.
        assert!((coarse - 2.0 * fine).abs() < 0.04 * fine + 1e-12, "{coarse:e} {fine:e}");
    }
}

/// Checks bodies that turn by 3 and 10 rad per step, where Newton's method from ω stalls. The
/// equation still has a solution, because the energy bounds ω⁺. The step finds it to rounding.
#[test]
fn the_gyroscopic_equation_is_solved_at_any_speed() {
    for (moments, spin, h) in [
        ([1.112, 0.987, 0.392], [-27.4, -95.6, 10.5], 0.03),
        ([0.293, 0.224, 0.145], [-76.4, -32.7, -55.6], 0.1),
        ([1.327, 1.126, 0.868], [19.7, -66.7, 71.8], 0.1),
    ] {
        let (inertia, spin) = (Matrix3::from_diagonal(&moments.into()), Vector3::from(spin));
        let body = RigidBody::new(1.0, inertia, &[Vector3::repeat(1.0)]).unwrap();
        let start = State { spin, ..thrown() };
        for form in Rotation::ALL {
            let none = (Wrench::zero(), Vector3::zeros());
            let next = free_flight(&body, &start, &none.0, &none.1, h, form).spin;
            let gyroscopic = h * form.gyroscopic(&inertia, &spin, &next, h);
            let residual = (inertia * (next - spin) + gyroscopic).norm();
            // The residual of a spin that is right to its last bits.
            let slope = inertia + h * form.gyroscopic_slope(&inertia, &next, h);
            let least = f64::EPSILON * slope.norm() * next.norm();
            assert!(residual <= 4.0 * least, "{form:?} {moments:?}: {residual:e} {least:e}");
        }
    }
}

proptest! {
    #![proptest_config(cases(256))]

    /// Checks the energy and momentum loss of the tutorial's form. With Δ = ω⁺ − ω, I Δ = −h ω⁺ × I
    /// ω⁺ is perpendicular to ω⁺ and to I ω⁺. Hence the energy decreases by exactly ½ Δ·IΔ and |I
    /// ω|² by exactly |IΔ|², both of order h². The tolerance is rounding of λ|ω|² and λ²|ω|², with
    /// the largest moment λ.
    #[test]
    fn a_free_spin_loses_energy_and_momentum_of_second_order_only(
        world in any_world(), start in any_state(), force in vector(10.0)
    ) {
        let wrench = Wrench { force, torque: Vector3::zeros() };
        let world = in_form(&world, Rotation::Tutorial);
        let next = world.free_flight(0, &start, &wrench);
        let inertia = body(&world).inertia();
        let change = inertia * (next.spin - start.spin);
        let momentum = |state: &State| inertia * state.spin;
        let energy = |state: &State| 0.5 * state.spin.dot(&momentum(state));
        let square = |state: &State| momentum(state).norm_squared();
        let moment = inertia.symmetric_eigenvalues().max();
        let scale = moment * start.spin.norm_squared();
        let lost = 0.5 * (next.spin - start.spin).dot(&change);
        prop_assert!((energy(&next) - energy(&start) + lost).abs() < 1e-13 * scale);
        let lost = change.norm_squared();
        prop_assert!((square(&next) - square(&start) + lost).abs() < 1e-13 * scale * moment);
    }

    /// Checks free flight with the certificate's independent equations. The tolerance covers
    /// rounding of positions and attitudes divided by h, 2e-16 · 5 / 0.001 m/s.
    #[test]
    fn free_flight_satisfies_the_equations_of_its_step(
        world in any_world(), start in any_state(), wrench in any_wrench()
    ) {
        let next = world.free_flight(0, &start, &wrench);
        let none = vec![Vector3::zeros(); points(&world)];
        let residual = certify(&world, (&start, &next), &none, &wrench).dynamics;
        prop_assert!(residual < 1e-12, "{residual:e}");
    }

    /// Checks that contact forces and the equal external wrench have the same effect in the
    /// dynamics rows, to rounding.
    #[test]
    fn contact_forces_and_their_wrench_have_equal_effect(
        world in any_world(), start in any_state(), next in any_state(), force in vector(10.0)
    ) {
        let contacts = points(&world);
        let forces: Vec<_> = (0..contacts).map(|i| force * (1.0 - 0.3 * i as f64)).collect();
        let wrench = wrench_of(body(&world), &start, &forces);
        let frame = *world.ground().unwrap().frame();
        let mut nlp = StepNlp::new(world, SMOOTHING).unwrap();
        let mut x = ProgramPoint::free(&next, contacts);
        let (mut inside, mut outside) =
            (vec![0.0; nlp.layout().constraints()], vec![0.0; nlp.layout().constraints()]);
        nlp.set_step(&start, &wrench, []);
        nlp.constraints(x.as_slice(), &mut outside);
        for (i, force) in forces.iter().enumerate() {
            let along = frame.tr_mul(force);
            for axis in 0..3 {
                x.as_mut_slice()[nlp.layout().contact_variables(i)[axis]] = along[axis];
            }
        }
        nlp.set_step(&start, &Wrench::zero(), []);
        nlp.constraints(x.as_slice(), &mut inside);
        for (a, b) in inside.iter().zip(&outside).take(layout::STATE.end) {
            prop_assert!((a - b).abs() < 1e-13 * (1.0 + a.abs()), "{a} {b}");
        }
    }
}
