//! Bodies that slide on level ground until friction stops them.

use super::prelude::*;
use super::slack::stop_time;
use crate::mechanics::quaternion::rotation;

/// At rest, upright, the centre at `height` (m).
pub(super) fn resting(height: f64) -> State {
    State {
        position: Vector3::new(0.0, 0.0, height),
        attitude: Vector4::new(1.0, 0.0, 0.0, 0.0),
        velocity: Vector3::zeros(),
        spin: Vector3::zeros(),
    }
}

/// A slide on level ground along a direction.
///
/// In continuous time v(t) = v − μ g t. A step takes the grip G = μ g h from the speed, or
/// what is left of it; with v = (M + θ) G, M whole and 0 ≤ θ < 1,
///
/// ```text
/// v_k = max(0, v − k G),   x_k = h (j v − ½ j (j + 1) G) with j = min(k, M)
/// ```
///
/// The way at the stop is v²/(2 μ g) − ½ v h + ½ θ (1 − θ) h G.
pub(super) struct Slide {
    pub half_sides: Vector3<f64>,
    pub mass: f64,
    pub friction: f64,
    pub gravity: f64,
    /// At the start, m/s.
    pub velocity: Vector3<f64>,
}

impl Slide {
    /// The inputs of a slide along x.
    pub fn along_x(half_sides: Vector3<f64>, inputs: &Inputs) -> Result<Self, Unsuitable> {
        Ok(Self {
            half_sides,
            mass: inputs.get(Input::Mass)?,
            friction: inputs.get(Input::Friction)?,
            gravity: inputs.get(Input::Gravity)?,
            velocity: Vector3::new(inputs.get(Input::Speed)?, 0.0, 0.0),
        })
    }

    fn speed(&self) -> f64 {
        self.velocity.norm()
    }

    /// v/(μ g): the stopping time, s.
    fn time(&self) -> f64 {
        self.speed() / (self.friction * self.gravity)
    }

    /// x(t) = v t − ½ μ g t² until the stop, m.
    pub fn way(&self, t: f64) -> f64 {
        let t = t.min(self.time());
        self.speed() * t - 0.5 * self.friction * self.gravity * t * t
    }

    /// v_k, m/s.
    fn discrete_speeds(&self, h: f64, steps: usize) -> Vec<f64> {
        let grip = self.friction * self.gravity * h;
        (0..=steps).map(|k| (self.speed() - k as f64 * grip).max(0.0)).collect()
    }

    /// The stopping distance, m.
    pub fn distance(&self, measured: f64, h: f64, slack: f64) -> Quantity {
        let grip = self.friction * self.gravity * h;
        let whole = (self.speed() / grip).floor();
        exactly(("stopping distance", "m"), measured, self.way(self.time()), slack).in_steps(
            h * (whole * self.speed() - 0.5 * whole * (whole + 1.0) * grip),
            Convergence::order(1, whole),
        )
    }

    /// What the residuals of `run` allow.
    pub fn slack(&self, run: &Run) -> SlideSlack {
        let grip = self.friction * self.gravity * run.time_step;
        let speeds = self.discrete_speeds(run.time_step, run.steps());
        let steps =
            speeds.windows(2).map(|pair| SlideStep { slip: pair[1], share: pair[0] / grip });
        let foot = self.half_sides[0].min(self.half_sides[1]);
        let lean = self.half_sides[2] / foot;
        let slider = Slider { mobility: 1.0, friction: self.friction, grip, lean };
        slider.slack(run, steps)
    }

    /// The run, a quarter longer than the slide.
    ///
    /// The box must not tip: friction acts μ m g at the bottom and shifts the ground's force
    /// forwards by μ c, with c half the height; it must stay under the face. In any direction
    /// that is μ c less than the shorter half side.
    pub fn run(&self, laboratory: &mut Laboratory<'_>) -> Result<Run, Unsuitable> {
        let foot = self.half_sides[0].min(self.half_sides[1]);
        Unsuitable::when(self.friction * self.half_sides[2] >= 0.95 * foot, || {
            format!(
                "with mu {} the box tips instead of sliding; below {:.2} is needed",
                self.friction,
                0.95 * foot / self.half_sides[2]
            )
        })?;
        let mut start = resting(self.half_sides[2]);
        start.velocity = self.velocity;
        let duration = 1.25 * self.time() + 4.0 * laboratory.time_step();
        let bodies = vec![Subject::solid_box(self.mass, self.half_sides, start)?];
        laboratory.run(&Setup::new(bodies, self.gravity, self.friction, duration))
    }
}

/// When a body stops that the friction of a step slows by `decrement`, m/s: `speeds` as they
/// were measured and as they must be, at the start and after each step.
///
/// Speeds that are off by what `slack` says shift the line to zero by their sum, and turn it
/// by what they change from one step to the next, over a hundredth of the time or a step.
pub(super) fn stopping_time(
    (measured, discrete): (&[f64], &[f64]),
    decrement: f64,
    exact: f64,
    h: f64,
    slack: &SlideSlack,
) -> Quantity {
    // The states that may be on the line.
    let fast = discrete[1..].iter().take_while(|speed| **speed > 0.01 * discrete[0]).count().max(1);
    let largest = |values: &[f64]| values[..fast].iter().copied().fold(0.0, f64::max);
    let turned = (largest(&slack.changes) + 2.0 * slack.lifted) / decrement * (0.01 * exact + h);
    Quantity {
        discrete: stop_time(discrete, h),
        ..exactly(
            ("stopping time", "s"),
            stop_time(measured, h),
            exact,
            h * largest(&slack.speeds) / decrement + turned,
        )
    }
}

/// A box that slides until it stops.
pub static SLIDING_STOP: Posed = Posed {
    name: "sliding-stop",
    about: "A box slides on level ground until friction stops it, after v²/(2 μ g) and v/(μ g).",
    time_step: 0.002,
    inputs: &[(Input::Mass, 2.0), (Input::Friction, 0.3), EARTH, (Input::Speed, 3.0)],
    ..Posed::by(sliding_stop)
};

/// v(t) = v − μ g t: the stop is after v/(μ g) and v²/(2 μ g). The speeds of [`Slide`] are
/// on that line, and with them the time at which it reaches zero, unless the first step
/// stops the box.
fn sliding_stop(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let slide = Slide::along_x(Vector3::new(0.2, 0.15, 0.1), inputs)?;
    let run = slide.run(laboratory)?;
    let (h, slack) = (run.time_step, slide.slack(&run));
    let grip = slide.friction * slide.gravity * h;
    let measured: Vec<f64> = run.states(0).iter().map(|state| state.velocity.norm()).collect();
    let discrete = slide.discrete_speeds(h, run.steps());
    let time = stopping_time((&measured, &discrete), grip, slide.time(), h, &slack);
    let convergence = on_the_line(&discrete);
    Ok(Findings {
        quantities: vec![
            slide.distance(run.end(0).position[0], run.time_step, slack.way()),
            Quantity { convergence, ..time },
            exactly(("speed at the end", "m/s"), run.end(0).velocity.norm(), 0.0, slack.speed()),
        ],
        curve: run.curve(("way", "m"), 0, |state| state.position[0]).beside(|t| slide.way(t)),
    })
}

/// How a stopping time comes to the exact one where speeds fall along a line: it is exact if
/// two of them are on it.
fn on_the_line(speeds: &[f64]) -> Convergence {
    if speeds[1] > 0.01 * speeds[0] { Convergence::Exact } else { Convergence::Unresolved }
}

/// A thin plate that slides fast: nothing may lift it.
pub static FAST_PLATE: Posed = Posed {
    name: "fast-plate",
    about: "A thin plate slides fast and stops: no corner of its face leaves the ground or sinks \
            into it, and it goes straight.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 1.0), (Input::Friction, 0.3), EARTH, (Input::Speed, 10.0)],
    ..Posed::by(fast_plate)
};

/// The lower face stays in the plane: z = 0 for its four corners at all times.
fn fast_plate(inputs: &Inputs, laboratory: &mut Laboratory<'_>) -> Solved {
    let half_sides = Vector3::new(0.5, 0.5, 0.025);
    let slide = Slide::along_x(half_sides, inputs)?;
    let run = slide.run(laboratory)?;
    let bottom = |state: &State| {
        let down = rotation(&state.attitude);
        let corner = |x: f64, y: f64| {
            let c = Vector3::new(x * half_sides[0], y * half_sides[1], -half_sides[2]);
            (state.position + down * c)[2]
        };
        [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)]
    };
    let heights: Vec<_> = run.states(0).iter().map(bottom).collect();
    let highest = heights.iter().flatten().fold(0.0_f64, |a, &b| a.max(b));
    let lowest = heights.iter().flatten().fold(0.0_f64, |a, &b| a.min(b));
    let astray = run.states(0).iter().map(|state| state.position[1].abs()).fold(0.0, f64::max);
    let slack = slide.slack(&run);
    Ok(Findings {
        quantities: vec![
            at_most_zero(("lift-off", "m"), highest, run.seat()),
            at_most_zero(("penetration", "m"), -lowest, run.seat()),
            at_most_zero(("way sideways", "m"), astray, slack.across),
            slide.distance(run.end(0).position[0], run.time_step, slack.way()),
        ],
        curve: run.curve(("way", "m"), 0, |state| state.position[0]).beside(|t| slide.way(t)),
    })
}
