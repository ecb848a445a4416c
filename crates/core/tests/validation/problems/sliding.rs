//! Bodies that slide on level ground until friction stops them.

use crate::prelude::*;
use std::f64::consts::TAU;

/// A slide on level ground, in steps that each take the grip G = μ g h from the speed.
struct Slide {
    half_sides: Vector3<f64>,
    mass: f64,
    friction: f64,
    gravity: f64,
    velocity: Vector3<f64>, // At the start, m/s
}

impl Slide {
    fn along_x(half_sides: Vector3<f64>, inputs: &TestInputs) -> Result<Self, Refusal> {
        let [mass, friction, gravity, speed] = inputs.all([Mass, Friction, Gravity, Speed])?;
        Ok(Self { half_sides, mass, friction, gravity, velocity: v3(speed, 0.0, 0.0) })
    }

    fn speed(&self) -> f64 {
        self.velocity.norm()
    }

    /// The speed G that a step takes, m/s.
    fn grip(&self, h: f64) -> f64 {
        self.friction * self.gravity * h
    }

    /// The stopping time v/(μ g), s.
    fn time(&self) -> f64 {
        self.speed() / (self.friction * self.gravity)
    }

    /// x(t) = v t − ½ μ g t² until the stop, m.
    fn way(&self, t: f64) -> f64 {
        let t = t.min(self.time());
        self.speed() * t - 0.5 * self.friction * self.gravity * t * t
    }

    /// v_k, m/s.
    fn discrete_speeds(&self, h: f64, steps: usize) -> Vec<f64> {
        (0..=steps).map(|k| (self.speed() - k as f64 * self.grip(h)).max(0.0)).collect()
    }

    /// v²/(2 μ g), discrete h (M v − ½ M (M + 1) G) with the largest whole M ≤ v/G.
    fn distance(&self, name: &'static str, measured: f64, h: f64, tolerance: f64) -> TestQuantity {
        let whole = (self.speed() / self.grip(h)).floor();
        let discrete = h * (whole * self.speed() - 0.5 * whole * (whole + 1.0) * self.grip(h));
        equal((name, "m"), measured, self.way(self.time()), tolerance)
            .stepped(discrete, order(1, whole))
    }

    fn foot(&self) -> f64 {
        self.half_sides[0].min(self.half_sides[1])
    }

    fn tolerance(&self, run: &TestRun) -> SlideTolerance {
        let grip = self.grip(run.time_step);
        let speeds = self.discrete_speeds(run.time_step, run.steps());
        let lean = self.half_sides[2] / self.foot();
        let slider = Slider { mobility: 1.0, friction: self.friction, grip, lean };
        let steps = speeds.windows(2);
        slider.tolerance(run, steps.map(|pair| SlideStep { slip: pair[1], share: pair[0] / grip }))
    }

    /// The run, a quarter longer than the slide. The box tips if μ times half its height is more than
    /// the shorter half side.
    fn run(&self, runner: &mut Runner<'_>) -> Result<TestRun, Refusal> {
        let (mu, most) = (self.friction, 0.95 * self.foot());
        let below = most / self.half_sides[2];
        let why =
            format!("with mu {mu} the box tips instead of sliding; below {below:.2} is needed");
        Refusal::when(mu * self.half_sides[2] >= most, why)?;
        let start = State { velocity: self.velocity, ..resting(self.half_sides[2]) };
        let duration = 1.25 * self.time() + 4.0 * runner.time_step;
        runner.run(&Setup::from_box(self.mass, self.half_sides, start, self.gravity, mu, duration)?)
    }
}

/// The stopping time of a body that friction slows by `decrement` (m/s) a step. It uses the
/// measured and the discrete speeds at the start and after each step.
pub(crate) fn stopping_time(
    [measured, discrete]: [&[f64]; 2],
    decrement: f64,
    exact: f64,
    h: f64,
    tolerance: &SlideTolerance,
) -> TestQuantity {
    // The states that may be on the line.
    let fast = discrete[1..].iter().take_while(|speed| **speed > 0.01 * discrete[0]).count().max(1);
    let most = |values: &[f64]| largest(values[..fast].iter().copied());
    let turned = (most(&tolerance.changes) + 2.0 * tolerance.lifted) / decrement;
    let turned = turned * (0.01 * exact + h);
    let allowed = h * most(&tolerance.speeds) / decrement + turned;
    let quantity = equal(("stopping time", "s"), zero_time(measured, h), exact, allowed);
    TestQuantity { discrete: zero_time(discrete, h), ..quantity }
}

/// The time at which a linearly falling speed is zero, s. The line goes through the last two
/// `speeds` above a hundredth of the first, or through the first two.
fn zero_time(speeds: &[f64], h: f64) -> f64 {
    let last = speeds.iter().rposition(|&speed| speed > 0.01 * speeds[0]).unwrap_or(0);
    let first = last.saturating_sub(1);
    match speeds.get(first + 1) {
        Some(next) => h * (first as f64 + speeds[first] / (speeds[first] - next)),
        None => f64::NAN,
    }
}

/// A box slides on level ground until friction stops it, after v²/(2 μ g) and v/(μ g).
pub(crate) const SLIDING_STOP: TestProblem = TestProblem {
    name: "sliding-stop",
    time_step: 0.002,
    inputs: &[(Mass, 2.0), (Friction, 0.3), EARTH, (Speed, 3.0)],
    ..TestProblem::solved_by(sliding_stop)
};

/// The stopping time is exact if two discrete speeds are on the line v − μ g t.
fn sliding_stop(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let slide = Slide::along_x(v3(0.2, 0.15, 0.1), inputs)?;
    let run = slide.run(runner)?;
    let (h, end, allowed) = (run.time_step, run.end(0), slide.tolerance(&run));
    let measured: Vec<f64> = run.states(0).iter().map(|state| state.velocity.norm()).collect();
    let discrete = slide.discrete_speeds(h, run.steps());
    let on_the_line = discrete[1] > 0.01 * discrete[0];
    let convergence = if on_the_line { Convergence::Exact } else { Convergence::Unresolved };
    let time = stopping_time([&measured, &discrete], slide.grip(h), slide.time(), h, &allowed);
    Ok(vec![
        slide.distance("stopping distance", end.position[0], h, allowed.way()),
        TestQuantity { convergence, ..time },
        equal(("speed at the end", "m/s"), end.velocity.norm(), 0.0, allowed.speed()),
    ])
}

/// A thin plate slides fast and stops: no corner of its face leaves the ground or sinks into it,
/// and it goes straight.
pub(crate) const FAST_PLATE: TestProblem = TestProblem {
    name: "fast-plate",
    time_step: 0.002,
    inputs: &[(Mass, 1.0), (Friction, 0.3), EARTH, (Speed, 10.0)],
    ..TestProblem::solved_by(fast_plate)
};

/// z = 0 for the corners of the lower face at all times.
fn fast_plate(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let half_sides = v3(0.5, 0.5, 0.025);
    let slide = Slide::along_x(half_sides, inputs)?;
    let run = slide.run(runner)?;
    let corners = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0]]
        .map(|[x, y]| v3(x * half_sides[0], y * half_sides[1], -half_sides[2]));
    let height = |state: &State, sign: f64| {
        let turned = rotation(&state.attitude);
        largest(corners.map(|corner| sign * (state.position + turned * corner)[2]))
    };
    let [highest, deepest] = [1.0, -1.0].map(|sign| run.most(0, |state| height(state, sign)));
    let astray = run.most(0, |state| state.position[1].abs());
    let (allowed, way) = (slide.tolerance(&run), run.end(0).position[0]);
    Ok(vec![
        at_most_zero(("lift-off", "m"), highest, run.seat()),
        at_most_zero(("penetration", "m"), deepest, run.seat()),
        at_most_zero(("way sideways", "m"), astray, allowed.across),
        slide.distance("stopping distance", way, run.time_step, allowed.way()),
    ])
}

const DIRECTIONS: usize = 16;

/// A box slides in sixteen directions: each slide is straight and equally long, v²/(2 μ g), as no
/// pyramid of friction would have it.
pub(crate) const COMPASS: TestProblem = TestProblem {
    name: "compass",
    time_step: 0.002,
    inputs: &[(Mass, 2.0), (Friction, 0.3), EARTH, (Speed, 1.0)],
    ..TestProblem::solved_by(compass)
};

/// Coulomb's cone is round: the slide is the same in every direction, and the box does not turn.
fn compass(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let half_sides = v3(0.2, 0.15, 0.1);
    let east = Slide::along_x(half_sides, inputs)?;
    let start = resting(half_sides[2]).position;
    let (mut shortest, mut longest) = (f64::INFINITY, 0.0_f64);
    let (mut sideways, mut turned, mut way, mut across) = (0.0_f64, 0.0_f64, 0.0_f64, 0.0_f64);
    for k in 0..DIRECTIONS {
        let (sin, cos) = (TAU * k as f64 / DIRECTIONS as f64).sin_cos();
        let direction = v3(cos, sin, 0.0);
        let slide = Slide { velocity: east.speed() * direction, ..east };
        let run = slide.run(runner)?;
        let moved = run.end(0).position - start;
        let along = moved.dot(&direction);
        (shortest, longest) = (shortest.min(along), longest.max(along));
        sideways = sideways.max((moved - along * direction).norm());
        // The vector part of a small rotation's quaternion is half its angle.
        turned = turned.max(2.0 * run.end(0).attitude.fixed_rows::<3>(1).norm());
        let allowed = slide.tolerance(&run);
        (way, across) = (way.max(allowed.way()), across.max(allowed.across));
    }
    // √(I/m) with I = m (a² + b²)/3.
    let gyration = half_sides[0].hypot(half_sides[1]) / 3.0_f64.sqrt();
    Ok(vec![
        east.distance("longest slide", longest, runner.time_step, way),
        at_most_zero(("longest less shortest", "m"), longest - shortest, 2.0 * way),
        at_most_zero(("way sideways", "m"), sideways, across),
        at_most_zero(("angle turned", "rad"), turned, across / gyration),
    ])
}
