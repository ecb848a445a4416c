//! Two cubes that meet in empty space, anyhow: momentum stays.

use super::prelude::*;
use crate::mechanics::Rotation;
use crate::mechanics::quaternion::rotation;
use crate::simulation::random::random_attitude;

/// m.
const HALF_SIDES: [f64; 2] = [0.2, 0.15];
/// The second cube, in masses of the first.
const SECOND: f64 = 0.6;
/// Above the ground: nothing comes near it, m.
const HEIGHT: f64 = 40.0;
/// The way that they are watched for at the speed of the start, m.
const WAY: f64 = 4.0;
/// The first cube's place, from the second, m.
const APART: Vector3<f64> = Vector3::new(-0.8, 0.08, 0.05);

/// Linear momentum, and angular momentum about the place of the second cube's start.
type Momentum = (Vector3<f64>, Vector3<f64>);

/// Two cubes.
struct Cubes([RigidBody; 2]);

impl Cubes {
    /// P = Σ m v and L = Σ r × m v + A P⁻(ω), in steps of `h` (s).
    fn momentum(&self, states: [&State; 2], h: f64) -> Momentum {
        let (mut linear, mut angular) = (Vector3::zeros(), Vector3::zeros());
        for (body, state) in self.0.iter().zip(states) {
            let spinning = turning(body, state, h);
            let p = body.mass() * state.velocity;
            let arm = state.position - Vector3::new(0.0, 0.0, HEIGHT);
            linear += p;
            angular += arm.cross(&p) + rotation(&state.attitude) * spinning;
        }
        (linear, angular)
    }

    /// J.
    fn energy(&self, states: [&State; 2], h: f64) -> f64 {
        let energy = |(body, state): (&RigidBody, &State)| {
            let spinning = turning(body, state, h);
            0.5 * body.mass() * state.velocity.norm_squared()
                + 0.5 * spinning.dot(&(body.inertia_inverse() * spinning))
        };
        self.0.iter().zip(states).map(energy).sum()
    }
}

/// P⁻(ω), N m s, body.
fn turning(body: &RigidBody, state: &State, h: f64) -> Vector3<f64> {
    Rotation::Momentum.momentum(body.inertia(), &state.spin, h)
}

fn states(run: &Run, k: usize) -> [&State; 2] {
    [&run.states(0)[k], &run.states(1)[k]]
}

/// Two cubes that meet in empty space.
pub static PAIR_IN_FLIGHT: Posed = Posed {
    name: "pair-in-flight",
    about: "Two spinning cubes meet in empty space, off the centre, with friction: linear and \
            angular momentum of the pair stay, and energy is lost.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 2.0), (Input::Friction, 0.5), (Input::Speed, 3.0)],
    bodies: 2,
    ..Posed::by(pair_in_flight)
};

/// Forces on the two are opposite and at one point of the world, so that Σ m v and
/// Σ r × m v + A P⁻(ω) (eq. 34) stay. The step's do so to the last digit: r⁺ = r + h v⁺ adds
/// nothing to r × m v, and A⁺ P⁻(ω⁺) is A P⁺(ω⁺).
fn pair_in_flight(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let [mass, speed, friction] = inputs.all([Input::Mass, Input::Speed, Input::Friction])?;
    let [first, second] = HALF_SIDES.map(Vector3::repeat);
    let bodies = [RigidBody::solid_box(mass, first)?, RigidBody::solid_box(SECOND * mass, second)?];
    let cubes = Cubes(bodies.clone());
    let [mut a, mut b] =
        [1, 2].map(|seed| State { attitude: random_attitude(seed), ..resting(HEIGHT) });
    a.position += APART;
    a.velocity = Vector3::new(speed, 0.0, 0.0);
    a.spin = speed * Vector3::new(0.3, -0.6, 0.4);
    b.spin = speed * Vector3::new(-0.5, 0.2, 0.7);
    let starts = [a, b];
    let subjects = bodies.into_iter().zip(starts).map(|(body, at)| Subject::new(body, at));
    let setup = Setup::new(subjects.collect(), 0.0, friction, WAY / speed);
    let touches = |step: &Taken<'_>| step.contacts.iter().any(|contact| contact.carries_force());
    let (run, touched) = laboratory.watch(&setup, touches)?;
    Unsuitable::when(!touched.contains(&true), || "the cubes pass each other".to_owned())?;

    let (p, l) = cubes.momentum([&starts[0], &starts[1]], run.time_step);
    let (mut strayed, mut turned, mut gained) = (0.0_f64, 0.0_f64, f64::NEG_INFINITY);
    let energy = cubes.energy([&starts[0], &starts[1]], run.time_step);
    for k in 1..=run.steps() {
        let (linear, angular) = cubes.momentum(states(&run, k), run.time_step);
        strayed = strayed.max((linear - p).norm());
        turned = turned.max((angular - l).norm());
        gained = gained.max(cubes.energy(states(&run, k), run.time_step) - energy);
    }
    // What velocities lack, and angles that lag behind spins. All impulses of the meeting add
    // up to some m v at most, each of them with the speed that its law misses.
    let total = (1.0 + SECOND) * mass;
    let lacked = run.sum(|residual| residual.momentum) + 4.0 * run.flight_rounding();
    let astray = run.sum(|residual| residual.kinematics) * run.time_step;
    let arm = run
        .all_states()
        .map(|state| (state.position[2] - HEIGHT).abs() + state.position.xy().norm());
    let arm = arm.fold(1.0, f64::max);
    Ok(Findings {
        quantities: vec![
            at_most_zero(("change of the momentum", "kg m/s"), strayed, total * lacked),
            at_most_zero(
                ("change of the angular momentum", "kg m²/s"),
                turned,
                total * (3.0 * arm * lacked + speed * astray),
            ),
            at_most_zero(
                ("energy above that of the start", "J"),
                gained,
                total * speed * (2.0 * lacked + run.largest(|r| r.normal + r.friction)),
            ),
        ],
        curve: Curve::of(("momentum along the flight", "kg m/s"), &run, |k| {
            cubes.momentum(states(&run, k), run.time_step).0[0]
        })
        .beside(|_| p[0]),
    })
}
