//! Collisions in a line without gravity: boxes, a row of balls, Newton's cradle.

use crate::prelude::*;

/// At rest at x, far above the ground.
fn afloat(x: f64) -> State {
    at_rest(v3(x, 0.0, 10.0))
}

/// The tolerance of the speed of the centre of mass, m/s.
fn drift(run: &TestRun) -> f64 {
    run.sum(|r| r.momentum) + run.flight_rounding()
}

/// The tolerance of a speed of `bodies` in a row, m/s. Neighbours in contact separate with at most 2 δ_n and
/// the residual of positions.
fn speed_tolerance(run: &TestRun, bodies: f64) -> f64 {
    let parting = 2.0 * run.largest(|r| r.normal) + run.largest(|r| r.kinematics);
    drift(run) + bodies * parting
}

/// The tolerance of a place, m.
fn place_tolerance(run: &TestRun, bodies: f64) -> f64 {
    run.end_time() * speed_tolerance(run, bodies) + bodies * run.seat()
}

const HALF_SIDES: Vector3<f64> = Vector3::new(0.2, 0.15, 0.1); // m
const GAP: f64 = 0.3; // The gap between the boxes at the start, m
const SECOND: f64 = 1.5; // The second box, in masses of the first

/// A box flies into another at rest, face to face and inelastically: both go on with m₁ v/(m₁ +
/// m₂), and ½ v² m₁ m₂/(m₁ + m₂) of energy is lost.
pub(crate) const COLLISION: TestProblem = TestProblem {
    name: "collision",
    time_step: 0.002,
    inputs: &[(Mass, 2.0), (Friction, 0.3), (Speed, 3.0)],
    bodies: 2,
    ..TestProblem::solved_by(collision)
};

/// Common velocity V = m₁ v/(m₁ + m₂) and x₂(t) = x₂(0) + V (t − d/v) with the gap d.
/// The impact takes the energy ½ v² m₁ m₂/(m₁ + m₂).
fn collision(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass, speed, friction] = inputs.all([Mass, Speed, Friction])?;
    let masses = [mass, SECOND * mass];
    let mut starts = [afloat(0.0), afloat(2.0 * HALF_SIDES[0] + GAP)];
    starts[0].velocity[0] = speed;
    let bodies = [0, 1].map(|index| Subject::solid_box(masses[index], HALF_SIDES, starts[index]));
    let bodies = bodies.into_iter().collect::<Result<_, _>>()?;
    let meet = GAP / speed;
    let duration = 2.0 * meet + 4.0 * runner.time_step;
    let run = runner.run(&Setup::new(bodies, 0.0, friction, duration))?;

    let common = speed / (1.0 + SECOND);
    let ends = [run.end(0), run.end(1)];
    let [first, second] = ends.map(|state| state.velocity[0]);
    let kinetic = |a: f64, b: f64| 0.5 * (masses[0] * a * a + masses[1] * b * b);
    let lost = kinetic(speed, 0.0) - kinetic(first, second);
    let spin = ends[0].spin.norm().max(ends[1].spin.norm());
    let (off, total) = (speed_tolerance(&run, 2.0), masses[0] + masses[1]);
    let momentum = masses[0] * first + masses[1] * second;
    let energy_off = total * (speed * drift(&run) + off * off);
    let spin_off = (2.0 * off + run.sum(|r| r.friction)) / HALF_SIDES[2];
    let place = starts[1].position[0] + common * (run.end_time() - meet).max(0.0);
    let at = ends[1].position[0];
    let label = ("speed of the first box", "m/s");
    Ok(vec![
        equal(label, first, common, off),
        equal(("speed of the second box", "m/s"), second, common, off),
        equal(("momentum", "kg m/s"), momentum, mass * speed, total * drift(&run)),
        equal(("energy lost", "J"), lost, 0.5 * mass * speed * (speed - common), energy_off),
        at_most_zero(("spin", "rad/s"), spin, spin_off),
        equal(("place of the second box", "m"), at, place, place_tolerance(&run, 2.0)),
    ])
}

const RADIUS: f64 = 0.05; // m
/// The gaps between the balls at the start, m.
const GAPS: [f64; 5] = [0.05, 0.08, 0.03, 0.06, 0.04];

/// The first of six balls in a row is pushed and takes one after the other with it, inelastically:
/// v/2, v/3, …, v/6.
pub(crate) const BALL_CHAIN: TestProblem = TestProblem {
    name: "ball-chain",
    time_step: 0.002,
    inputs: &[(Mass, 0.2), (Friction, 0.3), (Speed, 2.0)],
    bodies: GAPS.len() + 1,
    ..TestProblem::solved_by(ball_chain)
};

/// Position x = d_1 + … + d_k + (v/(k + 1)) (t − t_k) of the first ball after the k-th collision.
/// The times are t_k = Σ d_j j/v.
fn ball_chain(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass, speed, friction] = inputs.all([Mass, Speed, Friction])?;
    let mut x = 0.0;
    let mut starts = vec![afloat(0.0)];
    starts[0].velocity[0] = speed;
    let mut meetings = vec![0.0];
    for (index, gap) in GAPS.iter().enumerate() {
        x += 2.0 * RADIUS + gap;
        starts.push(afloat(x));
        meetings.push(meetings[index] + gap * (index + 1) as f64 / speed);
    }
    let (h, last) = (runner.time_step, meetings[GAPS.len()]);
    let balls = Subject::balls(mass, RADIUS, starts)?;
    let run = runner.run(&Setup::new(balls, 0.0, friction, 1.2 * last + 4.0 * h))?;

    // Collisions so far.
    let collisions = |t: f64| meetings.iter().filter(|meeting| **meeting <= t).count() - 1;
    let speed_at = |t: f64| speed / (collisions(t) + 1) as f64;
    let place_at = |t: f64| {
        let count = collisions(t);
        GAPS[..count].iter().sum::<f64>() + speed_at(t) * (t - meetings[count])
    };
    let label = ("speed of the first ball", "m/s");
    let quiet = |t: f64| meetings[1..].iter().all(|&at| t < at - 0.5 * h || t > at + 2.5 * h);
    let speeds =
        run.states(0).iter().enumerate().map(|(k, state)| (run.time(k), state.velocity[0]));
    let errors = speeds.filter(|(t, _)| quiet(*t)).map(|(t, v)| (v - speed_at(t)).abs());
    let worst = largest(errors);
    let count = (GAPS.len() + 1) as f64;
    let (off, place_off) = (speed_tolerance(&run, count), place_tolerance(&run, count));
    let (first, last) = (run.end(0), run.end(GAPS.len()));
    let momentum = (0..=GAPS.len()).map(|index| mass * run.end(index).velocity[0]).sum();
    let row = last.position[0] - first.position[0];
    let length = 2.0 * RADIUS * GAPS.len() as f64;
    // Balls that a collision leaves apart by its residual separate.
    let row_off = count * run.seat() + 2.0 * place_off;
    let place = place_at(run.end_time());
    Ok(vec![
        equal(label, first.velocity[0], speed / count, off),
        equal(("speed of the last ball", "m/s"), last.velocity[0], speed / count, off),
        at_most_zero(("largest error of the speed between impacts", "m/s"), worst, off),
        equal(("momentum", "kg m/s"), momentum, mass * speed, count * mass * drift(&run)),
        equal(("place of the first ball", "m"), first.position[0], place, place_off),
        equal(("length of the row of centres", "m"), row, length, row_off),
    ])
}

/// The distance to the second ball, and the gap between the others where they are apart, m.
const RUN_UP: f64 = 0.1;
const APART: f64 = 0.08;

/// A ball meets two others, elastically: apart, the last one takes all its speed; in touch, all
/// three meet at once, and Newton's law gives −1/3, 2/3, 2/3.
pub(crate) const CRADLE: TestProblem = TestProblem {
    name: "cradle",
    time_step: 0.002,
    inputs: &[(Mass, 0.2), (Friction, 0.3), (Speed, 2.0)],
    bodies: 3,
    // Ipopt: its speeds after a bounce are less accurate than its residuals.
    ..TestProblem::solved_by(cradle)
};

/// Velocities 0, 0, v apart. In contact v₂ − v₁ = v, v₃ − v₂ = 0 and v₁ + v₂ + v₃ = v, hence −v/3,
/// 2v/3, 2v/3.
fn cradle(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [mass, speed, friction] = inputs.all([Mass, Speed, Friction])?;
    let (h, way) = (runner.time_step, runner.time_step * speed);
    let why = format!(
        "the ball moves {way:.3} m per step; allowed: up to a quarter of the gap of {APART} m"
    );
    Refusal::when(way > 0.25 * APART, why)?;
    let duration = 2.0 * (RUN_UP + APART) / speed + 8.0 * h;
    let mut run = |gap: f64| {
        let places = [0.0, RUN_UP + 2.0 * RADIUS, RUN_UP + 4.0 * RADIUS + gap];
        let mut bodies = Subject::balls(mass, RADIUS, places.map(afloat))?;
        bodies[0].start.velocity[0] = speed;
        let setup = Setup::new(bodies, 0.0, friction, duration);
        runner.run(&Setup { restitution: 1.0, ..setup })
    };
    let (apart, touching) = (run(APART)?, run(0.0)?);
    let end = |run: &TestRun, name: &'static str, ball: usize, share: f64| {
        let found = run.end(ball).velocity[0];
        equal((name, "m/s"), found, share * speed, speed_tolerance(run, 3.0))
    };
    let conserved = |run: &TestRun, energy: &'static str, momentum: &'static str| {
        let speeds = [0, 1, 2].map(|ball| run.end(ball).velocity[0]);
        let off = 3.0 * mass * speed_tolerance(run, 3.0);
        let kinetic = 0.5 * mass * speeds.iter().map(|v| v * v).sum::<f64>();
        let total = mass * speeds.iter().sum::<f64>();
        [
            equal((energy, "J"), kinetic, 0.5 * mass * speed * speed, speed * off),
            equal((momentum, "kg m/s"), total, mass * speed, 3.0 * mass * drift(run)),
        ]
    };
    let ends = [
        end(&apart, "apart: speed of the first ball", 0, 0.0),
        end(&apart, "apart: speed of the last ball", 2, 1.0),
        end(&touching, "in touch: speed of the first ball", 0, -1.0 / 3.0),
        end(&touching, "in touch: speed of the last ball", 2, 2.0 / 3.0),
    ];
    Ok([
        &ends[..],
        &conserved(&apart, "apart: energy", "apart: momentum"),
        &conserved(&touching, "in touch: energy", "in touch: momentum"),
    ]
    .concat())
}
