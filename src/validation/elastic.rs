//! Balls that lose nothing: 49 of them bounce side by side for ten seconds, a test of SimBenchmark.

use super::prelude::*;

/// Balls along each edge of the grid.
const EDGE: usize = 7;
const BALLS: usize = EDGE * EDGE;
/// m.
const RADIUS: f64 = 0.1;
/// Between the centres, m.
const APART: f64 = 0.3;
/// How high the first one falls from, and how much higher each next one, m.
const DROP: f64 = 1.0;
const HIGHER: f64 = 0.02;
/// s.
const DURATION: f64 = 10.0;

/// 49 elastic balls.
pub static BOUNCING_BALLS: Posed = Posed {
    name: "bouncing-balls",
    about: "49 balls fall from 1 to 2 m and bounce without loss for ten seconds: each keeps its \
            energy, and the step keeps ½ v² + g z − ½ h g v.",
    time_step: 0.01,
    inputs: &[(Input::Mass, 1.0), (Input::Friction, 0.3), EARTH],
    bodies: BALLS,
    ..Posed::by(bouncing_balls)
};

/// The energy of a ball is ½ v² + g z; the step keeps
///
/// ```text
/// H = ½ v² + g z − ½ h g v                                                (30)
/// ```
///
/// in flight and in impacts, so that the energy swings by ½ h g v about it and never drifts.
fn bouncing_balls(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let [mass, g, friction] = inputs.all([Input::Mass, Input::Gravity, Input::Friction])?;
    let h = laboratory.time_step();
    let slowest = (2.0 * g * DROP).sqrt();
    Unsuitable::when(slowest <= 8.0 * g * h, || {
        format!(
            "the lowest ball lands with {slowest:.3} m/s, slower than eight steps' gravity; a \
             smaller time step is needed"
        )
    })?;
    let place = |index: usize| {
        let mut start = resting(RADIUS + DROP + HIGHER * index as f64);
        let places = [index % EDGE, index / EDGE].map(|number| APART * number as f64);
        start.position.fixed_rows_mut::<2>(0).copy_from_slice(&places);
        start
    };
    let balls = Subject::balls(mass, RADIUS, (0..BALLS).map(place))?;
    let setup = Setup::new(balls, g, friction, DURATION);
    let run = laboratory.run(&Setup { restitution: 1.0, ..setup })?;

    let kept = |index: usize, k: usize| {
        let state = &run.states(index)[k];
        let (v, z) = (state.velocity[2], state.position[2]);
        0.5 * v * v + g * z - 0.5 * h * g * v
    };
    let steps = run.steps();
    let all = (0..BALLS).flat_map(|index| (0..=steps).map(move |k| (index, k)));
    let drift = all.map(|(index, k)| (kept(index, k) - kept(index, 0)).abs());
    let drift = drift.fold(0.0, f64::max);
    let energy = |k: usize| {
        let of = |index: usize| {
            let state = &run.states(index)[k];
            0.5 * state.velocity.norm_squared() + g * state.position[2]
        };
        (0..BALLS).map(of).sum::<f64>() / BALLS as f64
    };
    let fastest = (2.0 * g * (DROP + HIGHER * BALLS as f64)).sqrt();
    let slack = slack(&run, fastest) * fastest;
    let swing = (0..=steps).map(|k| (energy(k) - energy(0)).abs()).fold(0.0, f64::max);
    let sideways = run.all_states().map(|state| state.velocity.xy().norm()).fold(0.0, f64::max);
    Ok(Findings {
        quantities: vec![
            at_most_zero(("largest change of ½ v² + g z − ½ h g v", "J/kg"), drift, slack),
            at_most_zero(
                ("swing of the mean energy beyond ½ h g v", "J/kg"),
                swing - 0.5 * h * g * fastest,
                slack,
            ),
            at_most_zero(("speed sideways", "m/s"), sideways, self::slack(&run, fastest)),
        ],
        curve: Curve::of(("energy", "J/kg"), &run, energy).beside(|_| energy(0)),
    })
}

/// How far speeds may be off, m/s: by what all steps lack, and rounding.
fn slack(run: &Run, fastest: f64) -> f64 {
    let lacking = run.sum(|residual| residual.momentum + residual.normal + residual.kinematics);
    2.0 * lacking + run.rounding(fastest)
}
