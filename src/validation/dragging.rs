//! A cube that is dragged harder and harder.

use super::prelude::*;

/// The force grows from 0 to this, N, in this time, s.
const FORCE: f64 = 20.0;
const DURATION: f64 = 2.0;
/// The cube has slid when it is as fast as this, m/s.
const SLIDING: f64 = 0.01;
/// m.
const HALF_SIDE: f64 = 0.1;

/// A cube under a growing force.
pub static DRAGGED_CUBE: Posed = Posed {
    name: "dragged-cube",
    about: "A cube is dragged by a force that grows from 0 to 20 N in 2 s: it sticks up to μ m g, \
            then slides while friction stays μ m g.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 1.0), (Input::Friction, 0.4), EARTH],
    ..Posed::by(dragged_cube)
};

/// With F = r t friction holds until t_s = μ m g/r, and then
///
/// ```text
/// v(t) = r (t − t_s)²/(2 m),   x(t) = r (t − t_s)³/(6 m)
/// ```
///
/// [`Dragged`] has the step's.
fn dragged_cube(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let dragged = Dragged::new(inputs)?;
    let force = Polyline::new(vec![
        (0.0, Vector3::zeros()),
        // Longer than the last step.
        (2.0 * DURATION, Vector3::new(2.0 * FORCE, 0.0, 0.0)),
    ])?;
    let cube = Subject::solid_box(dragged.mass, Vector3::repeat(HALF_SIDE), resting(HALF_SIDE))?;
    let bodies = vec![cube.pulled(force)?];
    let run = laboratory.run(&Setup::new(bodies, dragged.gravity, dragged.friction, DURATION))?;
    Ok(Findings {
        quantities: dragged.quantities(&run),
        curve: run.curve(("way", "m"), 0, |state| state.position[0]).beside(|t| dragged.way(t)),
    })
}

/// The cube and what drags it.
///
/// The step's load is its mean, r h (k + ½) in the step k, so that the cube is held up to
/// the step s, the least with r h (s + ½) > μ m g. After n more steps, with the first
/// excess F = r h (s + ½) − μ m g,
///
/// ```text
/// v = h/m (n F + ½ n (n − 1) r h)
/// x = h²/m (½ n (n + 1) F + (n − 1) n (n + 1) r h/6)
/// ```
///
/// Since s h is within ½ h of t_s, the speed is less than the exact one by at most
/// r h²/(8 m); the way is longer by ½ v h.
struct Dragged {
    mass: f64,
    friction: f64,
    gravity: f64,
}

/// r, N/s.
const RATE: f64 = FORCE / DURATION;

impl Dragged {
    fn new(inputs: &Inputs) -> Result<Self, Unsuitable> {
        let [friction, gravity, mass] =
            inputs.all([Input::Friction, Input::Gravity, Input::Mass])?;
        let limit = friction * mass * gravity;
        Unsuitable::when(limit >= 0.9 * FORCE || friction >= 0.95, || {
            format!(
                "mu m g = {limit:.3} N with mu {friction}: below {} N and mu 0.95 are needed for \
                 the cube to slide and not to tip",
                0.9 * FORCE
            )
        })?;
        let dragged = Self { mass, friction, gravity };
        Unsuitable::when(dragged.speed(DURATION) < 2.0 * SLIDING, || {
            format!(
                "the cube is dragged to no more than {:.3} m/s; a lighter one is needed",
                dragged.speed(DURATION)
            )
        })?;
        Ok(dragged)
    }

    /// μ m g, N.
    fn limit(&self) -> f64 {
        self.friction * self.mass * self.gravity
    }

    /// t_s, s.
    fn onset(&self) -> f64 {
        self.limit() / RATE
    }

    /// v(t), m/s.
    fn speed(&self, t: f64) -> f64 {
        0.5 * RATE * (t - self.onset()).max(0.0).powi(2) / self.mass
    }

    /// x(t), m.
    fn way(&self, t: f64) -> f64 {
        RATE * (t - self.onset()).max(0.0).powi(3) / (6.0 * self.mass)
    }

    /// s, the first step that slides.
    fn first_slide(&self, h: f64) -> usize {
        (self.limit() / (RATE * h) + 0.5).floor() as usize
    }

    /// v and x after `steps`, m/s and m.
    fn discrete(&self, h: f64, steps: usize) -> (f64, f64) {
        let first = self.first_slide(h);
        let n = steps.saturating_sub(first) as f64;
        let excess = RATE * h * (first as f64 + 0.5) - self.limit();
        let speed = h / self.mass * (n * excess + 0.5 * n * (n - 1.0) * RATE * h);
        let cubic = (n - 1.0) * n * (n + 1.0) * RATE * h / 6.0;
        (speed, h * h / self.mass * (0.5 * n * (n + 1.0) * excess + cubic))
    }

    fn slack(&self, run: &Run) -> SlideSlack {
        let h = run.time_step;
        let steps = (0..run.steps()).map(|k| SlideStep {
            slip: self.discrete(h, k + 1).0,
            share: RATE * h * (k as f64 + 0.5) / self.limit(),
        });
        let grip = self.friction * self.gravity * h;
        let slider = Slider { mobility: 1.0, friction: self.friction, grip, lean: 1.0 };
        slider.slack(run, steps)
    }

    fn quantities(&self, run: &Run) -> Vec<Quantity> {
        let (h, steps) = (run.time_step, run.steps());
        let (t, slack, first) = (run.time(steps), self.slack(run), self.first_slide(h));
        let held = &run.states(0)[..=first.min(steps)];
        let crept = held.iter().map(|state| state.position.xy().norm()).fold(0.0, f64::max);
        let crept_slack = slack.ways[first.clamp(1, steps) - 1];
        let measured = run.end(0).velocity[0];
        let (speed, way) = self.discrete(h, steps);
        let bound = Convergence::Within(0.125 * RATE * h * h / self.mass);
        vec![
            at_most_zero(("creep while it sticks", "m"), crept, crept_slack),
            self.passing(run, &slack),
            self.drag(run, &slack),
            exactly(("speed at the end", "m/s"), measured, self.speed(t), slack.speed())
                .in_steps(speed, bound),
            exactly(("way", "m"), run.end(0).position[0], self.way(t), slack.way())
                .in_steps(way, Convergence::order(1, (steps - first.min(steps)) as f64)),
        ]
    }

    /// When the speed v passes [`SLIDING`], after τ = √(2 m v/r) of sliding. Speeds are less
    /// by r h²/(8 m), and the line between two of them is above the parabola by as much:
    /// times are off by no more than √(τ² + ½ h²) − τ or τ − √(τ² − ½ h²).
    fn passing(&self, run: &Run, slack: &SlideSlack) -> Quantity {
        let h = run.time_step;
        let measured: Vec<f64> = run.states(0).iter().map(|state| state.velocity[0]).collect();
        let discrete: Vec<f64> = (0..=run.steps()).map(|k| self.discrete(h, k).0).collect();
        let after = (2.0 * self.mass * SLIDING / RATE).sqrt();
        let bound = after - (after * after - 0.5 * h * h).max(0.0).sqrt();
        let passed = discrete.iter().position(|speed| *speed >= SLIDING).unwrap_or(1).max(1);
        let slope = (discrete[passed] - discrete[passed - 1]) / h;
        exactly(
            ("time of 1 cm/s", "s"),
            passing(&measured, h),
            self.onset() + after,
            2.0 * slack.speeds[passed - 1] / slope,
        )
        .in_steps(passing(&discrete, h), Convergence::Within(bound.max(after.hypot(h) - after)))
    }

    /// Friction in the steps that slide all the while; the one in which it begins may be held
    /// for a part.
    fn drag(&self, run: &Run, slack: &SlideSlack) -> Quantity {
        let from = (self.first_slide(run.time_step) + 1).min(run.steps());
        let sliding: Vec<f64> = run.forces(0)[from..].iter().map(|force| -force[0]).collect();
        let lifted = 2.0 * slack.lifted / sliding.len() as f64;
        let slack = self.mass / run.time_step * (mean(&slack.changes[from..]) + lifted);
        exactly(("friction while it slides", "N"), mean(&sliding), self.limit(), slack)
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// When the `speeds` pass [`SLIDING`], on the line between two states, s.
fn passing(speeds: &[f64], h: f64) -> f64 {
    let Some(k) = speeds.iter().position(|speed| *speed >= SLIDING) else { return f64::NAN };
    let Some(before) = k.checked_sub(1).map(|before| speeds[before]) else { return f64::NAN };
    h * (k as f64 - (speeds[k] - SLIDING) / (speeds[k] - before))
}
