//! A body thrown sideways that meets nothing.

use super::stopping::resting;
use super::{Curve, Findings, Input, Inputs, Laboratory, Problem, Quantity, Setup, Unsuitable};
use crate::contact::plane::Plane;
use crate::mechanics::body::RigidBody;
use crate::mechanics::load::Load;
use nalgebra::Vector3;

/// Free fall for a second.
pub struct FreeFall;

/// s.
const DURATION: f64 = 1.0;

impl Problem for FreeFall {
    fn name(&self) -> &'static str {
        "free-fall"
    }

    fn about(&self) -> &'static str {
        "A box thrown sideways falls for a second: z = z₀ − ½ g t², x = v t."
    }

    fn inputs(&self) -> Inputs {
        let values = [(Input::Mass, 2.0), (Input::Gravity, 9.81), (Input::Speed, 3.0)];
        Inputs::new(0.002, &values)
    }

    /// z(t) = z_0 − ½ g t², v_z(t) = −g t, x(t) = v t.
    ///
    /// The step takes the velocity at its end, so that z_n = z_0 − ½ g t² − ½ g h t, exactly
    /// ½ g h t too low.
    fn solve(
        &self,
        inputs: &Inputs,
        laboratory: &mut Laboratory<'_>,
    ) -> Result<Findings, Unsuitable> {
        let (mass, g) = (inputs.get(Input::Mass)?, inputs.get(Input::Gravity)?);
        let speed = inputs.get(Input::Speed)?;
        let drop = 0.5 * g * DURATION * DURATION;
        let mut start = resting(0.1);
        start.position[2] = 1.5 * drop + 1.0;
        start.velocity = Vector3::new(speed, 0.0, 0.0);
        let run = laboratory.run(&Setup {
            body: RigidBody::solid_box(mass, Vector3::new(0.2, 0.15, 0.1))?,
            plane: Plane::level(),
            gravity: g,
            friction: 0.3,
            start,
            load: Load::none(),
            duration: DURATION,
        })?;
        let t = run.time(run.states.len() - 1);
        let fallen = |t: f64| 0.5 * g * t * t;
        let (end, h) = (run.end(), run.time_step);
        let rounding = 1e-12 * (speed + g + drop);
        Ok(Findings {
            quantities: vec![
                Quantity {
                    name: "height fallen",
                    unit: "m",
                    measured: start.position[2] - end.position[2],
                    exact: fallen(t),
                    discretisation: 0.5 * g * h * t,
                    slack: rounding + run.position_slack(),
                },
                Quantity {
                    name: "speed downwards",
                    unit: "m/s",
                    measured: -end.velocity[2],
                    exact: g * t,
                    discretisation: 0.0,
                    slack: rounding + run.velocity_slack(),
                },
                Quantity {
                    name: "way sideways",
                    unit: "m",
                    measured: end.position[0],
                    exact: speed * t,
                    discretisation: 0.0,
                    slack: rounding + run.position_slack(),
                },
            ],
            curve: Curve::of(
                ("height", "m"),
                &run,
                |k| run.states[k].position[2],
                |t| start.position[2] - fallen(t),
            ),
        })
    }
}
