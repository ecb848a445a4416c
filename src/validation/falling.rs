//! A body thrown sideways that meets nothing.

use super::stopping::resting;
use super::{Convergence, Curve, Findings, Input, Inputs, Laboratory, Problem, Quantity};
use super::{Setup, Subject, Unsuitable};
use crate::mechanics::RigidBody;
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
    /// The step takes the velocity at its end, v_k = −k g h, so that after N steps
    ///
    /// ```text
    /// z_0 − z_N = h Σ k g h = ½ g h² N (N + 1)
    /// ```
    ///
    /// which is ½ g h t more than ½ g t²; velocities and the way sideways are exact.
    fn solve(
        &self,
        inputs: &Inputs,
        laboratory: &mut Laboratory<'_>,
    ) -> Result<Findings, Unsuitable> {
        let (mass, g) = (inputs.get(Input::Mass)?, inputs.get(Input::Gravity)?);
        let speed = inputs.get(Input::Speed)?;
        let mut start = resting(0.1);
        start.position[2] = 0.75 * g * DURATION * DURATION + 1.0;
        start.velocity = Vector3::new(speed, 0.0, 0.0);
        let body = RigidBody::solid_box(mass, Vector3::new(0.2, 0.15, 0.1))?;
        let run = laboratory.run(&Setup::new(vec![Subject::new(body, start)], g, 0.3, DURATION))?;
        let (end, h, steps) = (run.end(0), run.time_step, run.steps() as f64);
        let t = run.time(run.steps());
        let fallen = |t: f64| 0.5 * g * t * t;
        let (speed_slack, way_slack) = (run.flight_speed_slack(), run.flight_way_slack());
        Ok(Findings {
            quantities: vec![
                Quantity {
                    discrete: 0.5 * g * h * h * steps * (steps + 1.0),
                    convergence: Convergence::order(1, steps),
                    ..Quantity::exactly(
                        ("height fallen", "m"),
                        start.position[2] - end.position[2],
                        fallen(t),
                        way_slack,
                    )
                },
                Quantity::exactly(("speed downwards", "m/s"), -end.velocity[2], g * t, speed_slack),
                Quantity::exactly(("way sideways", "m"), end.position[0], speed * t, way_slack),
            ],
            curve: Curve::of(
                ("height", "m"),
                &run,
                |k| run.states(0)[k].position[2],
                |t| start.position[2] - fallen(t),
            ),
        })
    }
}
