//! A block on a turntable: carried round, or left behind.

use crate::prelude::*;

/// m.
const TABLE: Vector3<f64> = Vector3::new(1.0, 1.0, 0.1);
const BLOCK: Vector3<f64> = Vector3::new(0.08, 0.08, 0.05);
const DISTANCE: f64 = 0.6; // From the middle of the table to the block, m
const RATIO: f64 = 50.0; // The table, in masses of the block
const DURATION: f64 = 0.25; // s
const RESOLUTION: f64 = 1e-8; // Resolution of the threshold, as a share of it
const SLIPPED: f64 = 1e-10; // The distance of a slipping block from its place, m
const MOST_TURN: f64 = 0.2; // The largest rotation of a step, rad
const CORNERS: f64 = 8.0; // Corners of both faces
const RADIUS: f64 = DISTANCE * RATIO / (1.0 + RATIO); // r of the block, m

/// Both bodies with the spin ω, as after one step of rotation.
fn setup([mass, friction, gravity]: [f64; 3], spin: f64, h: f64) -> Result<Setup, Refusal> {
    // The velocity follows from the previous position, rotated back by ψ.
    let (sin, cos) = turn(h, spin).0.sin_cos();
    let at = |x: f64, height: f64| State {
        velocity: v3(x * (1.0 - cos), x * sin, 0.0) / h,
        spin: v3(0.0, 0.0, spin),
        ..at_rest(v3(x, 0.0, height))
    };
    let bodies = vec![
        Subject::solid_box(RATIO * mass, TABLE, at(RADIUS - DISTANCE, TABLE[2]))?,
        Subject::solid_box(mass, BLOCK, at(RADIUS, 2.0 * TABLE[2] + BLOCK[2]))?,
    ];
    let frictions = vec![(0, Partner::Ground, 0.0)];
    Ok(Setup { frictions, ..Setup::new(bodies, gravity, friction, DURATION) })
}

/// The distance of the block from its place on the table in each state, m.
fn strayed(run: &TestRun) -> Vec<f64> {
    let place = |k: usize| {
        let (table, block) = (&run.states(0)[k], &run.states(1)[k]);
        let (sin, cos) = angle_about(2, table).sin_cos();
        let apart = block.position - table.position;
        v3(cos * apart[0] + sin * apart[1], cos * apart[1] - sin * apart[0], apart[2])
    };
    let first = place(0);
    (0..=run.steps()).map(|k| (place(k) - first).norm()).collect()
}

/// The tolerance of the acceleration of the block in a step, m/s².
fn tolerance(run: &TestRun) -> f64 {
    let missed = run.largest(|r| r.friction + r.normal);
    let lacked = run.largest(|r| r.momentum + 2.0 * r.kinematics);
    (2.0 * CORNERS * missed + 2.0 * lacked + 4.0 * run.flight_rounding()) / run.time_step
}

/// A block on a turntable is carried round by friction m r ω², and slips where that is more than μ
/// m g.
pub(crate) const TURNTABLE: TestProblem = TestProblem {
    name: "turntable",
    time_step: 0.005,
    inputs: &[(Mass, 1.0), (Friction, 0.5), EARTH],
    bodies: 2,
    // Ipopt: at the onset of sliding, its residuals reach 1e-3 m/s.
    ..TestProblem::solved_by(turntable)
};

/// μ g = r ω² at the threshold. A step that turns by θ has the acceleration r (2 sin(½ θ)/h)², and the
/// threshold 2 sin(½ θ)/h = √(μ g/r).
fn turntable(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let values = inputs.all([Mass, Friction, Gravity])?;
    let ([mass, friction, gravity], h) = (values, runner.time_step);
    let square = friction * gravity / RADIUS;
    let critical = square.sqrt();
    let why = format!(
        "with mu {friction} the block tips over, or the table turns by more than {MOST_TURN} rad \
         per step; use a smaller mu"
    );
    let tips = friction * BLOCK[2] > 0.9 * BLOCK[0];
    Refusal::when(critical * h > MOST_TURN || tips, why)?;
    let angle = 2.0 * (0.5 * h * critical).asin();
    let discrete = newton(critical, |spin| {
        let (turned, slope) = turn(h, spin);
        (turned - angle, slope)
    });
    let carried = 0.9 * critical;
    let run = runner.run(&setup(values, carried, h)?)?;
    let force = |k: usize| run.forces(1)[k].xy().norm() / mass;
    let expected = RADIUS * carried * carried;
    let found = Threshold::near(discrete, RESOLUTION * discrete, |spin| {
        let run = runner.run(&setup(values, spin, h)?)?;
        let slipped = *last(&strayed(&run)) > SLIPPED;
        Ok((slipped, tolerance(&run) / (2.0 * RADIUS * critical)))
    })?;
    let share = expected / (friction * gravity);
    let held = run.sum(|r| r.friction) / (1.0 - share * share).sqrt();
    let (allowed, second_order) = (tolerance(&run), order(2, DURATION / h));
    let way = largest(strayed(&run));
    let spin_off = 2.0 * allowed * h / RADIUS + run.flight_rounding();
    let label = ("acceleration of the block", "m/s²");
    Ok(vec![
        equal(label, force(run.steps() - 1), expected, allowed)
            .stepped(RADIUS * (2.0 * (0.5 * turn(h, carried).0).sin() / h).powi(2), second_order),
        at_most_zero(("way on the table", "m"), way, 2.0 * h * held + 8.0 * run.seat()),
        equal(("spin of the table", "rad/s"), run.end(0).spin[2], carried, spin_off),
        found.equals(("threshold of the spin", "rad/s"), critical).stepped(discrete, second_order),
    ])
}
