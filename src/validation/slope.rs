//! A box let go on a slope.

use super::slack::{SlideSlack, SlideStep, Slider};
use super::stopping::resting;
use super::{Convergence, Curve, Findings, Input, Inputs, Laboratory, Problem, Quantity};
use super::{Run, Setup, Subject, Unsuitable};
use crate::mechanics::RigidBody;
use nalgebra::Vector3;

/// A box let go on a slope, which holds it or not.
pub struct Slope {
    name: &'static str,
    about: &'static str,
    /// Usually, degrees.
    slope: f64,
    /// How long it is watched, s.
    duration: f64,
    /// Usually, s.
    time_step: f64,
}

/// A slope below atan μ, for a minute.
pub static STICK: Slope = Slope {
    name: "slope-stick",
    about: "A box on a slope for a minute: below atan μ, as usually, it stays where it is and does \
            not creep; above, it slides.",
    slope: 20.0,
    duration: 60.0,
    time_step: 0.01,
};

/// A slope above atan μ.
pub static SLIDE: Slope = Slope {
    name: "slope-slide",
    about: "A box on a slope: above atan μ, as usually, it slides with a = g (sin θ − μ cos θ); \
            below, it stays.",
    slope: 30.0,
    duration: 2.0,
    time_step: 0.002,
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
        let (friction, g) = (inputs.get(Input::Friction)?, inputs.get(Input::Gravity)?);
        let slope = inputs.get(Input::Slope)?;
        let (sin, cos) = slope.to_radians().sin_cos();
        // Where friction pulls as hard as it must or can, the box must not tip.
        let pull = friction.min(sin / cos);
        if pull * HALF_SIDES[2] >= 0.95 * HALF_SIDES[0] {
            return Err(Unsuitable::Motion(format!(
                "with mu {friction} on a slope of {slope}° the box tips over; a smaller one is \
                 needed"
            )));
        }
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
        let steps: Vec<_> =
            (1..=run.steps()).map(|k| SlideStep { slip: k as f64 * a * h, share }).collect();
        slider.slack(run, &steps)
    }
}

impl Problem for Slope {
    fn name(&self) -> &'static str {
        self.name
    }

    fn about(&self) -> &'static str {
        self.about
    }

    fn inputs(&self) -> Inputs {
        let (mass, friction) = ((Input::Mass, 2.0), (Input::Friction, 0.4));
        let values = [mass, friction, (Input::Gravity, 9.81), (Input::Slope, self.slope)];
        Inputs::new(self.time_step, &values)
    }

    /// Friction holds what pulls along the slope, m g sin θ, up to μ m g cos θ:
    ///
    /// ```text
    /// a = max(0, g (sin θ − μ cos θ)),   v = a t,   x = ½ a t²
    /// ```
    ///
    /// The step's velocities are exact, v_k = k a h, and its way is x_N = ½ a h² N (N + 1),
    /// longer by ½ a h t. A box that is held does not move at all.
    fn solve(
        &self,
        inputs: &Inputs,
        laboratory: &mut Laboratory<'_>,
    ) -> Result<Findings, Unsuitable> {
        let on = Inclined::new(inputs)?;
        let body = RigidBody::solid_box(inputs.get(Input::Mass)?, HALF_SIDES)?;
        let bodies = vec![Subject::new(body, resting(HALF_SIDES[2]))];
        let run = laboratory.run(&Setup {
            slope: inputs.get(Input::Slope)?,
            ..Setup::new(bodies, inputs.get(Input::Gravity)?, on.friction, self.duration)
        })?;
        let (a, h, steps) = (on.acceleration(), run.time_step, run.steps() as f64);
        let (t, end) = (run.time(run.steps()), run.end(0));
        let slack = on.slack(&run);
        let astray = end.position[1].hypot(end.position[2] - HALF_SIDES[2]);
        let convergence = if a > 0.0 { Convergence::order(1, steps) } else { Convergence::Exact };
        Ok(Findings {
            quantities: vec![
                Quantity {
                    discrete: 0.5 * a * h * h * steps * (steps + 1.0),
                    convergence,
                    ..Quantity::exactly(
                        ("way down the slope", "m"),
                        end.position[0],
                        0.5 * a * t * t,
                        slack.way(),
                    )
                },
                Quantity::exactly(
                    ("speed down the slope", "m/s"),
                    end.velocity[0],
                    a * t,
                    slack.speed(),
                ),
                Quantity::at_most_zero(
                    ("way across and off the slope", "m"),
                    astray,
                    slack.across + run.seat(),
                ),
            ],
            curve: Curve::of(
                ("way down the slope", "m"),
                &run,
                |k| run.states(0)[k].position[0],
                |t| 0.5 * a * t * t,
            ),
        })
    }
}
