//! A box let go on a slope.

use super::prelude::*;

/// A slope below atan μ, for a minute.
pub static STICK: Posed = Posed {
    name: "slope-stick",
    about: "A box on a slope for a minute: below atan μ, as usually, it stays where it is and does \
            not creep; above, it slides.",
    time_step: 0.01,
    inputs: &[(Input::Mass, 2.0), (Input::Friction, 0.4), EARTH, (Input::Slope, 20.0)],
    ..Posed::by(|inputs, laboratory| let_go(inputs, laboratory, 60.0))
};

/// A slope above atan μ.
pub static SLIDE: Posed = Posed {
    name: "slope-slide",
    about: "A box on a slope: above atan μ, as usually, it slides with a = g (sin θ − μ cos θ); \
            below, it stays.",
    time_step: 0.002,
    inputs: &[(Input::Mass, 2.0), (Input::Friction, 0.4), EARTH, (Input::Slope, 30.0)],
    ..Posed::by(|inputs, laboratory| let_go(inputs, laboratory, 2.0))
};

/// m.
const HALF_SIDES: Vector3<f64> = Vector3::new(0.2, 0.15, 0.1);

/// The box on its slope.
struct Inclined {
    friction: f64,
    /// g sin θ and g cos θ, m/s².
    along: f64,
    onto: f64,
}

impl Inclined {
    fn new(inputs: &Inputs) -> Result<Self, Unsuitable> {
        let [friction, g, slope] = inputs.all([Input::Friction, Input::Gravity, Input::Slope])?;
        let (sin, cos) = slope.to_radians().sin_cos();
        // Where friction pulls as hard as it must or can, the box must not tip.
        let pull = friction.min(sin / cos);
        Unsuitable::when(pull * HALF_SIDES[2] >= 0.95 * HALF_SIDES[0], || {
            format!(
                "with mu {friction} on a slope of {slope}° the box tips over; a smaller one is \
                 needed"
            )
        })?;
        Ok(Self { friction, along: g * sin, onto: g * cos })
    }

    /// a, m/s². A slope of atan μ to the last digit is held: rounding is no pull.
    fn acceleration(&self) -> f64 {
        let pull = self.along - self.friction * self.onto;
        if pull > 1e-12 * self.along { pull } else { 0.0 }
    }

    /// A box that is held has slipped by what every step's slip (c) adds to the way, and is no
    /// faster than one of them; and it leans where its corners are off the ground.
    fn slack(&self, run: &Run) -> SlideSlack {
        let (h, a) = (run.time_step, self.acceleration());
        let grip = self.friction * self.onto * h;
        let lean = HALF_SIDES[2] / HALF_SIDES[1];
        let slider = Slider { mobility: 1.0, friction: self.friction, grip, lean };
        let share = self.along * h / grip;
        let steps = (1..=run.steps()).map(|k| SlideStep { slip: k as f64 * a * h, share });
        slider.slack(run, steps)
    }
}

/// Friction holds what pulls along the slope, m g sin θ, up to μ m g cos θ:
///
/// ```text
/// a = max(0, g (sin θ − μ cos θ)),   v = a t,   x = ½ a t²
/// ```
///
/// The step's velocities are exact, v_k = k a h, and its way is x_N = ½ a h² N (N + 1),
/// longer by ½ a h t. A box that is held does not move at all.
fn let_go(inputs: &Inputs, laboratory: &mut Laboratory<'_>, duration: f64) -> Solved {
    let on = Inclined::new(inputs)?;
    let mass = inputs.get(Input::Mass)?;
    let bodies = vec![Subject::solid_box(mass, HALF_SIDES, resting(HALF_SIDES[2]))?];
    let run = laboratory.run(&Setup {
        slope: inputs.get(Input::Slope)?,
        ..Setup::new(bodies, inputs.get(Input::Gravity)?, on.friction, duration)
    })?;
    let (a, h, steps) = (on.acceleration(), run.time_step, run.steps() as f64);
    let (t, end) = (run.time(run.steps()), run.end(0));
    let slack = on.slack(&run);
    let astray = end.position[1].hypot(end.position[2] - HALF_SIDES[2]);
    let convergence = if a > 0.0 { Convergence::order(1, steps) } else { Convergence::Exact };
    Ok(Findings {
        quantities: vec![
            exactly(("way down the slope", "m"), end.position[0], 0.5 * a * t * t, slack.way())
                .in_steps(0.5 * a * h * h * steps * (steps + 1.0), convergence),
            exactly(("speed down the slope", "m/s"), end.velocity[0], a * t, slack.speed()),
            at_most_zero(("way across and off the slope", "m"), astray, slack.across + run.seat()),
        ],
        curve: run
            .curve(("way down the slope", "m"), 0, |state| state.position[0])
            .beside(|t| 0.5 * a * t * t),
    })
}
