//! Scalar result of a run and its derivatives.

use super::argument::Argument;
use super::joint::JointQuantity;
use crate::args::GradientQuantity;
use crate::outcome::Failure;
use nalgebra::Vector3;
use serde::Serialize;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::derivative::StateChange;
use tumble_core::error::Error;
use tumble_core::mechanics::{RigidBody, State, Wrench};
use tumble_core::simulation::{Checkpoints, Run, RunGradient, Simulation, StepRecord};
use tumble_core::solver::native::Smoothing;
use tumble_core::step::StepStatus;
use tumble_core::world::Constant;
use tumble_scene::label::label;
use tumble_scene::scene::Scene;

/// One derivative.
#[derive(Debug, Serialize)]
pub struct GradientRow {
    pub argument: &'static str,
    /// Index of the argument's number.
    pub component: usize,
    /// Owner or axis of the number.
    pub part: String,
    pub unit: &'static str,
    pub derivative: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub difference: Option<f64>,
}

/// Reason for an early end.
pub enum GradientStop {
    Interrupted,
    Failed(Failure),
}

impl From<Error> for GradientStop {
    fn from(error: Error) -> Self {
        match error {
            Error::Interrupted => Self::Interrupted,
            other => Self::Failed(Failure::Input(other.to_string())),
        }
    }
}

impl From<Failure> for GradientStop {
    fn from(failure: Failure) -> Self {
        Self::Failed(failure)
    }
}

/// Scalar result of a scene's run.
#[derive(Clone, Copy)]
pub struct Task<'a> {
    pub scene: &'a Scene,
    pub body: usize,
    pub of: GradientQuantity,
    /// Joint of a coordinate or rate.
    pub joint: Option<JointQuantity>,
    pub smoothing: Option<Smoothing>,
    pub interrupt: &'a Arc<AtomicBool>,
}

/// Value, diagnostics of the run, and derivatives.
pub type GradientResult = (f64, RunGradient, Vec<GradientRow>);

impl Task<'_> {
    /// Derivatives with respect to `arguments`, with central differences of size `by` if it is set.
    pub fn derivatives(
        &self,
        arguments: &[Argument],
        by: Option<f64>,
    ) -> Result<GradientResult, GradientStop> {
        let steps = self.scene.rows - 1;
        let constants: Vec<Constant> = arguments.iter().filter_map(Argument::constant).collect();
        if let Some(none) = constants.iter().find(|of| of.width(&self.scene.world) == 0) {
            let why = "has no such constant; leave it out";
            return Err(Failure::Input(format!("{}: the scene {why}", none.name())).into());
        }
        let mut simulation = self.scene.simulation(self.interrupt)?;
        let start = simulation.states().to_vec();
        let mut before = |_: &mut Simulation<'_>| Ok(());
        let mut by_states =
            |k: u64, states: &[State]| (k == steps).then(|| self.slopes(&start, states));
        let mut run = Run {
            steps,
            before: &mut before,
            by_states: &mut by_states,
            constants: &constants,
            inputs: &[],
            checkpoints: Checkpoints::default(),
            smoothing: self.smoothing,
        };
        let mut found = simulation.gradient(&mut run)?;
        // The distance also depends directly on the start.
        let back = self.slope_by_start(&start[self.body], &simulation.states()[self.body]);
        found.states[self.body] = found.states[self.body].plus(1.0, &back);
        let value = self.value(&start, &simulation);
        let mut rows = Vec::new();
        for argument in arguments {
            let numbers = self.numbers(argument, &found, &constants);
            for (component, derivative) in numbers.into_iter().enumerate() {
                let difference =
                    by.map(|by| self.difference(argument, component, by)).transpose()?;
                let (name, unit) = (argument.name(), argument.unit());
                let part = match argument.constant() {
                    Some(constant) => label(self.scene, constant, component),
                    None => ["x", "y", "z"][component].to_owned(),
                };
                rows.push(GradientRow {
                    argument: name,
                    component,
                    part,
                    unit,
                    derivative,
                    difference,
                });
            }
        }
        Ok((value, found, rows))
    }

    /// Derivatives with respect to an argument.
    fn numbers(
        &self,
        argument: &Argument,
        found: &RunGradient,
        constants: &[Constant],
    ) -> Vec<f64> {
        match *argument {
            Argument::Start(.., from) => {
                found.states[self.body].to_array()[from..from + 3].to_vec()
            }
            Argument::Push(.., from) => {
                let each = found.wrenches.iter().map(|wrenches| &wrenches[self.body]);
                let sum = each.fold(Wrench::zero(), |sum, wrench| sum.plus(wrench));
                if from == 0 {
                    sum.force.as_slice().to_vec()
                } else {
                    sum.torque.as_slice().to_vec()
                }
            }
            Argument::Constant(constant) => {
                let place = constants.iter().position(|known| *known == constant);
                let numbers = place.map_or(Vec::new(), |place| found.constants[place].clone());
                match constant {
                    Constant::Inertia => symmetric(&numbers),
                    _ => numbers,
                }
            }
        }
    }

    /// Central difference for one number of an argument. At the end of its range, the one-sided
    /// difference of the same order: (4 f(x + d) − f(x + 2d) − 3 f(x)) / 2d.
    fn difference(
        &self,
        argument: &Argument,
        component: usize,
        by: f64,
    ) -> Result<f64, GradientStop> {
        let ends = |by: f64| self.shifted(argument, component, by).is_err();
        if let Some(by) = [by, -by].into_iter().find(|by| ends(-by) && !ends(*by)) {
            let at = |times: f64| self.moved(argument, component, times * by);
            return Ok((4.0 * at(1.0)? - at(2.0)? - 3.0 * at(0.0)?) / (2.0 * by));
        }
        let apart = self.moved(argument, component, by)? - self.moved(argument, component, -by)?;
        Ok(apart / (2.0 * by))
    }

    /// Value of the result with one number of an argument increased by `by`.
    fn moved(&self, argument: &Argument, component: usize, by: f64) -> Result<f64, GradientStop> {
        let (scene, push) = self.shifted(argument, component, by)?;
        let mut simulation = scene.simulation(self.interrupt)?;
        simulation.set_wrench(self.body, push)?;
        let start = simulation.states().to_vec();
        let mut record = StepRecord::new();
        for _ in 0..scene.rows - 1 {
            simulation.step(&mut record)?;
            if record.report.status == StepStatus::Failed {
                break;
            }
        }
        Ok(self.value(&start, &simulation))
    }

    /// Scene and wrench with one number of an argument increased by `by`.
    fn shifted(
        &self,
        argument: &Argument,
        component: usize,
        by: f64,
    ) -> Result<(Scene, Wrench), GradientStop> {
        let (mut scene, mut push) = (self.scene.clone(), Wrench::zero());
        match *argument {
            Argument::Start(.., from) => {
                let mut change = [0.0; StateChange::LEN];
                change[from + component] = by;
                let start = &mut scene.starts[self.body];
                *start = StateChange::from_array(&change).applied(start);
            }
            Argument::Push(.., 0) => push.force[component] += by,
            Argument::Push(..) => push.torque[component] += by,
            Argument::Constant(constant) => {
                let mut numbers = constant.of(&scene.world);
                if constant == Constant::Inertia {
                    numbers[component] += 0.5 * by;
                    numbers[transposed(component)] += 0.5 * by;
                } else {
                    numbers[component] += by;
                }
                scene.world = scene.world.with_constants(&[(constant, &numbers)])?;
            }
        }
        Ok((scene, push))
    }

    fn mechanics(&self) -> &RigidBody {
        &self.scene.world.bodies()[self.body]
    }

    /// Value at the end of a simulation from the states `start`.
    fn value(&self, start: &[State], simulation: &Simulation<'_>) -> f64 {
        let (world, end) = (simulation.world(), simulation.states());
        if let Some(joint) = &self.joint {
            let near = simulation.joint_angles().nth(joint.joint()).copied().unwrap_or_default();
            return match self.of {
                GradientQuantity::Rate => joint.rate(world, end),
                _ => joint.coordinate(world, end, &near),
            };
        }
        self.body_value(&start[self.body], &end[self.body])
    }

    fn body_value(&self, start: &State, end: &State) -> f64 {
        let (r, v) = (&end.position, &end.velocity);
        match self.of {
            GradientQuantity::X => r[0],
            GradientQuantity::Y => r[1],
            GradientQuantity::Z => r[2],
            GradientQuantity::Vx => v[0],
            GradientQuantity::Vy => v[1],
            GradientQuantity::Vz => v[2],
            GradientQuantity::Speed => v.norm(),
            GradientQuantity::Distance => (r - start.position).norm(),
            GradientQuantity::Wx => end.spin[0],
            GradientQuantity::Wy => end.spin[1],
            GradientQuantity::Wz => end.spin[2],
            // Quantities of joints are not of a body.
            GradientQuantity::Coordinate | GradientQuantity::Rate => f64::NAN,
            GradientQuantity::KineticEnergy => {
                let body = self.mechanics();
                let turning = end.spin.dot(&(body.inertia() * end.spin));
                0.5 * (body.mass() * v.norm_squared() + turning)
            }
        }
    }

    /// Derivatives with respect to the end states.
    fn slopes(&self, start: &[State], end: &[State]) -> Vec<StateChange> {
        match (&self.joint, self.of) {
            (Some(joint), GradientQuantity::Rate) => joint.rate_slope(&self.scene.world, end),
            (Some(joint), _) => joint.coordinate_slope(&self.scene.world, end),
            (None, _) => {
                let mut all = vec![StateChange::zero(); end.len()];
                all[self.body] = self.slope(&start[self.body], &end[self.body]);
                all
            }
        }
    }

    /// Derivatives with respect to the body's end state.
    fn slope(&self, start: &State, end: &State) -> StateChange {
        let zero = StateChange::zero();
        let (position, velocity) = (end.position - start.position, end.velocity);
        let unit = |v: Vector3<f64>| v.try_normalize(0.0).unwrap_or_default();
        match self.of {
            GradientQuantity::X | GradientQuantity::Y | GradientQuantity::Z => {
                StateChange { position: Vector3::ith(self.of as usize, 1.0), ..zero }
            }
            GradientQuantity::Vx | GradientQuantity::Vy | GradientQuantity::Vz => {
                StateChange { velocity: Vector3::ith(self.of as usize - 3, 1.0), ..zero }
            }
            GradientQuantity::Speed => StateChange { velocity: unit(velocity), ..zero },
            GradientQuantity::Distance => StateChange { position: unit(position), ..zero },
            GradientQuantity::Wx | GradientQuantity::Wy | GradientQuantity::Wz => {
                let axis = self.of as usize - GradientQuantity::Wx as usize;
                StateChange { spin: Vector3::ith(axis, 1.0), ..zero }
            }
            GradientQuantity::Coordinate | GradientQuantity::Rate => zero,
            GradientQuantity::KineticEnergy => {
                let body = self.mechanics();
                let spin = body.inertia() * end.spin;
                StateChange { velocity: velocity * body.mass(), spin, ..zero }
            }
        }
    }

    /// Direct derivatives with respect to the start, without those through the end state.
    fn slope_by_start(&self, start: &State, end: &State) -> StateChange {
        match self.of {
            GradientQuantity::Distance => StateChange::zero().plus(-1.0, &self.slope(start, end)),
            _ => StateChange::zero(),
        }
    }
}

/// Index of the transposed entry in a list of 3 × 3 matrices.
fn transposed(entry: usize) -> usize {
    let (matrix, row, column) = (entry / 9, entry % 9 / 3, entry % 3);
    9 * matrix + 3 * column + row
}

/// Derivatives with respect to symmetric matrices: the mean of both entries, which change together.
fn symmetric(numbers: &[f64]) -> Vec<f64> {
    (0..numbers.len()).map(|entry| 0.5 * (numbers[entry] + numbers[transposed(entry)])).collect()
}
