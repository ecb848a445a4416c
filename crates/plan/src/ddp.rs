//! Differential dynamic programming with bounded controls, after Tassa, Mansard and Todorov (2014).
//!
//! This is the model of the cost for the stage `ddp`; [`Shoot`](super::Shoot) has the loop. A decision is made at each
//! step where a piece of a control begins, and it acts for the length of that piece. Starts and constants are decided
//! before the first step.
//!
//! The state of a decision is z = (δX, h): the change δX of the states, in the tangent space of attitudes, and the earlier
//! decisions h that still act. The least remaining cost V is quadratic in z, with the Gauss–Newton part of the rows:
//!
//! ```text
//! V_k(z) = g·z + ½ zᵀ P z
//! Q = P_{k+1} through (δX, h, u) → (δX⁺, h⁺), plus the rows and efforts of step k
//! d = argmin ½ dᵀ(Q_uu + κD) d + q_u·d within the bounds
//! K = −(Q_uu + κD)⁻¹ Q_uz for the components of u that are free
//! u = û + α d + K δz                                                               (P6)
//! ```
//!
//! A trial run decides its controls from its own states, clipped to the bounds. It equals the run of the resulting controls.
//! D is the diagonal of JᵀJ + E in (P5). The backward pass yields it when all decisions are fixed.

use super::boxed::{LEAST_DAMPING, Room, least_in_box};
use super::model::{Centre, CostModel, NOTHING, Trials, efforts, scales};
use super::slopes::{MotorConstants, Tape};
use super::{PlanError, PlanProblem};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use tumble_core::derivative::StateChange;
use tumble_core::mechanics::State;
use tumble_core::solver::native::{Smoothing, StepDerivative, StepGradient};

/// Compliances of the smoothed derivatives, in the order of their use.
pub(super) const ROUGH: [f64; 3] = [0.1, 1e-3, 1.0];

/// Values of α, tried until a run is cheaper.
const PARTS: [f64; 3] = [1.0, 0.3, 0.1];

/// Number of step derivatives in memory at once; a transition takes a hundredth of the memory of a derivative.
const AT_ONCE: usize = 128;

/// Length of the state change of a body.
const LEN: usize = StateChange::LEN;

/// Linear map to the states at the end of a step, or at the start of the run.
struct Transition {
    /// Decisions that act in the step.
    acting: Vec<usize>,
    /// Decisions made at its start.
    chosen: Vec<usize>,
    /// Derivatives of all states by the states before and by the acting decisions, in units of the bounds.
    by: DMatrix<f64>,
}

/// Remaining cost to second order in z.
struct Value {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    /// Earlier decisions in z, after the states.
    held: Vec<usize>,
}

/// Feedback law of the decisions at the start of a transition.
struct Gains {
    /// Step d.
    step: DVector<f64>,
    /// Gain K, by z.
    by: DMatrix<f64>,
    held: Vec<usize>,
}

/// Maps the decisions, the cost by z and the decisions, and the index of the first decision in that
/// cost to gains.
type Choosing<'a> = dyn FnMut(&[usize], &Value, usize) -> Option<Gains> + 'a;

/// Model of the cost about a run.
pub(super) struct DdpModel {
    centre: Centre,
    /// Weights of effort, in units of the bounds.
    efforts: DVector<f64>,
    states: Vec<Vec<State>>,
    /// Value, body and slope of each row, by state.
    rows: Vec<Vec<(f64, usize, StateChange)>>,
    /// Transition to the start, then one for each step.
    transitions: Vec<Transition>,
    /// Diagonal of D.
    damping: DVector<f64>,
}

impl DdpModel {
    /// Refuses a problem whose steps have more than `most` derivatives.
    pub(super) fn check(problem: &PlanProblem, most: usize) -> Result<(), PlanError> {
        let states = LEN * problem.scene.starts.len();
        let each = problem.controls().iter().map(|control| control.bounds.len());
        let entries = (states + each.sum::<usize>()).saturating_mul(states);
        if entries.saturating_mul(problem.steps()) > most {
            return Err(PlanError::Problem(format!(
                "ddp: {} steps of {} bodies have too many derivatives; use fewer steps",
                problem.steps(),
                problem.scene.starts.len()
            )));
        }
        Ok(())
    }

    /// Model about the run of `controls` with exact derivatives, or smoothed ones where `rough` is above 0.
    ///
    /// `None` if a step has no such derivative.
    pub(super) fn new(
        controls: &[f64],
        rough: usize,
        trials: &mut Trials<'_>,
    ) -> Result<Option<Self>, PlanError> {
        let problem = trials.problem;
        let like = match rough.checked_sub(1) {
            Some(rough) => StepDerivative::smoothed(Smoothing::Compliance(ROUGH[rough]))?,
            None => StepDerivative::new(),
        };
        let scales = scales(problem);
        let constants = MotorConstants::new(problem);
        let mut transitions = vec![to_start(problem, controls, &scales, &constants)];
        let mut tape: Vec<(usize, Tape)> = Vec::with_capacity(AT_ONCE);
        // Steps are linearised in parallel, as many at once as `AT_ONCE`, to bound the memory.
        let turn = |tape: &mut Vec<(usize, Tape)>, transitions: &mut Vec<Transition>| {
            let all = std::mem::take(tape).into_par_iter().map(|(step, tape)| {
                let choices = choices_in(problem, step, controls, &constants);
                transition(
                    tape,
                    choices.0,
                    choices.1,
                    problem.scene.starts.len(),
                    &scales,
                    &constants,
                )
            });
            transitions.extend(all.collect::<Result<Vec<_>, PlanError>>()?);
            Ok::<_, PlanError>(())
        };
        let mut take = |step: Tape| {
            tape.push((transitions.len() + tape.len() - 1, step));
            if tape.len() == AT_ONCE { turn(&mut tape, &mut transitions) } else { Ok(()) }
        };
        // One run yields the states and the tape of all steps.
        let (states, all) = problem.taped(controls, Some(like), &mut take, trials.interrupt)?;
        turn(&mut tape, &mut transitions)?;
        trials.runs += 1;
        if !all {
            return Ok(None);
        }
        let x = DVector::from_column_slice(controls).component_div(&scales);
        // Residuals of the cost, after the steps they belong to
        let mut rows = vec![Vec::new(); states.len()];
        for row in &problem.rows_of(&states) {
            let (value, body, after, by) = problem.row(row, &states);
            rows[after].push((value, body, by));
        }
        let count = x.len();
        let room = Room::new(problem, &x);
        let gradient = DVector::zeros(count);
        let mut model = Self {
            efforts: efforts(problem, &scales),
            damping: DVector::zeros(count),
            centre: Centre { x, scales, room, gradient, moves: false },
            states,
            rows,
            transitions,
        };
        let (mut gradient, mut damping) = (DVector::zeros(count), DVector::zeros(count));
        // A backward pass without gains: gradient and diagonal of the Gauss–Newton matrix by the controls
        model.backwards(&mut |chosen, value, first| {
            for (k, &choice) in chosen.iter().enumerate() {
                gradient[choice] = value.gradient[first + k];
                damping[choice] = value.matrix[(first + k, first + k)];
            }
            Some(Gains::none(chosen.len()))
        });
        // Controls move the targets if the matrix has more than the efforts on its diagonal.
        let by_rows = (&damping - &model.efforts).max().max(0.0).sqrt();
        let all = model.rows.iter().flatten().map(|(value, ..)| value * value).sum::<f64>();
        model.centre.moves = by_rows > NOTHING * all.sqrt();
        (model.centre.gradient, model.damping) = (gradient, damping);
        Ok(Some(model))
    }

    /// Backward pass (P6): `choose` returns the gains of each transition. `None` if it has none for one of them.
    fn backwards(&self, choose: &mut Choosing<'_>) -> Option<Vec<Gains>> {
        let states = LEN * self.states[0].len();
        let mut value = Value {
            matrix: DMatrix::zeros(states, states),
            gradient: DVector::zeros(states),
            held: Vec::new(),
        };
        let mut all = Vec::with_capacity(self.transitions.len());
        for (transition, rows) in self.transitions.iter().zip(&self.rows).rev() {
            value.add(rows);
            value = value.before(transition);
            let first = value.gradient.len() - transition.chosen.len();
            for (k, &choice) in transition.chosen.iter().enumerate() {
                value.gradient[first + k] += self.efforts[choice] * self.centre.x[choice];
                value.matrix[(first + k, first + k)] += self.efforts[choice];
            }
            let mut gains = choose(&transition.chosen, &value, first)?;
            value = value.chosen(&mut gains, first);
            all.push(gains);
        }
        all.reverse();
        Some(all)
    }

    /// Gains with this κ. `None` if the free decisions have no minimum.
    fn gains(&self, kappa: f64) -> Option<Vec<Gains>> {
        let least = LEAST_DAMPING * self.damping.amax();
        self.backwards(&mut |chosen, value, first| {
            let count = chosen.len();
            let mut matrix = value.matrix.view((first, first), (count, count)).into_owned();
            for (k, &choice) in chosen.iter().enumerate() {
                matrix[(k, k)] += kappa * self.damping[choice].max(least);
            }
            let gradient = value.gradient.rows(first, count).into_owned();
            let of = |far: &DVector<f64>| {
                DVector::from_iterator(count, chosen.iter().map(|&choice| far[choice]))
            };
            let Room { down, up } = &self.centre.room;
            let (low, high) = (of(down), of(up));
            let found = least_in_box(&matrix, &gradient, &low, &high)?;
            let mut by = DMatrix::zeros(count, first);
            if let Some(factor) = found.factor {
                let right = DMatrix::from_fn(found.free.len(), first, |i, j| {
                    -value.matrix[(first + found.free[i], j)]
                });
                for (&k, row) in found.free.iter().zip(factor.solve(&right).row_iter()) {
                    by.row_mut(k).copy_from(&row);
                }
            }
            Some(Gains { step: found.step, by, held: Vec::new() })
        })
    }

    /// Controls and cost of a run that decides by these gains with the part α of their steps.
    fn run(
        &self,
        gains: &[Gains],
        part: f64,
        trials: &mut Trials<'_>,
    ) -> Result<(Vec<f64>, f64), PlanError> {
        let bounds = trials.problem.variables();
        let Centre { x, scales, .. } = &self.centre;
        let mut controls: Vec<f64> = x.component_mul(scales).as_slice().to_vec();
        let set = |transition: usize, states: Option<&[State]>, controls: &mut [f64]| {
            let chosen = &self.transitions[transition].chosen;
            if chosen.is_empty() {
                return;
            }
            let Gains { step, by, held } = &gains[transition];
            let mut moved = step * part;
            if let Some(states) = states {
                let pairs = self.states[transition - 1].iter().zip(states);
                let changes =
                    pairs.flat_map(|(from, to)| StateChange::between(from, to).to_array());
                let others = held.iter().map(|&of| controls[of] / scales[of] - x[of]);
                moved += by * DVector::from_iterator(by.ncols(), changes.chain(others));
            }
            for (&choice, moved) in chosen.iter().zip(&moved) {
                let [low, high] = bounds[choice].bounds;
                controls[choice] = ((x[choice] + moved) * scales[choice]).clamp(low, high);
            }
        };
        set(0, None, &mut controls);
        if controls.iter().any(|value| !value.is_finite()) {
            return Ok((controls, f64::INFINITY));
        }
        let mut choose = |step: usize, states: &[State], controls: &mut [f64]| {
            set(step + 1, Some(states), controls);
        };
        let cost = trials.cost(&mut controls, &mut choose)?;
        Ok((controls, cost))
    }
}

impl CostModel for DdpModel {
    fn centre(&self) -> &Centre {
        &self.centre
    }

    fn tried(
        &self,
        kappa: f64,
        cost: f64,
        trials: &mut Trials<'_>,
    ) -> Result<Option<(Vec<f64>, f64)>, PlanError> {
        let Some(gains) = self.gains(kappa) else { return Ok(None) };
        for part in PARTS {
            let (controls, found) = self.run(&gains, part, trials)?;
            if found < cost {
                return Ok(Some((controls, found)));
            }
        }
        Ok(None)
    }
}

impl Gains {
    /// Gains of decisions that stay fixed.
    fn none(count: usize) -> Self {
        Self { step: DVector::zeros(count), by: DMatrix::zeros(count, 0), held: Vec::new() }
    }
}

impl Value {
    /// Adds rows of these states.
    fn add(&mut self, rows: &[(f64, usize, StateChange)]) {
        for (value, body, by) in rows {
            let by = DVector::from_column_slice(&by.to_array());
            let at = LEN * body;
            let mut part = self.matrix.view_mut((at, at), (LEN, LEN));
            part.ger(1.0, &by, &by, 1.0);
            self.gradient.rows_mut(at, LEN).axpy(*value, &by, 1.0);
        }
    }

    /// Cost by the quantities before `transition`: the states, the earlier decisions, and the decisions at its start.
    fn before(&self, transition: &Transition) -> Self {
        let Transition { acting, by, chosen } = transition;
        let (states, first) = (by.nrows(), by.ncols() - acting.len());
        // Columns of the decisions in z.
        let column = |choice: &usize| acting.iter().position(|acts| acts == choice);
        let columns: Vec<Option<usize>> = self.held.iter().map(column).collect();
        let others = self.held.len();
        let mut through = self.matrix.view((0, 0), (states + others, states)) * by;
        for (k, place) in columns.iter().enumerate() {
            if let Some(place) = place {
                let mut column = through.column_mut(first + place);
                column += self.matrix.column(states + k);
            }
        }
        let mut matrix = by.tr_mul(&through.rows(0, states));
        let mut gradient = by.tr_mul(&self.gradient.rows(0, states));
        for (k, place) in columns.iter().enumerate() {
            if let Some(place) = place {
                let mut row = matrix.row_mut(first + place);
                row += through.row(states + k);
                gradient[first + place] += self.gradient[states + k];
            }
        }
        // New decisions come last.
        let held: Vec<usize> =
            acting.iter().filter(|choice| !chosen.contains(choice)).copied().collect();
        let order = held.iter().chain(chosen).filter_map(column).map(|place| first + place);
        let order: Vec<usize> = (0..first).chain(order).collect();
        let size = order.len();
        let matrix = DMatrix::from_fn(size, size, |i, j| {
            let (i, j) = (order[i], order[j]);
            0.5 * (matrix[(i, j)] + matrix[(j, i)])
        });
        let gradient = DVector::from_iterator(size, order.iter().map(|&k| gradient[k]));
        Self { matrix, gradient, held }
    }

    /// Cost after the decisions from `first` on are made by these gains.
    fn chosen(self, gains: &mut Gains, first: usize) -> Self {
        let count = gains.step.len();
        gains.held.clone_from(&self.held);
        if count == 0 {
            return self;
        }
        let cross = self.matrix.view((0, first), (first, count)).into_owned();
        let own = self.matrix.view((first, first), (count, count)).into_owned();
        let mut matrix = self.matrix.view((0, 0), (first, first)).into_owned();
        let mut gradient = self.gradient.rows(0, first) + &cross * &gains.step;
        if gains.by.ncols() == first {
            let slope = self.gradient.rows(first, count) + &own * &gains.step;
            gradient += gains.by.tr_mul(&slope);
            let product = &cross * &gains.by;
            matrix += &product + product.transpose() + gains.by.tr_mul(&(&own * &gains.by));
        }
        Self { matrix, gradient, held: self.held }
    }
}

/// Decisions that act in a step, and decisions made at its start.
fn choices_in(
    problem: &PlanProblem,
    step: usize,
    controls: &[f64],
    constants: &MotorConstants,
) -> (Vec<usize>, Vec<usize>) {
    let mut acting: Vec<usize> = constants.places().collect();
    let mut chosen = Vec::new();
    for (index, control) in problem.controls().iter().enumerate() {
        if control.kind.is_of_the_run() {
            continue;
        }
        let knot = problem.knot(index, step);
        let (_, places) = problem.numbers(index, knot, controls);
        acting.extend(places.iter().flatten());
        if problem.steps_of(index, knot).start == step {
            chosen.extend(places.iter().flatten());
        }
    }
    (acting, chosen)
}

fn to_start(
    problem: &PlanProblem,
    controls: &[f64],
    scales: &DVector<f64>,
    constants: &MotorConstants,
) -> Transition {
    let slopes = problem.start_slopes(controls);
    let acting: Vec<usize> =
        slopes.iter().map(|(place, ..)| *place).chain(constants.places()).collect();
    let mut by = DMatrix::zeros(LEN * problem.scene.starts.len(), acting.len());
    for (column, (place, body, slope)) in slopes.iter().enumerate() {
        let slope = DVector::from_column_slice(&slope.to_array()) * scales[*place];
        by.view_mut((LEN * body, column), (LEN, 1)).copy_from(&slope);
    }
    Transition { chosen: acting.clone(), acting, by }
}

/// Transition of a step, row by row with the transposed derivative.
fn transition(
    mut tape: Tape,
    acting: Vec<usize>,
    chosen: Vec<usize>,
    bodies: usize,
    scales: &DVector<f64>,
    constants: &MotorConstants,
) -> Result<Transition, PlanError> {
    let states = LEN * bodies;
    let mut by = DMatrix::zeros(states, states + acting.len());
    let mut gradient = StepGradient::default();
    let mut found = vec![0.0; scales.len()];
    for row in 0..states {
        let mut numbers = [0.0; LEN];
        numbers[row % LEN] = 1.0;
        let mut dual = vec![StateChange::zero(); bodies];
        dual[row / LEN] = StateChange::from_array(&numbers);
        tape.vjp(&mut dual, constants, &mut gradient, &mut found)?;
        let before = dual.iter().flat_map(StateChange::to_array);
        for (column, number) in before.enumerate() {
            by[(row, column)] = number;
        }
        for (column, &choice) in acting.iter().enumerate() {
            by[(row, states + column)] = std::mem::take(&mut found[choice]) * scales[choice];
        }
    }
    Ok(Transition { acting, chosen, by })
}

#[cfg(test)]
#[path = "tests/ddp.rs"]
mod tests;
