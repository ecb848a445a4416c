//! Bodies that meet in a line and stay together: inelastic impacts.
//!
//! There is no gravity and no ground near. An impact without restitution ends with a common
//! velocity, which the momentum gives: V = Σ m v/Σ m.
//!
//! **The step.** The gap φ of two bodies that approach must not be negative at the step's end:
//! the step in which they would meet ends with φ⁺ = 0, with relative velocity φ/h and the
//! momentum as it was; the next one begins with them touching and ends with the common
//! velocity. Since the centre of mass moves on evenly and the gap closes exactly, positions are
//! those of continuous time as soon as they touch, whatever h is.

use super::prelude::*;

/// Above the ground, m.
const HEIGHT: f64 = 10.0;

/// In the air at x, at rest.
pub(super) fn afloat(x: f64) -> State {
    let mut state = resting(HEIGHT);
    state.position[0] = x;
    state
}

/// What the residuals of `run` allow the speed of the centre of mass, m/s: all that velocities
/// lack.
pub(super) fn drift(run: &Run) -> f64 {
    run.sum(|residual| residual.momentum) + run.flight_rounding()
}

/// The same for each of `bodies` in a row. Two neighbours that touch stay within h δ_n of it,
/// and part with no more than 2 δ_n and what positions lack; none of this adds up over the
/// steps, and a body differs from the centre by no more than all its neighbours do.
pub(super) fn speed_slack(run: &Run, bodies: f64) -> f64 {
    let parting = 2.0 * run.largest(|r| r.normal) + run.largest(|r| r.kinematics);
    drift(run) + bodies * parting
}

/// The same for a place, m.
fn place_slack(run: &Run, bodies: f64) -> f64 {
    run.time(run.steps()) * speed_slack(run, bodies) + bodies * run.seat()
}

/// m.
const HALF_SIDES: Vector3<f64> = Vector3::new(0.2, 0.15, 0.1);
/// Between the boxes at the start, m.
const GAP: f64 = 0.3;
/// The second box, in masses of the first.
const SECOND: f64 = 1.5;

/// Two boxes that meet face to face.
pub static COLLISION: Posed = Posed {
    name: "collision",
    about: "A box flies into another at rest, face to face and inelastically: both go on with m₁ \
            v/(m₁ + m₂), and ½ v² m₁ m₂/(m₁ + m₂) of energy is lost.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 2.0), (Input::Friction, 0.3), (Input::Speed, 3.0)],
    bodies: 2,
    ..Posed::by(collision)
};

/// With V = m₁ v/(m₁ + m₂) and the gap d the boxes meet at d/v, and then
///
/// ```text
/// x₂(t) = x₂(0) + V (t − d/v),   E lost = ½ v² m₁ m₂/(m₁ + m₂)
/// ```
///
/// The faces are flush, corner on corner: nothing turns. The step's answer is the same.
fn collision(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (mass, speed) = (inputs.get(Input::Mass)?, inputs.get(Input::Speed)?);
    let masses = [mass, SECOND * mass];
    let mut starts = [afloat(0.0), afloat(2.0 * HALF_SIDES[0] + GAP)];
    starts[0].velocity[0] = speed;
    let bodies = [0, 1].map(|index| Subject::solid_box(masses[index], HALF_SIDES, starts[index]));
    let bodies = bodies.into_iter().collect::<Result<_, _>>()?;
    let (meet, h) = (GAP / speed, laboratory.time_step());
    let friction = inputs.get(Input::Friction)?;
    let run = laboratory.run(&Setup::new(bodies, 0.0, friction, 2.0 * meet + 4.0 * h))?;

    let common = speed / (1.0 + SECOND);
    let (t, ends) = (run.time(run.steps()), [run.end(0), run.end(1)]);
    let [first, second] = ends.map(|state| state.velocity[0]);
    let kinetic = |a: f64, b: f64| 0.5 * (masses[0] * a * a + masses[1] * b * b);
    let lost = kinetic(speed, 0.0) - kinetic(first, second);
    let spin = ends.map(|state| state.spin.norm());
    let slack = speed_slack(&run, 2.0);
    let total = masses[0] + masses[1];
    let place = |t: f64| starts[1].position[0] + common * (t - meet).max(0.0);
    Ok(Findings {
        quantities: vec![
            exactly(("speed of the first box", "m/s"), first, common, slack),
            exactly(("speed of the second box", "m/s"), second, common, slack),
            exactly(
                ("momentum", "kg m/s"),
                masses[0] * first + masses[1] * second,
                mass * speed,
                total * drift(&run),
            ),
            exactly(
                ("energy lost", "J"),
                lost,
                0.5 * mass * speed * (speed - common),
                total * (speed * drift(&run) + slack * slack),
            ),
            at_most_zero(
                ("spin", "rad/s"),
                spin[0].max(spin[1]),
                (2.0 * slack + run.sum(|residual| residual.friction)) / HALF_SIDES[2],
            ),
            exactly(
                ("place of the second box", "m"),
                ends[1].position[0],
                place(t),
                place_slack(&run, 2.0),
            ),
        ],
        curve: run
            .curve(("speed of the first box", "m/s"), 0, |state| state.velocity[0])
            .beside(|t| if t < meet { speed } else { common }),
    })
}

/// m.
const RADIUS: f64 = 0.05;
/// Between the balls at the start, m.
const GAPS: [f64; 5] = [0.05, 0.08, 0.03, 0.06, 0.04];

/// Balls in a row, the first of which is pushed.
pub static BALL_CHAIN: Posed = Posed {
    name: "ball-chain",
    about: "The first of six balls in a row is pushed and takes one after the other with it, \
            inelastically: v/2, v/3, …, v/6.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 0.2), (Input::Friction, 0.3), (Input::Speed, 2.0)],
    bodies: GAPS.len() + 1,
    ..Posed::by(ball_chain)
};

/// A train of k balls has the speed v/k, and meets the next one after the time d_k k/v, so
/// that the first ball is at
///
/// ```text
/// x = d_1 + … + d_k + (v/(k + 1)) (t − t_k),   t_k = Σ d_j j/v
/// ```
///
/// after the k-th impact. The step's answer is the same, but for the two steps in which an
/// impact falls.
fn ball_chain(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (mass, speed) = (inputs.get(Input::Mass)?, inputs.get(Input::Speed)?);
    let mut x = 0.0;
    let mut starts = vec![afloat(0.0)];
    starts[0].velocity[0] = speed;
    let mut meetings = vec![0.0];
    for (index, gap) in GAPS.iter().enumerate() {
        x += 2.0 * RADIUS + gap;
        starts.push(afloat(x));
        meetings.push(meetings[index] + gap * (index + 1) as f64 / speed);
    }
    let (h, last) = (laboratory.time_step(), meetings[GAPS.len()]);
    let friction = inputs.get(Input::Friction)?;
    let balls = Subject::balls(mass, RADIUS, starts)?;
    let run = laboratory.run(&Setup::new(balls, 0.0, friction, 1.2 * last + 4.0 * h))?;

    // Impacts so far.
    let impacts = |t: f64| meetings.iter().filter(|meeting| **meeting <= t).count() - 1;
    let speed_at = |t: f64| speed / (impacts(t) + 1) as f64;
    let place_at = |t: f64| {
        let count = impacts(t);
        GAPS[..count].iter().sum::<f64>() + speed_at(t) * (t - meetings[count])
    };
    let measured: Vec<f64> = run.states(0).iter().map(|state| state.velocity[0]).collect();
    let quiet = |t: f64| meetings[1..].iter().all(|&at| t < at - 0.5 * h || t > at + 2.5 * h);
    let times = (0..measured.len()).map(|k| run.time(k));
    let errors = times.zip(&measured).filter(|(t, _)| quiet(*t));
    let worst = errors.map(|(t, v)| (v - speed_at(t)).abs()).fold(0.0, f64::max);
    let count = (GAPS.len() + 1) as f64;
    let (slack, t) = (speed_slack(&run, count), run.time(run.steps()));
    let ends: Vec<_> = (0..=GAPS.len()).map(|index| run.end(index)).collect();
    let momentum: f64 = ends.iter().map(|state| mass * state.velocity[0]).sum();
    let row = ends[GAPS.len()].position[0] - ends[0].position[0];
    Ok(Findings {
        quantities: vec![
            exactly(("speed of the first ball", "m/s"), ends[0].velocity[0], speed / count, slack),
            exactly(
                ("speed of the last ball", "m/s"),
                ends[GAPS.len()].velocity[0],
                speed / count,
                slack,
            ),
            at_most_zero(("largest error of the speed between impacts", "m/s"), worst, slack),
            exactly(("momentum", "kg m/s"), momentum, mass * speed, count * mass * drift(&run)),
            exactly(
                ("place of the first ball", "m"),
                ends[0].position[0],
                place_at(t),
                place_slack(&run, count),
            ),
            exactly(
                ("length of the row of centres", "m"),
                row,
                2.0 * RADIUS * GAPS.len() as f64,
                // Balls that an impact leaves apart by its residual part from each other.
                count * run.seat() + 2.0 * place_slack(&run, count),
            ),
        ],
        curve: Curve::of(("speed of the first ball", "m/s"), &run, |k| measured[k])
            .beside(speed_at),
    })
}
