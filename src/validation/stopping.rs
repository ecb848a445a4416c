//! Bodies that slide on level ground until friction stops them.

use super::{
    Curve, Findings, Input, Inputs, Laboratory, Problem, Quantity, Run, Setup, Unsuitable,
};
use crate::contact::plane::Plane;
use crate::mechanics::body::RigidBody;
use crate::mechanics::load::Load;
use crate::mechanics::quaternion::rotation;
use crate::mechanics::state::State;
use nalgebra::{Vector3, Vector4};

/// A box that slides until it stops.
pub struct SlidingStop;

/// A thin plate that slides fast: nothing may lift it.
pub struct FastPlate;

/// At rest, upright, the centre at `height` (m).
pub(super) fn resting(height: f64) -> State {
    State {
        position: Vector3::new(0.0, 0.0, height),
        attitude: Vector4::new(1.0, 0.0, 0.0, 0.0),
        velocity: Vector3::zeros(),
        spin: Vector3::zeros(),
    }
}

/// A slide on level ground along a direction.
pub(super) struct Slide {
    pub half_sides: Vector3<f64>,
    pub mass: f64,
    pub friction: f64,
    pub gravity: f64,
    /// At the start, m/s.
    pub velocity: Vector3<f64>,
}

impl Slide {
    /// The inputs of a slide along x.
    pub fn along_x(half_sides: Vector3<f64>, inputs: &Inputs) -> Result<Self, Unsuitable> {
        Ok(Self {
            half_sides,
            mass: inputs.get(Input::Mass)?,
            friction: inputs.get(Input::Friction)?,
            gravity: inputs.get(Input::Gravity)?,
            velocity: Vector3::new(inputs.get(Input::Speed)?, 0.0, 0.0),
        })
    }

    /// v²/(2 μ g): the stopping distance, m.
    pub fn distance(&self) -> f64 {
        self.velocity.norm_squared() / (2.0 * self.friction * self.gravity)
    }

    /// v/(μ g): the stopping time, s.
    pub fn time(&self) -> f64 {
        self.velocity.norm() / (self.friction * self.gravity)
    }

    /// How far the step's stopping distance is from v²/(2 μ g), m: the step moves with the
    /// velocity at its end, which shortens the way by ½ v h, and stops within a step.
    pub fn distance_error(&self, h: f64) -> f64 {
        0.5 * self.velocity.norm() * h + self.friction * self.gravity * h * h
    }

    /// The run, a quarter longer than the slide.
    ///
    /// The box must not tip: friction acts μ m g at the bottom and shifts the ground's force
    /// forwards by μ c, with c half the height; it must stay under the face. In any direction
    /// that is μ c less than the shorter half side.
    pub fn run(&self, laboratory: &mut Laboratory<'_>) -> Result<Run, Unsuitable> {
        let foot = self.half_sides[0].min(self.half_sides[1]);
        if self.friction * self.half_sides[2] >= 0.95 * foot {
            return Err(Unsuitable::Motion(format!(
                "with mu {} the box tips instead of sliding; below {:.2} is needed",
                self.friction,
                0.95 * foot / self.half_sides[2]
            )));
        }
        let mut start = resting(self.half_sides[2]);
        start.velocity = self.velocity;
        let duration = 1.25 * self.time() + 4.0 * laboratory.time_step();
        laboratory.run(&Setup {
            body: RigidBody::solid_box(self.mass, self.half_sides)?,
            plane: Plane::level(),
            gravity: self.gravity,
            friction: self.friction,
            start,
            load: Load::none(),
            duration,
        })
    }

    /// x(t) = v t − ½ μ g t² until the stop, m.
    pub fn way(&self, t: f64) -> f64 {
        let t = t.min(self.time());
        self.velocity.norm() * t - 0.5 * self.friction * self.gravity * t * t
    }
}

impl Problem for SlidingStop {
    fn name(&self) -> &'static str {
        "sliding-stop"
    }

    fn about(&self) -> &'static str {
        "A box slides on level ground until friction stops it, after v²/(2 μ g) and v/(μ g)."
    }

    fn inputs(&self) -> Inputs {
        let (mass, friction) = ((Input::Mass, 2.0), (Input::Friction, 0.3));
        let values = [mass, friction, (Input::Gravity, 9.81), (Input::Speed, 3.0)];
        Inputs::new(0.002, &values)
    }

    /// v(t) = v − μ g t: the stop is after v/(μ g) and v²/(2 μ g). Velocities of the step are
    /// exact, and with them the time at which their line reaches zero.
    fn solve(
        &self,
        inputs: &Inputs,
        laboratory: &mut Laboratory<'_>,
    ) -> Result<Findings, Unsuitable> {
        let slide = Slide::along_x(Vector3::new(0.2, 0.15, 0.1), inputs)?;
        let run = slide.run(laboratory)?;
        let h = run.time_step;
        let deceleration = slide.friction * slide.gravity;
        let time = run.stop_time(|state| state.velocity.norm());
        Ok(Findings {
            quantities: vec![
                Quantity {
                    name: "stopping distance",
                    unit: "m",
                    measured: run.end().position[0],
                    exact: slide.distance(),
                    discretisation: slide.distance_error(h),
                    slack: run.position_slack(),
                },
                Quantity {
                    name: "stopping time",
                    unit: "s",
                    measured: time.unwrap_or(f64::NAN),
                    exact: slide.time(),
                    discretisation: 0.0,
                    // Two velocities half a per cent of the slide apart, or one step, give
                    // the line its slope.
                    slack: stop_time_slack(&run, deceleration, slide.time()),
                },
                Quantity {
                    name: "speed at the end",
                    unit: "m/s",
                    measured: run.end().velocity.norm(),
                    exact: 0.0,
                    discretisation: 0.0,
                    slack: run.velocity_slack(),
                },
            ],
            curve: Curve::of(("way", "m"), &run, |k| run.states[k].position[0], |t| slide.way(t)),
        })
    }
}

/// How far a stop time from a line through two velocities may be off, s, when the velocities
/// are off by the certificates: the level by their sum, the slope by two of them, over what
/// is left of the way to zero, a hundredth of the time or a step.
pub(super) fn stop_time_slack(run: &Run, deceleration: f64, time: f64) -> f64 {
    let level = run.velocity_slack() / deceleration;
    let largest = run.certificates.iter().fold(1e-13, |a: f64, b| a.max(*b));
    let slope = 2.0 * largest / (deceleration * run.time_step);
    level + slope * (0.01 * time + run.time_step)
}

impl Problem for FastPlate {
    fn name(&self) -> &'static str {
        "fast-plate"
    }

    fn about(&self) -> &'static str {
        "A thin plate slides fast and stops: no corner of its face leaves the ground or sinks \
         into it, and it goes straight."
    }

    fn inputs(&self) -> Inputs {
        let (mass, friction) = ((Input::Mass, 1.0), (Input::Friction, 0.3));
        let values = [mass, friction, (Input::Gravity, 9.81), (Input::Speed, 10.0)];
        Inputs::new(0.002, &values)
    }

    /// The lower face stays in the plane: z = 0 for its four corners at all times.
    fn solve(
        &self,
        inputs: &Inputs,
        laboratory: &mut Laboratory<'_>,
    ) -> Result<Findings, Unsuitable> {
        let half_sides = Vector3::new(0.5, 0.5, 0.025);
        let slide = Slide::along_x(half_sides, inputs)?;
        let run = slide.run(laboratory)?;
        let bottom = |state: &State| {
            let down = rotation(&state.attitude);
            let corner = |x: f64, y: f64| {
                let c = Vector3::new(x * half_sides[0], y * half_sides[1], -half_sides[2]);
                (state.position + down * c)[2]
            };
            [corner(-1.0, -1.0), corner(1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)]
        };
        let heights: Vec<_> = run.states.iter().map(bottom).collect();
        let highest = heights.iter().flatten().fold(0.0_f64, |a, &b| a.max(b));
        let lowest = heights.iter().flatten().fold(0.0_f64, |a, &b| a.min(b));
        let astray = run.states.iter().map(|state| state.position[1].abs()).fold(0.0, f64::max);
        let exact = |name: &'static str, measured: f64| Quantity {
            name,
            unit: "m",
            measured,
            exact: 0.0,
            discretisation: 0.0,
            slack: run.position_slack(),
        };
        Ok(Findings {
            quantities: vec![
                exact("lift-off", highest),
                exact("penetration", -lowest),
                exact("way sideways", astray),
                Quantity {
                    name: "stopping distance",
                    unit: "m",
                    measured: run.end().position[0],
                    exact: slide.distance(),
                    discretisation: slide.distance_error(run.time_step),
                    slack: run.position_slack(),
                },
            ],
            curve: Curve::of(("way", "m"), &run, |k| run.states[k].position[0], |t| slide.way(t)),
        })
    }
}
