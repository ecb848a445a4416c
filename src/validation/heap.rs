//! 216 balls without friction that fall on the ground and on each other: the 666 test of
//! SimBenchmark, for its first part.
//!
//! Where the balls go nobody knows, but for what all laws have in common: forces of a pair are
//! opposite and go through both centres, those of the ground are vertical. So the horizontal momentum
//! and the angular momentum about the vertical stay, no ball ever turns, what the ground gives is the
//! weight and the change of the momentum, the energy never grows, and no ball is in another or below
//! the ground. The plane between two balls is across their line of centres at the step's start, and the
//! distance at its end is no less than that along it: no penetration is left to the order of h.

use super::prelude::*;
use crate::simulation::random::Draws;

/// The test as it is.
pub const BALLS_666: Posed = Posed {
    name: "balls-666",
    about: "6 × 6 × 6 balls without friction fall on the ground and on each other (SimBenchmark's 666 \
            test, its first 0.3 s): nothing penetrates, momentum stays, energy does not grow.",
    time_step: 0.01,
    inputs: &[(Input::Mass, 10.0), EARTH],
    bodies: BALLS,
    ..Posed::by(|inputs, laboratory| fall(inputs, laboratory, 0.0))
};

/// The elastic test.
pub const ELASTIC_666: Posed = Posed {
    name: "elastic-666",
    about: "The same with restitution 1 (SimBenchmark's elastic 666 test, its first 0.3 s): what the \
            step keeps of the energy, ½ v² + g z − ½ h g v, does not grow.",
    solve: |inputs, laboratory| fall(inputs, laboratory, 1.0),
    ..BALLS_666
};

/// Balls along each edge.
const EDGE: usize = 6;
const BALLS: usize = EDGE * EDGE * EDGE;
/// R, between the centres, of the lowest centres above the ground, and what is drawn to each
/// coordinate, m.
const RADIUS: f64 = 0.1;
const APART: f64 = 0.21;
const HEIGHT: f64 = 0.101;
const JITTER: f64 = 1e-3;
const SEED: u32 = 666;
/// The test has 10 s; the first of them, in which the layers meet, fit into a few seconds of work, s.
const DURATION: f64 = 0.3;

/// Where the balls start.
fn starts() -> Vec<State> {
    let mut draws = Draws::new(SEED);
    let place = |index: usize| {
        let at = |number: usize| (number as f64 - 0.5 * (EDGE as f64 - 1.0)) * APART;
        let mut start = resting(HEIGHT + (index / (EDGE * EDGE)) as f64 * APART);
        (start.position[0], start.position[1]) = (at(index % EDGE), at(index / EDGE % EDGE));
        for coordinate in &mut start.position {
            *coordinate += JITTER * draws.unit();
        }
        start
    };
    (0..BALLS).map(place).collect()
}

/// ½ v² + g (z − e ½ h v_z), the mean of all balls, J/kg: the energy, or with e = 1 what of it the step
/// keeps in flight and in impacts (eq. 30).
fn energy(run: &Run, k: usize, gravity: f64, e: f64) -> f64 {
    let of = |index: usize| {
        let state = &run.states(index)[k];
        let height = state.position[2] - e * 0.5 * run.time_step * state.velocity[2];
        0.5 * state.velocity.norm_squared() + gravity * height
    };
    (0..BALLS).map(of).sum::<f64>() / BALLS as f64
}

/// The means of all momenta and of all angular momenta about the z axis, a mass.
fn momentum(run: &Run, k: usize) -> (Vector3<f64>, f64) {
    let (mut linear, mut angular) = (Vector3::zeros(), 0.0);
    for index in 0..BALLS {
        let state = &run.states(index)[k];
        linear += state.velocity / BALLS as f64;
        angular += state.position.xy().perp(&state.velocity.xy()) / BALLS as f64;
    }
    (linear, angular)
}

/// The deepest penetration of two balls or of a ball and the ground, m, and the sum of all squares.
fn penetration(places: &[Vector3<f64>]) -> (f64, f64) {
    let (mut deepest, mut squares) = (0.0_f64, 0.0);
    let mut add = |depth: f64| {
        deepest = deepest.max(depth);
        squares += depth * depth;
    };
    for (index, place) in places.iter().enumerate() {
        if place[2] < RADIUS {
            add(RADIUS - place[2]);
        }
        for other in &places[..index] {
            let square = (place - other).norm_squared();
            if square < 4.0 * RADIUS * RADIUS {
                add(2.0 * RADIUS - square.sqrt());
            }
        }
    }
    (deepest, squares)
}

/// Laws of conservation, all of them exact in the step as well; the energy falls. A contact that
/// ends with the gap 0 has lost energy: its impulse times u_n = 0 does no work on the motion at
/// the step's end, and ½ m |v⁺ − v|² is lost.
fn fall(inputs: &Inputs, laboratory: &mut Laboratory<'_>, restitution: f64) -> Solved {
    let (mass, gravity) = (inputs.get(Input::Mass)?, inputs.get(Input::Gravity)?);
    let bodies = Subject::balls(mass, RADIUS, starts())?;
    let (h, mut pushed) = (laboratory.time_step(), 0.0);
    let (mut deepest, mut squares, mut places) = (0.0_f64, 0.0, Vec::new());
    let setup = Setup { restitution, ..Setup::new(bodies, gravity, 0.0, DURATION) };
    let (run, _) = laboratory.watch(&setup, |step| {
        let ground = step.contacts.iter().filter(|c| c.key.partner == Partner::Ground);
        pushed += h * ground.map(|contact| contact.force[2]).sum::<f64>();
        places.clear();
        places.extend(step.after.iter().map(|state| state.position));
        let (depth, square) = penetration(&places);
        deepest = deepest.max(depth);
        squares += square;
    })?;

    let (steps, t) = (run.steps(), run.time(run.steps()));
    let ((linear, angular), start) = (momentum(&run, steps), momentum(&run, 0));
    let energies: Vec<f64> = (0..=steps).map(|k| energy(&run, k, gravity, restitution)).collect();
    let gains = energies.windows(2).map(|two| two[1] - two[0]);
    let gained = gains.fold(f64::NEG_INFINITY, f64::max);
    let spin = run.all_states().map(|state| state.spin.norm()).fold(0.0, f64::max);

    let count = BALLS as f64;
    let lacked = run.sum(|r| r.momentum) + run.flight_rounding();
    // A gap that is off by δ h does the work of its force over it, and lifts all that is above.
    let seat = run.seat();
    let fastest = (2.0 * gravity * EDGE as f64 * APART).sqrt();
    let worked =
        gravity * seat + fastest * run.largest(|r| r.momentum) + 64.0 * f64::EPSILON * energies[0];
    Ok(Findings {
        quantities: vec![
            at_most_zero(("deepest penetration", "m"), deepest, 2.0 * seat),
            at_most_zero(
                ("mean sum of squared penetrations", "m²"),
                squares / steps as f64,
                6.0 * count * (2.0 * seat).powi(2),
            ),
            at_most_zero(
                ("horizontal speed of the common centre", "m/s"),
                linear.xy().norm(),
                lacked,
            ),
            exactly(
                ("angular momentum about the vertical, a mass", "m²/s"),
                angular,
                start.1,
                EDGE as f64 * APART * lacked,
            ),
            exactly(
                ("impulse of the ground, a mass", "m/s"),
                pushed / (count * mass),
                linear[2] + gravity * t,
                lacked,
            ),
            at_most_zero(("largest gain of energy, a mass", "J/kg"), gained, worked),
            at_most_zero(
                ("largest spin", "rad/s"),
                spin,
                2.0 * run.sum(|r| r.momentum) / RADIUS + run.flight_rounding() / RADIUS,
            ),
        ],
        curve: Curve::of(("energy", "J"), &run, |k| energies[k]),
    })
}
