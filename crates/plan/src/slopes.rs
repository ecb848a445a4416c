//! Rows of a run and their derivatives by the controls.
//!
//! The rows of (P1), times the roots of their weights, depend on the controls through every step.
//! The backward pass uses the derivatives of a step by states, wrenches and constants
//! (`docs/gradients.md`). It also uses the derivatives of the wrenches by states and controls:
//!
//! ```text
//! λ_N = ∂ρ/∂X_N,   λ_k = ∂ρ/∂X_k + S_Xᵀ λ_{k+1} + W_Xᵀ S_Wᵀ λ_{k+1},   ∂ρ/∂u = Σ_k W_uᵀ S_Wᵀ λ_{k+1}   (P4)
//! ```
//!
//! Each row takes one backward pass over the steps, which are linearised once. If a step has no derivative, all derivatives
//! are central differences of two runs for each variable.

use super::control::ControlKind;
use super::problem::motor_wrenches;
use super::{PlanError, PlanProblem};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::derivative::StateChange;
use tumble_core::error::Error;
use tumble_core::joint::{Joint, JointAxis};
use tumble_core::mechanics::quaternion::rotation;
use tumble_core::mechanics::{State, Wrench};
use tumble_core::solver::native::{StepDerivative, StepGradient};
use tumble_core::world::Constant;

/// A residual of a run that the cost has squared.
#[derive(Debug, Clone, Copy)]
pub(super) enum RowOf {
    /// A target, by its index, and one of its rows.
    Target(usize, usize),
    /// A path constraint, by its index, that is violated after this number of steps.
    PathConstraint(usize, usize),
}

/// Rows of a run and their derivatives.
pub(super) struct RunSlopes {
    /// Rows, times the roots of their weights.
    pub rows: DVector<f64>,
    /// Derivatives, one column for each variable.
    pub by: DMatrix<f64>,
}

/// Difference relative to the bounds of a variable: the cube root of a step's error of 3e-11 m/s balances rounding and the
/// third-order error.
const DIFFERENCE: f64 = 3e-4;

/// Data of a step for the backward pass.
pub(super) struct Tape {
    derivative: StepDerivative,
    /// Wrenches that depend on controls or states: controls, both sides of motors, loads at a point.
    acting: Vec<Acting>,
}

/// Derivatives of a wrench on a body.
struct Acting {
    body: usize,
    /// Derivatives by variables.
    by: Vec<(usize, Wrench)>,
    /// Derivatives by the states at the start of the step.
    follows: Vec<WrenchSlope>,
}

/// Derivatives of a force and a torque by the place and turn of a body.
struct WrenchSlope {
    body: usize,
    by_place: [Matrix3<f64>; 2],
    by_turn: [Matrix3<f64>; 2],
}

impl PlanProblem {
    /// Rows of the run of `controls` and their derivatives, exact or by `differences`, with the number of runs.
    pub(super) fn slopes(
        &self,
        controls: &[f64],
        differences: bool,
        interrupt: &Arc<AtomicBool>,
    ) -> Result<(RunSlopes, u64), PlanError> {
        let mut tape = Vec::with_capacity(if differences { 0 } else { self.steps() });
        let mut take = |step| {
            tape.push(step);
            Ok(())
        };
        let like = (!differences).then(StepDerivative::new);
        let (states, all) = self.taped(controls, like, &mut take, interrupt)?;
        let rows = self.rows_of(&states);
        let values = self.values(&rows, &states);
        let mut by = DMatrix::zeros(rows.len(), controls.len());
        let refused = !all;
        if all {
            for (index, row) in rows.iter().enumerate() {
                let numbers = self.pulled(row, &states, &mut tape, controls)?;
                by.row_mut(index).copy_from(&numbers.transpose());
            }
        }
        let differenced = if refused { controls.len() } else { 0 };
        let columns = (0..differenced)
            .into_par_iter()
            .map(|index| self.differenced(index, &rows, controls, interrupt));
        for (index, column) in columns.collect::<Result<Vec<_>, PlanError>>()?.iter().enumerate() {
            by.set_column(index, column);
        }
        let runs = 1 + 2 * differenced as u64;
        Ok((RunSlopes { rows: values, by }, runs))
    }

    /// Runs `controls` and passes the data of each step for the backward pass to `take`, with derivatives of the kind of `like`.
    ///
    /// Returns the states, and whether `take` got every step. It does not without `like`, or after a step without such a
    /// derivative.
    pub(super) fn taped(
        &self,
        controls: &[f64],
        like: Option<StepDerivative>,
        take: &mut dyn FnMut(Tape) -> Result<(), PlanError>,
        interrupt: &Arc<AtomicBool>,
    ) -> Result<(Vec<Vec<State>>, bool), PlanError> {
        let mut states = vec![self.starts(controls)];
        let mut like = like;
        self.simulate(controls, Some(interrupt), &mut |simulation, _, record| {
            states.push(simulation.states().to_vec());
            let Some(mut derivative) = like.clone() else { return Ok(()) };
            match simulation.linearise(record, &mut derivative) {
                Ok(()) => {
                    take(self.tape(states.len() - 2, derivative, record.states(), controls))?;
                }
                Err(Error::Interrupted) => return Err(PlanError::Interrupted),
                Err(_) => like = None,
            }
            Ok(())
        })?;
        Ok((states, like.is_some()))
    }

    /// Rows of a run: all rows of the targets, and the violated path constraints.
    pub(super) fn rows_of(&self, states: &[Vec<State>]) -> Vec<RowOf> {
        let mut rows = Vec::new();
        for (index, target) in self.targets().iter().enumerate() {
            let count = target.kind.rows(&states[target.after][target.body]).len();
            rows.extend((0..count).map(|row| RowOf::Target(index, row)));
        }
        for (index, constraint) in self.path_constraints().iter().enumerate() {
            for (after, states) in states.iter().enumerate().skip(1) {
                if constraint.kind.at(&states[constraint.body].position).0 < 0.0 {
                    rows.push(RowOf::PathConstraint(index, after));
                }
            }
        }
        rows
    }

    /// Value, body, state and slope of a row.
    pub(super) fn row(
        &self,
        row: &RowOf,
        states: &[Vec<State>],
    ) -> (f64, usize, usize, StateChange) {
        match *row {
            RowOf::Target(index, row) => {
                let target = &self.targets()[index];
                let found = target.kind.rows(&states[target.after][target.body])[row];
                let root = target.weight.sqrt();
                let by = StateChange::zero().plus(root, &found.by);
                (root * found.value, target.body, target.after, by)
            }
            RowOf::PathConstraint(index, after) => {
                let constraint = &self.path_constraints()[index];
                let position = &states[after][constraint.body].position;
                let (value, slope) = constraint.kind.at(position);
                let root = constraint.weight.sqrt();
                let by = StateChange { position: slope * root, ..StateChange::zero() };
                (root * value, constraint.body, after, by)
            }
        }
    }

    fn values(&self, rows: &[RowOf], states: &[Vec<State>]) -> DVector<f64> {
        DVector::from_iterator(rows.len(), rows.iter().map(|row| self.row(row, states).0))
    }

    /// Collects the data of a step for the backward pass.
    fn tape(
        &self,
        step: usize,
        derivative: StepDerivative,
        states: &[State],
        controls: &[f64],
    ) -> Tape {
        let mut acting = Vec::new();
        let by_place = [Matrix3::zeros(); 2];
        for (index, control) in self.controls().iter().enumerate() {
            // Motors act along axes that move with both bodies.
            if let ControlKind::Motor { axes } = &control.kind {
                let (numbers, places) = self.numbers(index, self.knot(index, step), controls);
                for (joint, axis) in axes {
                    let of = &self.scene.world.joints()[*joint];
                    acting.extend(motor(of, states, *axis, numbers[0], places[0]));
                }
            }
            // Other controls act on one body, with a lever that turns with it.
            let Some(body) = control.kind.body() else { continue };
            let Some((applied, numbers, places)) = self.applied(index, step, controls) else {
                continue;
            };
            let slopes = control.kind.slopes(&numbers);
            let by = slopes.iter().zip(&places).filter_map(|(slope, place)| {
                place.map(|place| (place, slope.wrench(&states[body])))
            });
            let by_turn = applied.by_turn(&states[body]).into();
            let follows = vec![WrenchSlope { body, by_place, by_turn }];
            acting.push(Acting { body, by: by.collect(), follows });
        }
        // Loads at a point of their body turn with it too.
        let h = self.scene.world.time_step();
        let index = self.scene.start_index + step as u64;
        let loads = self.scene.loads.iter().zip(states).enumerate();
        let loads = loads.filter(|(_, (load, _))| load.point().amax() > 0.0 && !load.is_none());
        acting.extend(loads.map(|(body, (load, state))| {
            // τ = p × Aᵀ F (20), and Aᵀ F changes by (Aᵀ F) × δθ.
            let force = load.wrench(index, h, &state.attitude).force;
            let seen = rotation(&state.attitude).tr_mul(&force);
            let torque = load.point().cross_matrix() * seen.cross_matrix();
            let by_turn = [Matrix3::zeros(), torque];
            Acting { body, by: Vec::new(), follows: vec![WrenchSlope { body, by_place, by_turn }] }
        }));
        Tape { derivative, acting }
    }

    /// Derivatives of one row by all variables (P4).
    fn pulled(
        &self,
        row: &RowOf,
        states: &[Vec<State>],
        tape: &mut [Tape],
        controls: &[f64],
    ) -> Result<DVector<f64>, PlanError> {
        let (_, body, after, by) = self.row(row, states);
        let mut found = DVector::zeros(controls.len());
        let mut dual = vec![StateChange::zero(); states[0].len()];
        dual[body] = by;
        let constants = MotorConstants::new(self);
        let mut gradient = StepGradient::default();
        for step in tape[..after].iter_mut().rev() {
            step.vjp(&mut dual, &constants, &mut gradient, found.as_mut_slice())?;
        }
        for (place, body, slope) in self.start_slopes(controls) {
            found[place] += dual[body].dot(&slope);
        }
        Ok(found)
    }

    /// Derivatives of the initial states: the variable, the body, and the change.
    pub(super) fn start_slopes(&self, controls: &[f64]) -> Vec<(usize, usize, StateChange)> {
        let mut slopes = Vec::new();
        for (index, control) in self.controls().iter().enumerate() {
            let ControlKind::Start { body, .. } = control.kind else { continue };
            let (numbers, places) = self.numbers(index, 0, controls);
            for (k, place) in places.iter().enumerate() {
                let slope = control.kind.start_slope(&numbers, k);
                slopes.extend(place.zip(slope).map(|(place, slope)| (place, body, slope)));
            }
        }
        slopes
    }

    /// Central difference of the rows by one variable.
    fn differenced(
        &self,
        index: usize,
        rows: &[RowOf],
        controls: &[f64],
        interrupt: &Arc<AtomicBool>,
    ) -> Result<DVector<f64>, PlanError> {
        let by = DIFFERENCE * self.variables()[index].scale();
        let moved = |by: f64| {
            let mut controls = controls.to_vec();
            controls[index] += by;
            let mut states = vec![self.starts(&controls)];
            self.simulate(&controls, Some(interrupt), &mut |simulation, _, _| {
                states.push(simulation.states().to_vec());
                Ok(())
            })?;
            Ok::<_, PlanError>(self.values(rows, &states))
        };
        Ok((moved(by)? - moved(-by)?) / (2.0 * by))
    }
}

/// Variables that are constants of the world.
pub(super) struct MotorConstants {
    asked: Vec<Constant>,
    /// Index of each variable, and the derivatives of the constant's numbers by it.
    places: Vec<(usize, Vec<f64>)>,
}

impl MotorConstants {
    pub(super) fn new(problem: &PlanProblem) -> Self {
        let (mut asked, mut places) = (Vec::new(), Vec::new());
        for (place, variable) in problem.variables().iter().enumerate() {
            let ControlKind::Constant(constant) = problem.controls()[variable.control].kind else {
                continue;
            };
            let numbers = |number| constant.from_one_number(&problem.scene.world, number);
            let slopes =
                numbers(1.0).iter().zip(numbers(0.0)).map(|(one, none)| one - none).collect();
            asked.push(constant);
            places.push((place, slopes));
        }
        Self { asked, places }
    }

    /// Indices among the variables.
    pub(super) fn places(&self) -> impl Iterator<Item = usize> + '_ {
        self.places.iter().map(|(place, _)| *place)
    }
}

impl Tape {
    /// Backward pass (P4) over one step.
    ///
    /// `dual` changes from the derivatives by the states at the end of the step to those by the states at its start. The
    /// derivatives by variables are added to `found`.
    pub(super) fn vjp(
        &mut self,
        dual: &mut Vec<StateChange>,
        constants: &MotorConstants,
        gradient: &mut StepGradient,
        found: &mut [f64],
    ) -> Result<(), PlanError> {
        self.derivative.vjp(dual, &constants.asked, gradient)?;
        dual.clone_from(&gradient.states);
        for of in &self.acting {
            let by = &gradient.wrenches[of.body];
            for (place, slope) in &of.by {
                found[*place] += by.force.dot(&slope.force) + by.torque.dot(&slope.torque);
            }
            for WrenchSlope { body, by_place, by_turn } in &of.follows {
                let pulled = |[force, torque]: &[Matrix3<f64>; 2]| {
                    force.tr_mul(&by.force) + torque.tr_mul(&by.torque)
                };
                dual[*body].position += pulled(by_place);
                dual[*body].turn += pulled(by_turn);
            }
        }
        for ((place, slopes), numbers) in constants.places.iter().zip(&gradient.constants) {
            let pairs = numbers.iter().zip(slopes);
            found[*place] += pairs.map(|(by, slope)| by * slope).sum::<f64>();
        }
        Ok(())
    }
}

/// Derivatives of a motor's wrenches on both bodies of `joint`, from its value and its index among the variables.
///
/// Derivatives by places and turns are fourth-order differences of the closed form.
fn motor(
    joint: &Joint,
    states: &[State],
    axis: JointAxis,
    number: f64,
    place: Option<usize>,
) -> Vec<Acting> {
    let slopes = motor_wrenches(joint, states, axis, 1.0);
    let act = |(body, slope)| {
        let by = place.map(|place| (place, slope)).into_iter().collect();
        Acting { body, by, follows: Vec::new() }
    };
    let mut acting: Vec<Acting> = slopes.map(act).collect();
    // Six changes of each body's pose
    let mut moved = states.to_vec();
    for body in [Some(joint.body()), joint.other()].into_iter().flatten() {
        let none = || WrenchSlope {
            body,
            by_place: [Matrix3::zeros(); 2],
            by_turn: [Matrix3::zeros(); 2],
        };
        acting.iter_mut().for_each(|of| of.follows.push(none()));
        for k in 0..6 {
            for (times, weight) in DIFFERENCES {
                let by = Vector3::ith(k % 3, times * MOVED);
                let change = match k {
                    0..3 => StateChange { position: by, ..StateChange::zero() },
                    _ => StateChange { turn: by, ..StateChange::zero() },
                };
                moved[body] = change.applied(&states[body]);
                let found = motor_wrenches(joint, &moved, axis, number);
                for (of, (_, wrench)) in acting.iter_mut().zip(found) {
                    let Some(follows) = of.follows.last_mut() else { continue };
                    let of = if k < 3 { &mut follows.by_place } else { &mut follows.by_turn };
                    for (slopes, value) in of.iter_mut().zip([wrench.force, wrench.torque]) {
                        let mut column = slopes.column_mut(k % 3);
                        column += value * (weight / MOVED);
                    }
                }
            }
            moved[body] = states[body];
        }
    }
    acting
}

/// Fourth-order difference: f' = (f(−2h) − 8 f(−h) + 8 f(h) − f(2h))/12h.
const DIFFERENCES: [(f64, f64); 4] =
    [(-2.0, 1.0 / 12.0), (-1.0, -8.0 / 12.0), (1.0, 8.0 / 12.0), (2.0, -1.0 / 12.0)];

/// Step h of that difference, m and rad: both its error and rounding are about 1e-13.
const MOVED: f64 = 1e-3;

#[cfg(test)]
#[path = "tests/slopes.rs"]
pub(super) mod tests;
