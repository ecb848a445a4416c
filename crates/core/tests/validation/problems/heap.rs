//! 216 balls without friction that fall on the ground and on each other: the first part of
//! SimBenchmark's 666 test.

use crate::prelude::*;
use tumble_core::simulation::random::Draws;

/// 6 × 6 × 6 balls without friction fall on the ground and on each other (SimBenchmark's 666 test,
/// its first 0.3 s): nothing penetrates, momentum stays, energy does not grow.
pub(crate) const BALLS_666: TestProblem = TestProblem {
    name: "balls-666",
    time_step: 0.01,
    inputs: &[(Mass, 10.0), EARTH],
    bodies: BALLS,
    ..TestProblem::solved_by(|inputs, runner| fall(inputs, runner, 0.0))
};

/// The same with restitution 1 (SimBenchmark's elastic 666 test, its first 0.3 s): what the step
/// keeps of the energy, ½ v² + g z − ½ h g v, does not grow.
pub(crate) const ELASTIC_666: TestProblem = TestProblem {
    name: "elastic-666",
    solve: |inputs, runner| fall(inputs, runner, 1.0),
    ..BALLS_666
};

/// Balls along each edge.
const EDGE: usize = 6;
const BALLS: usize = EDGE * EDGE * EDGE;
/// R, distance of centres, height of the lowest ones and random part of each coordinate (m).
const RADIUS: f64 = 0.1;
const APART: f64 = 0.21;
const HEIGHT: f64 = 0.101;
const JITTER: f64 = 1e-3;
const SEED: u32 = 666;
const DURATION: f64 = 0.3; // The test has 10 s; the layers meet in the first part, s

fn starts() -> Vec<State> {
    let mut draws = Draws::new(SEED);
    let place = |index: usize| {
        let at = |number: usize| (number as f64 - 0.5 * (EDGE as f64 - 1.0)) * APART;
        let height = HEIGHT + (index / (EDGE * EDGE)) as f64 * APART;
        let mut start = at_rest(v3(at(index % EDGE), at(index / EDGE % EDGE), height));
        for coordinate in &mut start.position {
            *coordinate += JITTER * draws.unit();
        }
        start
    };
    (0..BALLS).map(place).collect()
}

/// The mean of ½ v² + g (z − e ½ h v_z), J/kg. It is the energy for e = 0. For e = 1 the scheme
/// conserves it in flight and in impacts (eq. 30).
fn energy(run: &TestRun, k: usize, gravity: f64, e: f64) -> f64 {
    run.mean(k, |state| {
        let height = state.position[2] - e * 0.5 * run.time_step * state.velocity[2];
        0.5 * state.velocity.norm_squared() + gravity * height
    })
}

/// The mean momentum and the mean angular momentum about the z axis, per mass.
fn momentum(run: &TestRun, k: usize) -> (Vector3<f64>, f64) {
    let (mut linear, mut angular) = (Vector3::zeros(), 0.0);
    for index in 0..BALLS {
        let state = &run.states(index)[k];
        linear += state.velocity / BALLS as f64;
        angular += state.position.xy().perp(&state.velocity.xy()) / BALLS as f64;
    }
    (linear, angular)
}

/// The deepest penetration of two balls or of a ball and the ground, m, and the sum of all squares.
fn penetration(balls: &[State]) -> (f64, f64) {
    let (mut deepest, mut squares) = (0.0_f64, 0.0);
    let mut add = |depth: f64| {
        deepest = deepest.max(depth);
        squares += depth * depth;
    };
    for (index, State { position, .. }) in balls.iter().enumerate() {
        if position[2] < RADIUS {
            add(RADIUS - position[2]);
        }
        for other in &balls[..index] {
            let square = (position - other.position).norm_squared();
            if square < 4.0 * RADIUS * RADIUS {
                add(2.0 * RADIUS - square.sqrt());
            }
        }
    }
    (deepest, squares)
}

/// Nothing penetrates or turns, momenta are constant, and the energy does not grow.
fn fall(inputs: &TestInputs, runner: &mut Runner<'_>, restitution: f64) -> SolvedBy {
    let [mass, gravity] = inputs.all([Mass, Gravity])?;
    let bodies = Subject::balls(mass, RADIUS, starts())?;
    let (h, mut pushed) = (runner.time_step, 0.0);
    let (mut deepest, mut squares) = (0.0_f64, 0.0);
    let setup = Setup { restitution, ..Setup::new(bodies, gravity, 0.0, DURATION) };
    let (run, _) = runner.watch(&setup, |step| {
        let ground = step.contacts.iter().filter(|c| c.key.partner == Partner::Ground);
        pushed += h * ground.map(|contact| contact.force[2]).sum::<f64>();
        let (depth, square) = penetration(step.after);
        deepest = deepest.max(depth);
        squares += square;
    })?;

    let (steps, count) = (run.steps(), BALLS as f64);
    let ((linear, angular), start) = (momentum(&run, steps), momentum(&run, 0));
    let energies: Vec<f64> = (0..=steps).map(|k| energy(&run, k, gravity, restitution)).collect();
    let gains = energies.windows(2).map(|two| two[1] - two[0]);
    let gained = gains.fold(f64::NEG_INFINITY, f64::max);
    let spin = largest(run.all_states().map(|state| state.spin.norm()));
    let drift = linear.xy().norm();
    let impulse = pushed / (count * mass);

    let lacked = run.sum(|r| r.momentum) + run.flight_rounding();
    let turned = 2.0 * run.sum(|r| r.momentum) / RADIUS + run.flight_rounding() / RADIUS;
    // A gap that is off by δ h does the work of its force over it, and lifts all that is above.
    let seat = run.seat();
    let fastest = (2.0 * gravity * EDGE as f64 * APART).sqrt();
    let worked =
        gravity * seat + fastest * run.largest(|r| r.momentum) + 64.0 * f64::EPSILON * energies[0];
    let deep = 6.0 * count * (2.0 * seat).powi(2);
    let arm = EDGE as f64 * APART * lacked;
    let fallen = linear[2] + gravity * run.end_time();
    Ok(vec![
        at_most_zero(("deepest penetration", "m"), deepest, 2.0 * seat),
        at_most_zero(("mean sum of squared penetrations", "m²"), squares / steps as f64, deep),
        at_most_zero(("horizontal speed of the common centre", "m/s"), drift, lacked),
        equal(("angular momentum about the vertical, a mass", "m²/s"), angular, start.1, arm),
        equal(("impulse of the ground, a mass", "m/s"), impulse, fallen, lacked),
        at_most_zero(("largest gain of energy, a mass", "J/kg"), gained, worked),
        at_most_zero(("largest spin", "rad/s"), spin, turned),
    ])
}
