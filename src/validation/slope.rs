//! A box let go on a slope.

use super::stopping::resting;
use super::{Curve, Findings, Input, Inputs, Laboratory, Problem, Quantity, Setup, Unsuitable};
use crate::contact::plane::Plane;
use crate::mechanics::body::RigidBody;
use crate::mechanics::load::Load;
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
    /// The step's velocities are exact; its way is longer by ½ a h t.
    fn solve(
        &self,
        inputs: &Inputs,
        laboratory: &mut Laboratory<'_>,
    ) -> Result<Findings, Unsuitable> {
        let (friction, g) = (inputs.get(Input::Friction)?, inputs.get(Input::Gravity)?);
        let slope = inputs.get(Input::Slope)?;
        let (sin, cos) = slope.to_radians().sin_cos();
        let half_sides = Vector3::new(0.2, 0.15, 0.1);
        // Where friction pulls as hard as it must or can, the box must not tip.
        let pull = friction.min(sin / cos);
        if pull * half_sides[2] >= 0.95 * half_sides[0] {
            return Err(Unsuitable::Motion(format!(
                "with mu {friction} on a slope of {slope}° the box tips over; a smaller one is \
                 needed"
            )));
        }
        let run = laboratory.run(&Setup {
            body: RigidBody::solid_box(inputs.get(Input::Mass)?, half_sides)?,
            plane: Plane::sloping(slope)?,
            gravity: g,
            friction,
            start: resting(half_sides[2]),
            load: Load::none(),
            duration: self.duration,
        })?;
        // A slope of atan μ to the last digit is held: rounding is no pull.
        let pull = g * (sin - friction * cos);
        let a = if pull > 1e-12 * g { pull } else { 0.0 };
        let t = run.time(run.states.len() - 1);
        let end = run.end();
        let astray = end.position[1].hypot(end.position[2] - half_sides[2]);
        Ok(Findings {
            quantities: vec![
                Quantity {
                    name: "way down the slope",
                    unit: "m",
                    measured: end.position[0],
                    exact: 0.5 * a * t * t,
                    discretisation: 0.5 * a * run.time_step * t,
                    slack: run.position_slack(),
                },
                Quantity {
                    name: "speed down the slope",
                    unit: "m/s",
                    measured: end.velocity[0],
                    exact: a * t,
                    discretisation: 0.0,
                    slack: run.velocity_slack(),
                },
                Quantity {
                    name: "way across and off the slope",
                    unit: "m",
                    measured: astray,
                    exact: 0.0,
                    discretisation: 0.0,
                    slack: run.position_slack(),
                },
            ],
            curve: Curve::of(
                ("way down the slope", "m"),
                &run,
                |k| run.states[k].position[0],
                |t| 0.5 * a * t * t,
            ),
        })
    }
}
