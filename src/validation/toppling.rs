//! What it takes to topple a tall box: a push, or a slope.

use super::rocking::{TallBox, tilt};
use super::stopping::resting;
use super::{Curve, Findings, Input, Inputs, Laboratory, Problem, Quantity, Setup, Unsuitable};
use crate::contact::plane::Plane;
use crate::mechanics::state::State;

/// A tall box pushed over its edge.
pub struct PushedOver;

/// A tall box on a slope that gets steeper.
pub struct SlopeTopple;

/// The threshold in `low`…`high` above which `topples` says yes, to ±`resolution` or a
/// little better, and the resolution reached.
fn bisect(
    (mut low, mut high): (f64, f64),
    resolution: f64,
    mut topples: impl FnMut(f64) -> Result<bool, Unsuitable>,
) -> Result<(f64, f64), Unsuitable> {
    while 0.5 * (high - low) > resolution {
        let middle = 0.5 * (low + high);
        if topples(middle)? {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok((0.5 * (low + high), 0.5 * (high - low)))
}

impl Problem for PushedOver {
    fn name(&self) -> &'static str {
        "pushed-over"
    }

    fn about(&self) -> &'static str {
        "A tall box turns about an edge: it topples if its spin is more than \
         √(2 m g (R − c)/I), and falls back if it is less."
    }

    fn inputs(&self) -> Inputs {
        Inputs::new(0.001, &[(Input::Mass, 3.0), (Input::Gravity, 9.81)])
    }

    /// The energy ½ I ω² must lift the centre by R − c. The threshold is found between 0.8
    /// and 1.2 of that spin. The step's spin lags by up to a step of deceleration, m g a h/I.
    fn solve(
        &self,
        inputs: &Inputs,
        laboratory: &mut Laboratory<'_>,
    ) -> Result<Findings, Unsuitable> {
        let tall = TallBox::new(inputs)?;
        let (critical, balance) = (tall.critical_spin(), tall.balance());
        let (mut slack, mut curve) = (0.0_f64, None);
        let lag = tall.deceleration() * laboratory.time_step();
        let bracket = (0.8 * critical, 1.2 * critical);
        let (measured, resolution) = bisect(bracket, 0.1 * lag, |spin| {
            let setup = tall.setup(tall.pushed(spin), 20.0 * tall.growth_time())?;
            // Past the balance, or on the way back.
            let decided = |state: &State| tilt(state) > balance || state.spin[1] < 0.0;
            let run = laboratory.run_until(&setup, &decided)?;
            slack = slack.max(run.velocity_slack() / tall.radius());
            let over = tilt(run.end()) > balance;
            curve = Some(Curve::of(
                ("tilt near the threshold", "rad"),
                &run,
                |k| tilt(&run.states[k]),
                |_| balance,
            ));
            Ok(over)
        })?;
        Ok(Findings {
            quantities: vec![Quantity {
                name: "spin that topples",
                unit: "rad/s",
                measured,
                exact: critical,
                discretisation: lag + resolution,
                slack,
            }],
            curve: curve.unwrap_or_default(),
        })
    }
}

impl Problem for SlopeTopple {
    fn name(&self) -> &'static str {
        "slope-topple"
    }

    fn about(&self) -> &'static str {
        "A tall box stands on a slope with friction enough: it topples where the slope is \
         steeper than a/c, its half width over its half height."
    }

    fn inputs(&self) -> Inputs {
        Inputs::new(0.002, &[(Input::Mass, 3.0), (Input::Gravity, 9.81)])
    }

    /// Gravity passes through the lower edge at tan θ = a/c. A box that is at rest is exactly
    /// at rest, so that the step adds no error; the threshold is looked for within a degree.
    ///
    /// A box that stands δ below the threshold and is set turning with the spin ω falls back
    /// if ½ I ω² < ½ m g R δ²: spins of c/R, which certificates allow, excuse δ = τ c/R with
    /// τ² = I/(m g R).
    fn solve(
        &self,
        inputs: &Inputs,
        laboratory: &mut Laboratory<'_>,
    ) -> Result<Findings, Unsuitable> {
        let tall = TallBox::new(inputs)?;
        let balance = tall.balance();
        let (mut slack, mut curve) = (0.0_f64, None);
        let degree = 1.0_f64.to_radians();
        let bracket = (balance - degree, balance + degree);
        let (measured, resolution) = bisect(bracket, 0.005 * degree, |slope| {
            // A tilt of 1e-5 rad, less than the resolution, grows to 0.1 in this time.
            let duration = 10.0 * tall.growth_time();
            let setup = Setup {
                plane: Plane::sloping(slope.to_degrees())?,
                ..tall.setup(resting(tall.half_sides[2]), duration)?
            };
            let run = laboratory.run_until(&setup, &|state| tilt(state) > 0.1)?;
            slack = slack.max(tall.growth_time() * run.velocity_slack() / tall.radius());
            curve = Some(Curve::of(
                ("tilt near the threshold", "rad"),
                &run,
                |k| tilt(&run.states[k]),
                |_| f64::NAN,
            ));
            Ok(tilt(run.end()) > 0.05)
        })?;
        Ok(Findings {
            quantities: vec![Quantity {
                name: "slope that topples",
                unit: "rad",
                measured,
                exact: balance,
                discretisation: resolution,
                slack,
            }],
            curve: curve.unwrap_or_default(),
        })
    }
}
