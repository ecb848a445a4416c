//! A tall box that is tilted over an edge and falls back.

use super::stopping::resting;
use super::{Curve, Findings, Input, Inputs, Laboratory, Problem, Quantity, Setup, Unsuitable};
use crate::contact::plane::Plane;
use crate::mechanics::body::RigidBody;
use crate::mechanics::load::Load;
use crate::mechanics::state::State;
use nalgebra::Vector3;

/// A tall box on its edge.
pub struct Rocking;

/// A tall box, a to the edge and c to the top, that turns about the edge x = a.
pub(super) struct TallBox {
    pub half_sides: Vector3<f64>,
    pub mass: f64,
    pub gravity: f64,
}

impl TallBox {
    pub fn new(inputs: &Inputs) -> Result<Self, Unsuitable> {
        Ok(Self {
            half_sides: Vector3::new(0.1, 0.1, 0.3),
            mass: inputs.get(Input::Mass)?,
            gravity: inputs.get(Input::Gravity)?,
        })
    }

    /// R = √(a² + c²): from the edge to the centre, m.
    pub fn radius(&self) -> f64 {
        self.half_sides[0].hypot(self.half_sides[2])
    }

    /// α = atan(a/c): the tilt at which the centre is above the edge, rad.
    pub fn balance(&self) -> f64 {
        self.half_sides[0].atan2(self.half_sides[2])
    }

    /// I = ⁴⁄₃ m R²: the inertia about the edge, kg m².
    pub fn inertia(&self) -> f64 {
        4.0 / 3.0 * self.mass * self.radius().powi(2)
    }

    /// √(2 m g (R − c)/I): the spin that just reaches the balance, rad/s, from the energy
    /// ½ I ω² = m g (R − c).
    pub fn critical_spin(&self) -> f64 {
        let rise = self.radius() - self.half_sides[2];
        (2.0 * self.mass * self.gravity * rise / self.inertia()).sqrt()
    }

    /// √(I/(m g R)): the time in which a tilt from the balance grows e-fold, s.
    pub fn growth_time(&self) -> f64 {
        (self.inertia() / (self.mass * self.gravity * self.radius())).sqrt()
    }

    /// m g a/I: how fast gravity slows the tilt at its start, rad/s².
    pub fn deceleration(&self) -> f64 {
        self.mass * self.gravity * self.half_sides[0] / self.inertia()
    }

    /// Upright and turning about the edge with `spin`.
    pub fn pushed(&self, spin: f64) -> State {
        let mut start = resting(self.half_sides[2]);
        start.spin = Vector3::new(0.0, spin, 0.0);
        // v = ω × (r − p) with r − p = (−a, 0, c).
        start.velocity = Vector3::new(spin * self.half_sides[2], 0.0, spin * self.half_sides[0]);
        start
    }

    /// Friction enough for the edge not to slip, and as long as the motion takes.
    pub fn setup(&self, start: State, duration: f64) -> Result<Setup, Unsuitable> {
        Ok(Setup {
            body: RigidBody::solid_box(self.mass, self.half_sides)?,
            plane: Plane::level(),
            gravity: self.gravity,
            friction: 1.0,
            start,
            load: Load::none(),
            duration,
        })
    }
}

/// The tilt about the y axis, rad.
pub(super) fn tilt(state: &State) -> f64 {
    2.0 * state.attitude[2].atan2(state.attitude[0])
}

impl Problem for Rocking {
    fn name(&self) -> &'static str {
        "rocking"
    }

    fn about(&self) -> &'static str {
        "A tall box turns about an edge with a share (speed) of the spin that would topple it, \
         rises as far as its energy goes, falls back, and keeps 1 − ³⁄₂ sin²α of its spin when \
         its face meets the ground."
    }

    fn inputs(&self) -> Inputs {
        let values = [(Input::Mass, 3.0), (Input::Gravity, 9.81), (Input::Speed, 0.9)];
        Inputs::new(0.001, &values)
    }

    fn unit(&self, input: Input) -> &'static str {
        if input == Input::Speed { "of the spin that topples it" } else { input.unit() }
    }

    /// About the edge the energy ½ I ω² + m g R cos(α − φ) stays, up to the peak φ:
    ///
    /// ```text
    /// R cos(α − φ) = c + I ω²/(2 m g)
    /// ```
    ///
    /// When the face meets the ground again the box goes on about the other edge, whose
    /// angular momentum the impact keeps (Housner 1963): ω⁺ = (1 − ³⁄₂ sin²α) ω⁻.
    ///
    /// The step's spin lags by up to a step of deceleration, m g a h/I, which the peak feels
    /// as δφ = I ω δω/(m g R sin(α − φ)); the spins about the impact are those of whole
    /// steps, up to two from it.
    fn solve(
        &self,
        inputs: &Inputs,
        laboratory: &mut Laboratory<'_>,
    ) -> Result<Findings, Unsuitable> {
        let tall = TallBox::new(inputs)?;
        let share = inputs.get(Input::Speed)?;
        if !(0.3..=0.98).contains(&share) {
            return Err(Unsuitable::Motion(format!(
                "speed is {share}, a share of the spin that topples the box; 0.3 to 0.98 is needed"
            )));
        }
        let spin = share * tall.critical_spin();
        let setup = tall.setup(tall.pushed(spin), 15.0 * tall.growth_time())?;
        // A little longer than until the face meets the ground.
        let run = laboratory.run_until(&setup, &|state| tilt(state) < -0.1 * tall.balance())?;

        let (h, alpha, radius) = (run.time_step, tall.balance(), tall.radius());
        let moment = tall.mass * tall.gravity * radius;
        let rise = tall.half_sides[2] + 0.5 * tall.inertia() * spin * spin / (moment / radius);
        let peak = alpha - (rise / radius).acos();
        let lag = tall.deceleration() * h;
        let sensitivity = tall.inertia() * spin / (moment * (alpha - peak).sin());
        let highest = run.states.iter().map(tilt).fold(0.0, f64::max);

        // The fall back is the fastest just before the face meets the ground.
        let spins: Vec<f64> = run.states.iter().map(|state| -state.spin[1]).collect();
        let back = run.states.iter().position(|state| state.spin[1] < 0.0 && tilt(state) <= 0.0);
        let (before, after) = back.map_or((f64::NAN, f64::NAN), |k| {
            let near = |from: usize, to: usize| {
                spins[from..to.min(spins.len())].iter().copied().fold(f64::NAN, f64::max)
            };
            (near(k.saturating_sub(4), k), spins.get(k + 1).copied().unwrap_or(f64::NAN))
        });
        let kept = 1.0 - 1.5 * alpha.sin().powi(2);
        Ok(Findings {
            quantities: vec![
                Quantity {
                    name: "peak tilt",
                    unit: "rad",
                    measured: highest,
                    exact: peak,
                    discretisation: sensitivity * lag,
                    slack: sensitivity * run.velocity_slack() / radius,
                },
                Quantity {
                    name: "spin kept at impact",
                    unit: "1",
                    measured: after / before,
                    exact: kept,
                    discretisation: 2.0 * lag / before,
                    slack: run.velocity_slack() / (radius * before),
                },
            ],
            curve: Curve::of(("tilt", "rad"), &run, |k| tilt(&run.states[k]), |_| f64::NAN),
        })
    }
}
