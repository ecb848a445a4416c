//! A ball that rolls: down a slope, or out of a slide.
//!
//! A solid ball has I = ⅖ m R². With u = R ω, the speed of its rim, and friction p a mass and
//! step, against the slide,
//!
//! ```text
//! v⁺ = v + h g_x − p,   w(u⁺) = w(u) + ⁵⁄₂ p,   w(u) = u (1 + κ² u²),   κ = h/(2R)
//! ```
//!
//! **The step's slip** is that of the ball's middle and of its spin about it (eq. 10a),
//!
//! ```text
//! c = v⁺ − u⁺.
//! ```
//!
//! It rolls with the p that makes c = 0, if that is within ±μ g_z h; else friction is all it
//! has, against the slip. Since w is above u by a share κ² u², a rolling ball is slower
//! than the exact one by ⅖/1.4 of that share or so: second order in h.

use super::prelude::*;

/// R, m.
const RADIUS: f64 = 0.2;
/// Enough for Newton's method to settle to the last digit.
const ROUNDS: usize = 30;
/// A ball that turns by more than this in a step is far from a rolling one, rad.
const MOST_TURN: f64 = 0.25;
/// Below this share κ² u² the order does not show for rounding.
const LEAST_LAG: f64 = 1e-9;

/// A ball on a plane.
#[derive(Debug, Clone, Copy)]
struct Ball {
    friction: f64,
    /// Gravity along the slope and onto it, m/s².
    along: f64,
    onto: f64,
    /// h, s.
    time_step: f64,
}

/// v and u, m/s.
type Speeds = (f64, f64);

impl Ball {
    /// κ, s/m.
    fn lag(&self) -> f64 {
        0.5 * self.time_step / RADIUS
    }

    /// A step.
    fn step(&self, (v, u): Speeds) -> Speeds {
        let h = self.time_step;
        let (grip, pulled) = (self.friction * self.onto * h, v + h * self.along);
        // The rim's speed that rolls, and p = ⅖ (w(u⁺) − w(u)).
        let turning = |u: f64| momentum(h / RADIUS, u);
        let friction = |after: f64| 0.4 * (turning(after).0 - turning(u).0);
        let mut after = u;
        for _ in 0..ROUNDS {
            let by_turning = 0.4 * turning(after).1;
            after += (pulled - friction(after) - after) / (by_turning + 1.0);
        }
        let p = friction(after).clamp(-grip, grip);
        for _ in 0..ROUNDS {
            after -= (friction(after) - p) / (0.4 * turning(after).1);
        }
        (pulled - p, after)
    }

    /// The speeds at the start and after each step.
    fn discrete(&self, start: Speeds, steps: usize) -> Vec<Speeds> {
        let mut speeds = vec![start];
        for k in 0..steps {
            speeds.push(self.step(speeds[k]));
        }
        speeds
    }

    fn setup(&self, mass: f64, slope: f64, gravity: f64) -> Result<Setup, Unsuitable> {
        let bodies = Subject::balls(mass, RADIUS, [resting(RADIUS)])?;
        Ok(Setup { slope, ..Setup::new(bodies, gravity, self.friction, 0.0) })
    }

    /// Refuses speeds that turn the ball too far in a step.
    fn check(&self, rim: f64) -> Result<(), Unsuitable> {
        let turn = rim * self.time_step / RADIUS;
        Unsuitable::when(turn > MOST_TURN, || {
            format!("the ball turns by {turn:.3} rad in a step; {MOST_TURN} is the most")
        })?;
        Ok(())
    }

    /// How a speed comes to the exact one, whose error is about the share κ² u².
    fn lagging(&self, rim: f64, steps: f64) -> Convergence {
        let share = (self.lag() * rim).powi(2);
        if share < LEAST_LAG {
            return Convergence::within(share * rim, steps);
        }
        Convergence::order(2, steps)
    }
}

/// What the residuals of `run` allow speeds and ways, where the first `slides` steps slide and
/// in the others friction is the share τ of all there is.
///
/// What velocities lack adds up, and so does δ_f of a step that slides. A ball that is held
/// slips with δ_f/√(1 − τ²) (`slack.rs`, b), which does not: v + ⅖ w(u) says what both are but for
/// the slip of the last step. Nor does what the normal law misses.
fn slack(run: &Run, slides: usize, share: f64) -> (f64, f64) {
    let slid: f64 = run.residuals.iter().take(slides).map(|r| r.friction).sum();
    let held = run.largest(|r| r.friction) / (1.0 - share * share).sqrt();
    let once = held + 2.0 * run.largest(|r| r.normal) + run.largest(|r| r.kinematics);
    let lacked = 3.0 * run.sum(|residual| residual.momentum);
    let speed = slid + lacked + once + 4.0 * run.flight_rounding();
    (speed, run.time(run.steps()) * speed + run.seat())
}

/// R ω about y, m/s.
fn rim(state: &State) -> f64 {
    RADIUS * state.spin[1]
}

/// s.
const DURATION: f64 = 1.0;

/// A ball let go on a slope.
pub static ROLLING_BALL: Posed = Posed {
    name: "rolling-ball",
    about: "A ball let go on a slope: it rolls with a = ⁵⁄₇ g sin θ up to tan θ = ⁷⁄₂ μ, as \
            usually; beyond, it slides with g (sin θ − μ cos θ) as it turns.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 2.0), (Input::Friction, 0.4), EARTH, (Input::Slope, 30.0)],
    ..Posed::by(rolling_ball)
};

/// Rolling, v = R ω: m a = m g sin θ − F and I a/R = F R give a = ⁵⁄₇ g sin θ and
/// F = ²⁄₇ m g sin θ, which must be within μ m g cos θ. Sliding, a = g (sin θ − μ cos θ)
/// and R ω̇ = ⁵⁄₂ μ g cos θ.
fn rolling_ball(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (gravity, slope) = (inputs.get(Input::Gravity)?, inputs.get(Input::Slope)?);
    let (sin, cos) = slope.to_radians().sin_cos();
    let (friction, h) = (inputs.get(Input::Friction)?, laboratory.time_step());
    let ball = Ball { friction, along: gravity * sin, onto: gravity * cos, time_step: h };
    let share = 2.0 / 7.0 * sin / cos / friction;
    Unsuitable::when((0.98..1.02).contains(&share), || {
        format!("a slope of {slope}° is the one at which the ball begins to slide, tan θ = 7/2 mu")
    })?;
    let rolls = share < 1.0;
    let (a, spin_up) = if rolls {
        (5.0 / 7.0 * ball.along, 5.0 / 7.0 * ball.along)
    } else {
        (ball.along - friction * ball.onto, 2.5 * friction * ball.onto)
    };
    ball.check(spin_up * DURATION)?;
    let setup = ball.setup(inputs.get(Input::Mass)?, slope, gravity)?;
    let run = laboratory.run(&Setup { duration: DURATION, ..setup })?;

    let (count, t) = (run.steps(), run.time(run.steps()));
    let discrete = ball.discrete((0.0, 0.0), count);
    let (speed_slack, way_slack) =
        if rolls { slack(&run, 0, share) } else { slack(&run, count, 0.0) };
    let steps = count as f64;
    let speed = if rolls { ball.lagging(a * t, steps) } else { Convergence::Exact };
    let speed = if a > 0.0 { speed } else { Convergence::Exact };
    let turning = ball.lagging(spin_up * t, steps);
    // The way is longer by ½ v h, and shorter by about (²⁄₇) κ² v³ t/4 for the lag.
    let (longer, shorter) = (0.5 * a * t * h, ball.lag().powi(2) * (a * t).powi(3) * t / 14.0);
    let way = match (a > 0.0, rolls && shorter > 0.05 * longer) {
        (false, _) => Convergence::Exact,
        (true, false) => Convergence::order(1, steps),
        (true, true) => Convergence::within(longer + 1.2 * shorter, steps),
    };
    let (v, u) = discrete[count];
    let end = run.end(0);
    Ok(Findings {
        quantities: vec![
            exactly(("speed down the slope", "m/s"), end.velocity[0], a * t, speed_slack)
                .in_steps(v, speed),
            exactly(("speed of the rim", "m/s"), rim(end), spin_up * t, 2.5 * speed_slack)
                .in_steps(u, if a > 0.0 { turning } else { Convergence::Exact }),
            exactly(("way down the slope", "m"), end.position[0], 0.5 * a * t * t, way_slack)
                .in_steps(h * discrete[1..].iter().map(|(v, _)| v).sum::<f64>(), way),
            at_most_zero(
                ("way across and off the slope", "m"),
                end.position[1].hypot(end.position[2] - RADIUS),
                way_slack,
            ),
        ],
        curve: run
            .curve(("speed down the slope", "m/s"), 0, |state| state.velocity[0])
            .beside(|t| a * t),
    })
}

/// A ball that slides first.
pub static SLIDING_BALL: Posed = Posed {
    name: "sliding-ball",
    about: "A ball is struck and slides without turning: friction turns it until it rolls, after 2 \
            v/(7 μ g), with ⁵⁄₇ v whatever μ is.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 2.0), (Input::Friction, 0.3), EARTH, (Input::Speed, 4.0)],
    ..Posed::by(sliding_ball)
};

/// While it slides v(t) = v − μ g t and R ω = ⁵⁄₂ μ g t, which are equal at
/// t = 2 v/(7 μ g), with ⁵⁄₇ v; about the line of contact the angular momentum stays. After
/// that nothing acts. In the step's terms v + ⅖ w(u) stays, and v = u at the end.
fn sliding_ball(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let (gravity, speed) = (inputs.get(Input::Gravity)?, inputs.get(Input::Speed)?);
    let (friction, h) = (inputs.get(Input::Friction)?, laboratory.time_step());
    let ball = Ball { friction, along: 0.0, onto: gravity, time_step: h };
    ball.check(speed)?;
    let (grip, rolls) = (2.0 * speed / (7.0 * friction * gravity), 5.0 / 7.0 * speed);
    let mut setup = ball.setup(inputs.get(Input::Mass)?, 0.0, gravity)?;
    setup.bodies[0].start.velocity[0] = speed;
    let run = laboratory.run(&Setup { duration: 2.0 * grip + 4.0 * h, ..setup })?;

    let count = run.steps();
    let discrete = ball.discrete((speed, 0.0), count);
    // While it slides for sure.
    let slides = ((grip / h).floor() as usize).min(count);
    let slid = run.time(slides);
    let (speed_slack, way_slack) = slack(&run, slides + 2, 0.0);
    let way = speed * slid - 0.5 * friction * gravity * slid * slid;
    let (v, u) = discrete[count];
    let end = run.end(0);
    let lagging = ball.lagging(rolls, f64::INFINITY);
    Ok(Findings {
        quantities: vec![
            exactly(("speed once it rolls", "m/s"), end.velocity[0], rolls, speed_slack)
                .in_steps(v, lagging),
            exactly(("speed of the rim", "m/s"), rim(end), rolls, 2.5 * speed_slack)
                .in_steps(u, lagging),
            exactly(
                ("way while it slides", "m"),
                run.states(0)[slides].position[0],
                way,
                way_slack,
            )
            .in_steps(
                h * discrete[1..=slides].iter().map(|(v, _)| v).sum::<f64>(),
                Convergence::order(1, grip / h),
            ),
            at_most_zero(
                ("way sideways and off the ground", "m"),
                end.position[1].hypot(end.position[2] - RADIUS),
                way_slack,
            ),
        ],
        curve: run
            .curve(("speed", "m/s"), 0, |state| state.velocity[0])
            .beside(|t| if t < grip { speed - friction * gravity * t } else { rolls }),
    })
}
