//! A cube that is dragged by a growing force.

use crate::prelude::*;

/// Final force (N) of a force that grows from 0, duration of the growth (s), and rate r (N/s).
const FORCE: f64 = 20.0;
const DURATION: f64 = 2.0;
const RATE: f64 = FORCE / DURATION;
const SLIDING: f64 = 0.01; // The cube has slid at this speed, m/s
const HALF_SIDE: f64 = 0.1; // m

/// A cube is dragged by a force that grows from 0 to 20 N in 2 s: it sticks up to μ m g, then
/// slides while friction stays μ m g.
pub(crate) const DRAGGED_CUBE: TestProblem = TestProblem {
    name: "dragged-cube",
    time_step: 0.002,
    inputs: &[(Mass, 1.0), (Friction, 0.4), EARTH],
    ..TestProblem::solved_by(dragged_cube)
};

/// v = r (t − t_s)²/(2 m), x = r (t − t_s)³/(6 m) after t_s = μ m g/r.
fn dragged_cube(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [friction, gravity, mass] = inputs.all([Friction, Gravity, Mass])?;
    let (limit, h, most) = (friction * mass * gravity, runner.time_step, 0.9 * FORCE);
    let why = format!(
        "mu m g = {limit:.3} N with mu {friction}: below {most} N and mu 0.95 are needed for \
         the cube to slide and not to tip"
    );
    Refusal::when(limit >= most || friction >= 0.95, why)?;
    let onset = limit / RATE;
    let speed = |t: f64| 0.5 * RATE * (t - onset).max(0.0).powi(2) / mass;
    let way = |t: f64| RATE * (t - onset).max(0.0).powi(3) / (6.0 * mass);
    let fastest = speed(DURATION);
    let why = format!("the cube reaches only {fastest:.3} m/s; use a smaller mass");
    Refusal::when(fastest < 2.0 * SLIDING, why)?;

    // Longer than the last step.
    let full = (2.0 * DURATION, v3(2.0 * FORCE, 0.0, 0.0));
    let force = Polyline::new(vec![(0.0, Vector3::zeros()), full])?;
    let cube = Subject::solid_box(mass, Vector3::repeat(HALF_SIDE), resting(HALF_SIDE))?;
    let run = runner.run(&Setup::new(vec![cube.pulled(force)?], gravity, friction, DURATION))?;

    // The first sliding step s, and v and x after `steps` steps. The last n steps slide, and F is
    // the first excess force:
    // v = h/m (n F + ½ n (n − 1) r h),
    // x = h²/m (½ n (n + 1) F + (n − 1) n (n + 1) r h/6).
    let first = (limit / (RATE * h) + 0.5).floor() as usize;
    let discrete = |steps: usize| {
        let n = steps.saturating_sub(first) as f64;
        let excess = RATE * h * (first as f64 + 0.5) - limit;
        let speed = h / mass * (n * excess + 0.5 * n * (n - 1.0) * RATE * h);
        let cubic = (n - 1.0) * n * (n + 1.0) * RATE * h / 6.0;
        (speed, h * h / mass * (0.5 * n * (n + 1.0) * excess + cubic))
    };
    let exact = (0..run.steps())
        .map(|k| SlideStep { slip: discrete(k + 1).0, share: RATE * h * (k as f64 + 0.5) / limit });
    let slider = Slider { mobility: 1.0, friction, grip: friction * gravity * h, lean: 1.0 };
    let allowed = slider.tolerance(&run, exact);

    let (steps, t, end) = (run.steps(), run.end_time(), run.end(0));
    let held = &run.states(0)[..=first.min(steps)];
    let crept = largest(held.iter().map(|state| state.position.xy().norm()));
    let (end_speed, end_way) = discrete(steps);

    let speeds: Vec<f64> = run.states(0).iter().map(|state| state.velocity[0]).collect();
    let discrete_speeds: Vec<f64> = (0..=steps).map(|k| discrete(k).0).collect();
    let after = (2.0 * mass * SLIDING / RATE).sqrt();
    let bound = after - (after * after - 0.5 * h * h).max(0.0).sqrt();
    let bound = bound.max(after.hypot(h) - after);
    let passed = discrete_speeds.iter().position(|v| *v >= SLIDING).unwrap_or(1).max(1);
    let slope = (discrete_speeds[passed] - discrete_speeds[passed - 1]) / h;
    let time_tolerance = 2.0 * allowed.speeds[passed - 1] / slope;

    // The step in which the slide begins may stick for a part.
    let from = (first + 1).min(steps);
    let drag: Vec<f64> = run.forces(0)[from..].iter().map(|force| -force[0]).collect();
    let lifted = 2.0 * allowed.lifted / drag.len() as f64;
    let drag_tolerance = mass / run.time_step * (mean(&allowed.changes[from..]) + lifted);
    let creep_tolerance = allowed.ways[first.clamp(1, steps) - 1];
    Ok(vec![
        at_most_zero(("creep while it sticks", "m"), crept, creep_tolerance),
        equal(("time of 1 cm/s", "s"), passing(&speeds, h), onset + after, time_tolerance)
            .stepped(passing(&discrete_speeds, h), Convergence::Within(bound)),
        equal(("friction while it slides", "N"), mean(&drag), limit, drag_tolerance),
        equal(("speed at the end", "m/s"), end.velocity[0], speed(t), allowed.speed())
            .stepped(end_speed, Convergence::Within(0.125 * RATE * h * h / mass)),
        equal(("way", "m"), end.position[0], way(t), allowed.way())
            .stepped(end_way, order(1, (steps - first.min(steps)) as f64)),
    ])
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// The time at which `speeds` pass [`SLIDING`], by linear interpolation, s.
fn passing(speeds: &[f64], h: f64) -> f64 {
    match speeds.iter().position(|speed| *speed >= SLIDING) {
        Some(k) if k > 0 => h * (k as f64 - (speeds[k] - SLIDING) / (speeds[k] - speeds[k - 1])),
        _ => f64::NAN,
    }
}
