//! A cube that is dragged harder and harder.

use super::stopping::resting;
use super::{Curve, Findings, Input, Inputs, Laboratory, Problem, Quantity, Setup, Unsuitable};
use crate::contact::plane::Plane;
use crate::mechanics::body::RigidBody;
use crate::mechanics::load::{Load, Polyline};
use nalgebra::Vector3;

/// A cube under a growing force.
pub struct DraggedCube;

/// The force grows from 0 to this, N, in this time, s.
const FORCE: f64 = 20.0;
const DURATION: f64 = 2.0;
/// The cube has slid when it is as fast as this, m/s.
const SLIDING: f64 = 0.01;
/// m.
const HALF_SIDE: f64 = 0.1;

impl Problem for DraggedCube {
    fn name(&self) -> &'static str {
        "dragged-cube"
    }

    fn about(&self) -> &'static str {
        "A cube is dragged by a force that grows from 0 to 20 N in 2 s: it sticks up to μ m g, \
         then slides while friction stays μ m g."
    }

    fn inputs(&self) -> Inputs {
        let values = [(Input::Mass, 1.0), (Input::Friction, 0.4), (Input::Gravity, 9.81)];
        Inputs::new(0.002, &values)
    }

    /// With F = r t friction holds until t_s = μ m g/r, and then
    ///
    /// ```text
    /// v(t) = r (t − t_s)²/(2 m),   x(t) = r (t − t_s)³/(6 m)
    /// ```
    ///
    /// The step's impulses are exact but in the step where sliding begins, which may lack as
    /// much as r h²/m of speed; its way is longer by ½ v h.
    fn solve(
        &self,
        inputs: &Inputs,
        laboratory: &mut Laboratory<'_>,
    ) -> Result<Findings, Unsuitable> {
        let (friction, g) = (inputs.get(Input::Friction)?, inputs.get(Input::Gravity)?);
        let mass = inputs.get(Input::Mass)?;
        let (rate, limit) = (FORCE / DURATION, friction * mass * g);
        if limit >= 0.9 * FORCE || friction >= 0.95 {
            return Err(Unsuitable::Motion(format!(
                "mu m g = {limit:.3} N with mu {friction}: below {} N and mu 0.95 are needed for \
                 the cube to slide and not to tip",
                0.9 * FORCE
            )));
        }
        let force = Polyline::new(vec![
            (0.0, Vector3::zeros()),
            (DURATION, Vector3::new(FORCE, 0.0, 0.0)),
        ])?;
        let run = laboratory.run(&Setup {
            body: RigidBody::solid_box(mass, Vector3::repeat(HALF_SIDE))?,
            plane: Plane::level(),
            gravity: g,
            friction,
            start: resting(HALF_SIDE),
            load: Load::new(force, Polyline::default(), Vector3::zeros())?,
            duration: DURATION,
        })?;

        let h = run.time_step;
        let onset = limit / rate;
        let speed = |t: f64| 0.5 * rate * (t - onset).max(0.0).powi(2) / mass;
        let way = |t: f64| rate * (t - onset).max(0.0).powi(3) / (6.0 * mass);
        let t = run.time(run.states.len() - 1);
        let lost = rate * h * h / mass;
        let held = run.states.iter().enumerate().filter(|(k, _)| run.time(*k) <= onset);
        let crept = held.map(|(_, state)| state.position.xy().norm()).fold(0.0, f64::max);
        let sliding: Vec<f64> = (0..run.forces.len())
            .filter(|&k| run.time(k) > onset + h)
            .map(|k| -run.forces[k][0])
            .collect();
        let drag = mean(&sliding);
        // How fast the speed passes SLIDING: the slope there turns speeds into times.
        let seen = onset + (2.0 * mass * SLIDING / rate).sqrt();
        let slope = rate * (seen - onset) / mass;
        Ok(Findings {
            quantities: vec![
                Quantity {
                    name: "creep while it sticks",
                    unit: "m",
                    measured: crept,
                    exact: 0.0,
                    discretisation: 0.0,
                    slack: run.position_slack(),
                },
                Quantity {
                    name: "time of 1 cm/s",
                    unit: "s",
                    measured: passing(&run.states, h).unwrap_or(f64::NAN),
                    exact: seen,
                    // The chord of a parabola over a step is at most an eighth of h² times
                    // its curvature above it.
                    discretisation: (lost + 0.125 * rate * h * h / mass) / slope,
                    slack: run.velocity_slack() / slope,
                },
                Quantity {
                    name: "friction while it slides",
                    unit: "N",
                    measured: drag,
                    exact: limit,
                    discretisation: 0.0,
                    // An impulse h F of every step may be off by m c.
                    slack: mass * (mean(&run.certificates) + 1e-11) / h,
                },
                Quantity {
                    name: "speed at the end",
                    unit: "m/s",
                    measured: run.end().velocity[0],
                    exact: speed(t),
                    discretisation: lost,
                    slack: run.velocity_slack(),
                },
                Quantity {
                    name: "way",
                    unit: "m",
                    measured: run.end().position[0],
                    exact: way(t),
                    discretisation: 0.5 * speed(t) * h + lost * t,
                    slack: run.position_slack(),
                },
            ],
            curve: Curve::of(("way", "m"), &run, |k| run.states[k].position[0], way),
        })
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// When the speed along x passes [`SLIDING`], on the line between two states, s.
fn passing(states: &[crate::mechanics::state::State], h: f64) -> Option<f64> {
    let k = states.iter().position(|state| state.velocity[0] >= SLIDING)?;
    let before = states[k.checked_sub(1)?].velocity[0];
    Some(h * (k as f64 - (states[k].velocity[0] - SLIDING) / (states[k].velocity[0] - before)))
}
