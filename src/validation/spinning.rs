//! A flat box that spins on level ground until friction stops it.

use super::stopping::{resting, stop_time_slack};
use super::{Curve, Findings, Input, Inputs, Laboratory, Problem, Quantity, Setup, Unsuitable};
use crate::contact::plane::Plane;
use crate::mechanics::body::RigidBody;
use crate::mechanics::load::Load;
use nalgebra::Vector3;

/// A flat box spinning about the vertical.
pub struct SpinningBox;

impl Problem for SpinningBox {
    fn name(&self) -> &'static str {
        "spinning-box"
    }

    fn about(&self) -> &'static str {
        "A flat box spins on its four corners: friction at the radius R stops it after \
         R ω/(3 μ g), while its centre stays."
    }

    fn inputs(&self) -> Inputs {
        let (mass, friction) = ((Input::Mass, 1.0), (Input::Friction, 0.3));
        let values = [mass, friction, (Input::Gravity, 9.81), (Input::Speed, 10.0)];
        Inputs::new(0.002, &values)
    }

    fn unit(&self, input: Input) -> &'static str {
        if input == Input::Speed { "rad/s" } else { input.unit() }
    }

    /// Friction at every corner is along its circle, together μ m g however the corners
    /// share the weight, with the arm R = √(a² + b²). With I = m (a² + b²)/3 = m R²/3:
    ///
    /// ```text
    /// ω(t) = ω − 3 μ g t/R,   t_stop = R ω/(3 μ g),   φ = ½ ω t_stop
    /// ```
    ///
    /// The step's slip is the chord of the circle, which shortens friction's arm to
    /// R cos(½ ω h): the stop comes later by a share of at most (ω h)²/8. Its angle goes with
    /// the spin at the end of the step and lacks ½ ω h.
    fn solve(
        &self,
        inputs: &Inputs,
        laboratory: &mut Laboratory<'_>,
    ) -> Result<Findings, Unsuitable> {
        let (friction, g) = (inputs.get(Input::Friction)?, inputs.get(Input::Gravity)?);
        let (mass, spin) = (inputs.get(Input::Mass)?, inputs.get(Input::Speed)?);
        let half_sides = Vector3::<f64>::new(0.2, 0.2, 0.02);
        let radius = half_sides[0].hypot(half_sides[1]);
        let deceleration = 3.0 * friction * g / radius;
        let time = spin / deceleration;
        let h = laboratory.time_step();
        if spin * h > 0.5 {
            return Err(Unsuitable::Motion(format!(
                "speed {spin} rad/s turns the box by more than half a radian a step"
            )));
        }
        let mut start = resting(half_sides[2]);
        start.spin = Vector3::new(0.0, 0.0, spin);
        let run = laboratory.run(&Setup {
            body: RigidBody::solid_box(mass, half_sides)?,
            plane: Plane::level(),
            gravity: g,
            friction,
            start,
            load: Load::none(),
            duration: 1.25 * time + 4.0 * h,
        })?;

        let arm = (spin * h).powi(2) / 8.0;
        // Speeds of the corners turn into spins.
        let slack = run.position_slack() / radius;
        let mut angles = vec![0.0];
        for state in &run.states[1..] {
            angles.push(angles[angles.len() - 1] + h * state.spin[2]);
        }
        let angle = |t: f64| {
            let t = t.min(time);
            spin * t - 0.5 * deceleration * t * t
        };
        let astray = run.states.iter().map(|state| state.position.xy().norm()).fold(0.0, f64::max);
        let stop = run.stop_time(|state| state.spin[2].abs()).unwrap_or(f64::NAN);
        Ok(Findings {
            quantities: vec![
                Quantity {
                    name: "stopping time",
                    unit: "s",
                    measured: stop,
                    exact: time,
                    discretisation: arm * time,
                    slack: stop_time_slack(&run, deceleration * radius, time),
                },
                Quantity {
                    name: "angle turned",
                    unit: "rad",
                    measured: angles[angles.len() - 1],
                    exact: angle(time),
                    discretisation: 0.5 * spin * h + deceleration * h * h + arm * angle(time),
                    slack,
                },
                Quantity {
                    name: "way of the centre",
                    unit: "m",
                    measured: astray,
                    exact: 0.0,
                    discretisation: 0.0,
                    slack: run.position_slack(),
                },
            ],
            curve: Curve::of(("angle turned", "rad"), &run, |k| angles[k], angle),
        })
    }
}
