//! The energy of a cube thrown on the ground.

use super::{
    Curve, Findings, Input, Inputs, Laboratory, Problem, Quantity, Run, Setup, Unsuitable,
};
use crate::contact::plane::Plane;
use crate::mechanics::body::RigidBody;
use crate::mechanics::load::Load;
use crate::mechanics::state::State;
use crate::simulation::random::random_attitude;
use nalgebra::Vector3;

/// A thrown cube, until it rests.
pub struct Tumble;

/// m.
const HALF_SIDE: f64 = 1.0;

/// What the last step's certificate c excuses at rest, J: a height off by c h and a speed of
/// c, so that m g c h + m c².
fn excused_at_rest(run: &Run, mass: f64, gravity: f64) -> f64 {
    let c = run.certificates.last().copied().unwrap_or(0.0);
    mass * gravity * c * run.time_step + mass * c * c
}

impl Problem for Tumble {
    fn name(&self) -> &'static str {
        "tumble"
    }

    fn about(&self) -> &'static str {
        "A cube is thrown on the ground and tumbles to rest: no step adds energy, and at the end \
         there is left what a cube at rest on a face has."
    }

    fn inputs(&self) -> Inputs {
        let (mass, friction) = ((Input::Mass, 10.0), (Input::Friction, 0.3));
        let values = [mass, friction, (Input::Gravity, 9.81), (Input::Speed, 4.0)];
        Inputs::new(0.002, &values)
    }

    /// Contact forces of an inelastic impact and friction do no work: E = ½ m v² + ½ ωᵀ I ω +
    /// m g z never grows, and ends as m g a with the cube on a face.
    fn solve(
        &self,
        inputs: &Inputs,
        laboratory: &mut Laboratory<'_>,
    ) -> Result<Findings, Unsuitable> {
        let (mass, g) = (inputs.get(Input::Mass)?, inputs.get(Input::Gravity)?);
        let (friction, speed) = (inputs.get(Input::Friction)?, inputs.get(Input::Speed)?);
        let body = RigidBody::solid_box(mass, Vector3::repeat(HALF_SIDE))?;
        let inertia = *body.inertia();
        let start = State {
            position: Vector3::new(0.0, 0.0, 2.5),
            attitude: random_attitude(42),
            velocity: Vector3::new(0.0, speed, 0.0),
            spin: Vector3::new(0.0, -2.0, 1.0),
        };
        let run = laboratory.run(&Setup {
            body,
            plane: Plane::level(),
            gravity: g,
            friction,
            start,
            load: Load::none(),
            // Falls and rolls over, each of the time a fall takes, flights with all the speed
            // upwards, and a slide of all it has.
            duration: 10.0 * (2.0 * HALF_SIDE / g).sqrt()
                + 4.0 * (speed + 3.0) / g
                + 2.0 * (speed + 3.0) / (friction * g),
        })?;
        let energy = |state: &State| {
            let turning = 0.5 * state.spin.dot(&(inertia * state.spin));
            0.5 * mass * state.velocity.norm_squared() + turning + mass * g * state.position[2]
        };
        let gains = run.states.windows(2).map(|pair| energy(&pair[1]) - energy(&pair[0]));
        let largest = gains.fold(0.0, f64::max);
        // A step off by c in velocity is off by m v c in energy.
        let fastest = |state: &State| state.velocity.norm() + 2.0 * state.spin.norm();
        let excused =
            |(pair, c): (&[State], &f64)| mass * fastest(&pair[0]).max(fastest(&pair[1])) * c;
        let excused = run.states.windows(2).zip(&run.certificates).map(excused);
        let slack = excused.fold(1e-12 * energy(&start), f64::max);
        Ok(Findings {
            quantities: vec![
                Quantity {
                    name: "largest gain of a step",
                    unit: "J",
                    measured: largest,
                    exact: 0.0,
                    discretisation: 0.0,
                    slack,
                },
                Quantity {
                    name: "energy at the end",
                    unit: "J",
                    measured: energy(run.end()),
                    exact: mass * g * HALF_SIDE,
                    discretisation: 0.0,
                    // At rest: its height, and the speed of the last step.
                    slack: mass * g * 1e-11 + excused_at_rest(&run, mass, g),
                },
            ],
            curve: Curve::of(("energy", "J"), &run, |k| energy(&run.states[k]), |_| f64::NAN),
        })
    }
}
