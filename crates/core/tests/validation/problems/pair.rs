//! Two cubes that collide in empty space, and the momenta of free bodies.
//!
//! P⁻(ω) is the angular momentum of a state in the momentum form of the rotation (eq. 34 of
//! `docs/formulation.md`). The discrete equations conserve it in free motion, unlike I ω.

use crate::prelude::*;
use tumble_core::simulation::random::random_attitude;

const HALF_SIDES: [f64; 2] = [0.2, 0.15]; // m
const SECOND: f64 = 0.6; // The second cube, in masses of the first
const HEIGHT: f64 = 40.0; // Far above the ground, m
const WAY: f64 = 4.0; // The simulated distance at the speed of the start, m
/// Initial position of the first cube relative to the second (m).
const APART: Vector3<f64> = Vector3::new(-0.8, 0.08, 0.05);

/// P⁻(ω): angular momentum about the centre of mass (N m s, body frame).
fn turning(body: &RigidBody, state: &State, h: f64) -> Vector3<f64> {
    Rotation::Momentum.momentum(body.inertia(), &state.spin, h)
}

/// Total momentum P (kg m/s) and angular momentum L about `middle` (kg m²/s) at step `k`, in the
/// world frame.
///
/// ```text
/// P = Σ m v,   L = Σ (r − middle) × m v + A P⁻(ω)
/// ```
fn momenta(
    bodies: &[Subject],
    run: &TestRun,
    k: usize,
    middle: &Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
    for (index, Subject { body, .. }) in bodies.iter().enumerate() {
        let state = &run.states(index)[k];
        let spinning = turning(body, state, run.time_step);
        let p = body.mass() * state.velocity;
        linear += p;
        angular += (state.position - middle).cross(&p) + rotation(&state.attitude) * spinning;
    }
    (linear, angular)
}

/// Largest changes of P (kg m/s) and L (kg m²/s) over the run.
pub(crate) fn changes(bodies: &[Subject], run: &TestRun, middle: &Vector3<f64>) -> (f64, f64) {
    let (p, l) = momenta(bodies, run, 0, middle);
    (1..=run.steps()).fold((0.0_f64, 0.0_f64), |(strayed, turned), k| {
        let (linear, angular) = momenta(bodies, run, k, middle);
        (strayed.max((linear - p).norm()), turned.max((angular - l).norm()))
    })
}

/// Two spinning cubes meet in empty space, off the centre, with friction: linear and angular
/// momentum of the pair stay, and energy is lost.
pub(crate) const PAIR_IN_FLIGHT: TestProblem = TestProblem {
    name: "pair-in-flight",
    time_step: 0.002,
    inputs: &[(Mass, 2.0), (Friction, 0.5), (Speed, 3.0)],
    bodies: 2,
    ..TestProblem::solved_by(pair_in_flight)
};

/// Checks that P and L are constant, which also holds for finite steps, and that energy does not
/// grow.
fn pair_in_flight(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass, speed, friction] = inputs.all([Mass, Speed, Friction])?;
    let [first, second] = HALF_SIDES.map(Vector3::repeat);
    let [mut a, mut b] =
        [1, 2].map(|seed| State { attitude: random_attitude(seed), ..resting(HEIGHT) });
    a.position += APART;
    a.velocity = v3(speed, 0.0, 0.0);
    a.spin = speed * v3(0.3, -0.6, 0.4);
    b.spin = speed * v3(-0.5, 0.2, 0.7);
    let bodies =
        vec![Subject::solid_box(mass, first, a)?, Subject::solid_box(SECOND * mass, second, b)?];
    let setup = Setup::new(bodies, 0.0, friction, WAY / speed);
    let touches = |step: &TestStep<'_>| step.contacts.iter().any(|contact| contact.carries_force());
    let (run, touched) = runner.watch(&setup, touches)?;
    Refusal::when(!touched.contains(&true), "the cubes pass each other")?;

    let middle = v3(0.0, 0.0, HEIGHT);
    let (strayed, turned) = changes(&setup.bodies, &run, &middle);
    let energy = |k: usize| {
        let energy = |(index, Subject { body, .. }): (usize, &Subject)| {
            let state = &run.states(index)[k];
            let spinning = turning(body, state, run.time_step);
            0.5 * body.mass() * state.velocity.norm_squared()
                + 0.5 * spinning.dot(&(body.inertia_inverse() * spinning))
        };
        setup.bodies.iter().enumerate().map(energy).sum::<f64>()
    };
    let start = energy(0);
    let gained = (1..=run.steps()).map(|k| energy(k) - start).fold(f64::NEG_INFINITY, f64::max);
    // Tolerances from the residuals of all steps. `lacked` (m/s) is the velocity that the momentum
    // equations miss, `astray` (m) the displacement that the velocities do not explain. The
    // impulses of the collision add up to about m v. The energy that a step gains is at most this
    // impulse times the speed by which the contact law is violated.
    let total = (1.0 + SECOND) * mass;
    let lacked = run.sum(|r| r.momentum) + 4.0 * run.flight_rounding();
    let astray = run.sum(|r| r.kinematics) * run.time_step;
    let arm = |state: &State| (state.position[2] - HEIGHT).abs() + state.position.xy().norm();
    let arm = run.all_states().map(arm).fold(1.0, f64::max);
    let turned_off = total * (3.0 * arm * lacked + speed * astray);
    let energy_off = total * speed * (2.0 * lacked + run.largest(|r| r.normal + r.friction));
    Ok(vec![
        at_most_zero(("change of the momentum", "kg m/s"), strayed, total * lacked),
        at_most_zero(("change of the angular momentum", "kg m²/s"), turned, turned_off),
        at_most_zero(("energy above that of the start", "J"), gained, energy_off),
    ])
}
