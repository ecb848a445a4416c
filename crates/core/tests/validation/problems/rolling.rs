//! A ball that rolls: down a slope, or out of a slide.

use crate::prelude::*;

const RADIUS: f64 = 0.2; // R, m
const MOST_TURN: f64 = 0.25; // The largest rotation of a step, rad
const DURATION: f64 = 1.0; // s

/// A ball on a plane.
#[derive(Debug, Clone, Copy)]
struct Ball {
    friction: f64,
    along: f64,     // Gravity along the slope, m/s²
    onto: f64,      // Gravity onto it, m/s²
    time_step: f64, // h, s
}

/// v of the centre and u = R ω of the rim, m/s.
type Speeds = (f64, f64);

impl Ball {
    /// The scheme's step, with the p of |p| ≤ μ g_z h that rolls, or the next to it:
    ///
    /// ```text
    /// v⁺ = v + h g_x − p,   w(u⁺) = w(u) + ⁵⁄₂ p
    /// ```
    fn step(&self, (v, u): Speeds) -> Speeds {
        let h = self.time_step;
        let (grip, pulled) = (self.friction * self.onto * h, v + h * self.along);
        let turning = |u: f64| momentum(h / RADIUS, u);
        let friction = |after: f64| 0.4 * (turning(after).0 - turning(u).0);
        let rolling = newton(u, |u| (-(pulled - friction(u) - u), 0.4 * turning(u).1 + 1.0));
        let p = friction(rolling).clamp(-grip, grip);
        (pulled - p, newton(rolling, |u| (friction(u) - p, 0.4 * turning(u).1)))
    }

    /// The speeds at the start and after each step.
    fn discrete(&self, start: Speeds, steps: usize) -> Vec<Speeds> {
        recurrence(start, steps, |speeds| self.step(*speeds))
    }

    /// The setup; `rim` is the largest speed of the rim.
    fn setup(&self, mass: f64, rim: f64, speed: f64, duration: f64) -> Result<Setup, Refusal> {
        let turn = rim * self.time_step / RADIUS;
        let why = format!("the ball turns by {turn:.3} rad per step; allowed: up to {MOST_TURN}");
        Refusal::when(turn > MOST_TURN, why)?;
        let mut start = resting(RADIUS);
        start.velocity[0] = speed;
        Ok(Setup::new(Subject::balls(mass, RADIUS, [start])?, self.onto, self.friction, duration))
    }

    /// The convergence of a speed.
    fn lagging(&self, rim: f64, steps: f64) -> Convergence {
        lagging(self.time_step / RADIUS, rim, rim, steps)
    }
}

/// The tolerances of speeds and distances. The first `slides` steps slide and the others roll with
/// the share τ of the largest friction. Residuals δ_f of sliding add up. Residuals δ_f/√(1 − τ²) of
/// rolling do not.
fn tolerances(run: &TestRun, slides: usize, share: f64) -> (f64, f64) {
    let slid: f64 = run.residuals.iter().take(slides).map(|r| r.friction).sum();
    let held = run.largest(|r| r.friction) / (1.0 - share * share).sqrt();
    let once = held + 2.0 * run.largest(|r| r.normal) + run.largest(|r| r.kinematics);
    let lacked = 3.0 * run.sum(|r| r.momentum);
    let speed = slid + lacked + once + 4.0 * run.flight_rounding();
    (speed, run.end_time() * speed + run.seat())
}

/// R ω about y, m/s.
fn rim(state: &State) -> f64 {
    RADIUS * state.spin[1]
}

/// The distance of the centre from the line of the slide.
fn astray(state: &State) -> f64 {
    state.position[1].hypot(state.position[2] - RADIUS)
}

/// h Σ v of the steps.
fn way(h: f64, discrete: &[Speeds]) -> f64 {
    h * discrete.iter().map(|(v, _)| v).sum::<f64>()
}

/// A ball let go on a slope: it rolls with a = ⁵⁄₇ g sin θ up to tan θ = ⁷⁄₂ μ, as usually; beyond,
/// it slides with g (sin θ − μ cos θ) as it turns.
pub(crate) const ROLLING_BALL: TestProblem = TestProblem {
    name: "rolling-ball",
    time_step: 0.002,
    inputs: &[(Mass, 2.0), (Friction, 0.4), EARTH, (Slope, 30.0)],
    ..TestProblem::solved_by(rolling_ball)
};

/// Rolling, a = R ω̇ = ⁵⁄₇ g sin θ. Sliding, a = g (sin θ − μ cos θ) and R ω̇ = ⁵⁄₂ μ g cos θ.
fn rolling_ball(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [gravity, slope, friction, mass] = inputs.all([Gravity, Slope, Friction, Mass])?;
    let (sin, cos) = slope.to_radians().sin_cos();
    let h = runner.time_step;
    let ball = Ball { friction, along: gravity * sin, onto: gravity * cos, time_step: h };
    let share = 2.0 / 7.0 * sin / cos / friction;
    let why = format!(
        "a slope of {slope}° is the onset of sliding, tan θ = 7/2 mu; choose another slope"
    );
    Refusal::when((0.98..1.02).contains(&share), why)?;
    let rolls = share < 1.0;
    let (a, spin_up) = if rolls {
        (5.0 / 7.0 * ball.along, 5.0 / 7.0 * ball.along)
    } else {
        (ball.along - friction * ball.onto, 2.5 * friction * ball.onto)
    };
    let setup = ball.setup(mass, spin_up * DURATION, 0.0, DURATION)?;
    let run = runner.run(&Setup { slope, gravity, ..setup })?;

    let (count, t, end) = (run.steps(), run.end_time(), run.end(0));
    let discrete = ball.discrete((0.0, 0.0), count);
    let (slides, share) = if rolls { (0, share) } else { (count, 0.0) };
    let (speed, distance) = tolerances(&run, slides, share);
    let steps = count as f64;
    let or_exact = |convergence| if a > 0.0 { convergence } else { Convergence::Exact };
    let v_lags = if rolls { ball.lagging(a * t, steps) } else { Convergence::Exact };
    let u_lags = ball.lagging(spin_up * t, steps);
    // The distance is longer by ½ v h.
    let way_lags = order(1, steps);
    let ((v, u), label) = (discrete[count], ("speed down the slope", "m/s"));
    Ok(vec![
        equal(label, end.velocity[0], a * t, speed).stepped(v, or_exact(v_lags)),
        equal(("speed of the rim", "m/s"), rim(end), spin_up * t, 2.5 * speed)
            .stepped(u, or_exact(u_lags)),
        equal(("way down the slope", "m"), end.position[0], 0.5 * a * t * t, distance)
            .stepped(way(h, &discrete[1..]), or_exact(way_lags)),
        at_most_zero(("way across and off the slope", "m"), astray(end), distance),
    ])
}

/// A ball is struck and slides without turning: friction turns it until it rolls, after 2 v/(7 μ
/// g), with ⁵⁄₇ v whatever μ is.
pub(crate) const SLIDING_BALL: TestProblem = TestProblem {
    name: "sliding-ball",
    time_step: 0.002,
    inputs: &[(Mass, 2.0), (Friction, 0.3), EARTH, (Speed, 4.0)],
    ..TestProblem::solved_by(sliding_ball)
};

/// v(t) = v − μ g t while it slides, up to t = 2 v/(7 μ g).
fn sliding_ball(inputs: &TestInputs, runner: &mut Runner<'_>) -> SolvedBy {
    let [gravity, speed, friction, mass] = inputs.all([Gravity, Speed, Friction, Mass])?;
    let h = runner.time_step;
    let ball = Ball { friction, along: 0.0, onto: gravity, time_step: h };
    let (grip, rolls) = (2.0 * speed / (7.0 * friction * gravity), 5.0 / 7.0 * speed);
    let run = runner.run(&ball.setup(mass, speed, speed, 2.0 * grip + 4.0 * h)?)?;

    let (count, end) = (run.steps(), run.end(0));
    let discrete = ball.discrete((speed, 0.0), count);
    // Steps that surely slide.
    let slides = ((grip / h).floor() as usize).min(count);
    let (slid, at) = (run.time(slides), run.states(0)[slides].position[0]);
    let (allowed, distance) = tolerances(&run, slides + 2, 0.0);
    let exact = speed * slid - 0.5 * friction * gravity * slid * slid;
    let ((v, u), lagging) = (discrete[count], ball.lagging(rolls, f64::INFINITY));
    Ok(vec![
        equal(("speed once it rolls", "m/s"), end.velocity[0], rolls, allowed).stepped(v, lagging),
        equal(("speed of the rim", "m/s"), rim(end), rolls, 2.5 * allowed).stepped(u, lagging),
        equal(("way while it slides", "m"), at, exact, distance)
            .stepped(way(h, &discrete[1..=slides]), order(1, grip / h)),
        at_most_zero(("way sideways and off the ground", "m"), astray(end), distance),
    ])
}
