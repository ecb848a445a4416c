//! Differential dynamic programming: the model of the cost about a run that [shooting](super::Shoot) takes stage by stage, with bounds after
//! Tassa, Mansard and Todorov (2014).
//!
//! A stage begins where pieces of controls do. What is chosen there, u, acts for as long as its piece does: to what comes after the stage begins
//! with, the change δX of the states (in the tangent space of attitudes), belong the choices h that still hold from earlier stages, and
//! starts and constants are those of a stage before the first. With z = (δX, h) and the steps' own derivatives, the least cost from there
//! on is, to second order and with Gauss's and Newton's part of the rows alone,
//!
//! ```text
//! V_k(z) = g·z + ½ zᵀ P z,   Q = P_{k+1} through (δX, h, u) → (δX⁺, h⁺), and the rows and efforts of k       (P29)
//! u = û + α d + K δz,   d = least of ½ dᵀ(Q_uu + κD) d + q_u·d within the bounds,   K = −(Q_uu + κD)⁻¹ Q_uz
//! ```
//!
//! K of what is at no bound alone. The controls of a run are chosen on its way by its states, clipped, and it is the run of these controls. D is
//! that of (P6): the diagonal of JᵀJ + E, which the same pass backwards has where all choices are kept as they are.

use super::boxed::{LEAST_DAMPING, Room, least_in_box};
use super::model::{Centre, Model, NOTHING, Trials, efforts, scales};
use super::slopes::{Constants, Tape};
use super::{PlanError, Problem};
use crate::derivative::StateChange;
use crate::mechanics::State;
use crate::solver::native::{Smoothing, StepDerivative, StepGradient};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// The compliances of the steps whose derivatives are the rough ones, in the order in which they are tried.
pub(super) const ROUGH: [f64; 3] = [0.1, 1e-3, 1.0];

/// α, until a run is cheaper.
const PARTS: [f64; 3] = [1.0, 0.3, 0.1];

/// Of so many steps the derivatives are held until they are passages, of which one is a hundredth as large.
const AT_ONCE: usize = 128;

/// Numbers of the state of a body.
const LEN: usize = StateChange::LEN;

/// How the states at the end of a step, or at the start of the run, follow.
struct Passage {
    /// The choices that act in it.
    acting: Vec<usize>,
    /// Those of them that are made at its start.
    chosen: Vec<usize>,
    /// The derivatives of all states by those before it, if there are any, and by what acts, in parts of the bounds.
    by: DMatrix<f64>,
}

/// The cost from somewhere on, to second order, by the changes of all states and of what holds there.
struct Value {
    matrix: DMatrix<f64>,
    gradient: DVector<f64>,
    /// The choices that hold, after the states.
    held: Vec<usize>,
}

/// What is chosen at the start of a passage.
struct Gains {
    /// d.
    step: DVector<f64>,
    /// K, by the states and by what holds.
    by: DMatrix<f64>,
    held: Vec<usize>,
}

/// Makes the gains of what is chosen, of the cost by states, what holds and what is chosen, and where the last of these begin.
type Choosing<'a> = dyn FnMut(&[usize], &Value, usize) -> Option<Gains> + 'a;

/// The model about a run.
pub(super) struct Stages {
    centre: Centre,
    /// In parts of the bounds.
    efforts: DVector<f64>,
    states: Vec<Vec<State>>,
    /// Values and slopes of the rows of every state.
    rows: Vec<Vec<(f64, usize, StateChange)>>,
    /// To the start, then those of all steps.
    passages: Vec<Passage>,
    /// D.
    damping: DVector<f64>,
}

impl Stages {
    /// Refuses what has more than so many derivatives.
    pub(super) fn check(problem: &Problem, most: usize) -> Result<(), PlanError> {
        let states = LEN * problem.scene.starts.len();
        let each = problem.controls().iter().map(|control| control.bounds.len());
        let entries = (states + each.sum::<usize>()).saturating_mul(states);
        if entries.saturating_mul(problem.steps()) > most {
            return Err(PlanError::Problem(format!(
                "ddp: {} steps of {} bodies are too many derivatives; fewer steps are needed",
                problem.steps(),
                problem.scene.starts.len()
            )));
        }
        Ok(())
    }

    /// About the run under `controls`, with derivatives of its steps, or with `rough` ones; none where a step has no such.
    pub(super) fn of(
        controls: &[f64],
        rough: usize,
        trials: &mut Trials<'_>,
    ) -> Result<Option<Self>, PlanError> {
        let problem = trials.problem;
        let like = match rough.checked_sub(1) {
            Some(rough) => StepDerivative::smoothed(Smoothing::Compliance(ROUGH[rough]))?,
            None => StepDerivative::new(),
        };
        let (scales, constants) = (scales(problem), Constants::of(problem));
        let mut passages = vec![to_start(problem, controls, &scales, &constants)];
        let mut tape: Vec<(usize, Tape)> = Vec::with_capacity(AT_ONCE);
        let turn = |tape: &mut Vec<(usize, Tape)>, passages: &mut Vec<Passage>| {
            let all = std::mem::take(tape).into_par_iter().map(|(step, tape)| {
                let choices = choices_in(problem, step, controls, &constants);
                passage(tape, choices, problem.scene.starts.len(), &scales, &constants)
            });
            passages.extend(all.collect::<Result<Vec<_>, PlanError>>()?);
            Ok::<_, PlanError>(())
        };
        let mut take = |step: Tape| {
            tape.push((passages.len() + tape.len() - 1, step));
            if tape.len() == AT_ONCE { turn(&mut tape, &mut passages) } else { Ok(()) }
        };
        let (states, all) = problem.taped(controls, Some(like), &mut take, trials.interrupt)?;
        turn(&mut tape, &mut passages)?;
        trials.runs += 1;
        if !all {
            return Ok(None);
        }
        let x = DVector::from_column_slice(controls).component_div(&scales);
        let mut rows = vec![Vec::new(); states.len()];
        for row in &problem.rows_of(&states) {
            let (value, body, after, by) = problem.row(row, &states);
            rows[after].push((value, body, by));
        }
        let count = x.len();
        let (room, gradient) = (Room::of(problem, &x), DVector::zeros(count));
        let mut stages = Self {
            efforts: efforts(problem, &scales),
            damping: DVector::zeros(count),
            centre: Centre { x, scales, room, gradient, moves: false },
            states,
            rows,
            passages,
        };
        let (mut gradient, mut damping) = (DVector::zeros(count), DVector::zeros(count));
        stages.backwards(&mut |chosen, value, first| {
            for (k, &choice) in chosen.iter().enumerate() {
                gradient[choice] = value.gradient[first + k];
                damping[choice] = value.matrix[(first + k, first + k)];
            }
            Some(Gains::none(chosen.len()))
        });
        let by_rows = (&damping - &stages.efforts).max().max(0.0).sqrt();
        let all = stages.rows.iter().flatten().map(|(value, ..)| value * value).sum::<f64>();
        stages.centre.moves = by_rows > NOTHING * all.sqrt();
        (stages.centre.gradient, stages.damping) = (gradient, damping);
        Ok(Some(stages))
    }

    /// The pass backwards: at the start of every passage `choose` is told what is chosen there, the cost (P29) by states, what holds and what
    /// is chosen, in this order, and where the last of these begin. The gains of all passages, unless it has none for one.
    fn backwards(&self, choose: &mut Choosing<'_>) -> Option<Vec<Gains>> {
        let states = LEN * self.states[0].len();
        let mut value = Value {
            matrix: DMatrix::zeros(states, states),
            gradient: DVector::zeros(states),
            held: Vec::new(),
        };
        let mut all = Vec::with_capacity(self.passages.len());
        for (passage, rows) in self.passages.iter().zip(&self.rows).rev() {
            value.add(rows);
            value = value.before(passage);
            let first = value.gradient.len() - passage.chosen.len();
            for (k, &choice) in passage.chosen.iter().enumerate() {
                value.gradient[first + k] += self.efforts[choice] * self.centre.x[choice];
                value.matrix[(first + k, first + k)] += self.efforts[choice];
            }
            let mut gains = choose(&passage.chosen, &value, first)?;
            value = value.chosen(&mut gains, first);
            all.push(gains);
        }
        all.reverse();
        Some(all)
    }

    /// The gains with this κ; none where what is free has no least point.
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
            let found = least_in_box(&matrix, &gradient, (&low, &high))?;
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

    /// The controls of a run that chooses them by these gains, with the part α of their steps, and what it costs.
    fn run(
        &self,
        gains: &[Gains],
        part: f64,
        trials: &mut Trials<'_>,
    ) -> Result<(Vec<f64>, f64), PlanError> {
        let bounds = trials.problem.variables();
        let Centre { x, scales, .. } = &self.centre;
        let mut controls: Vec<f64> = x.component_mul(scales).as_slice().to_vec();
        let set = |passage: usize, states: Option<&[State]>, controls: &mut [f64]| {
            let chosen = &self.passages[passage].chosen;
            if chosen.is_empty() {
                return;
            }
            let Gains { step, by, held } = &gains[passage];
            let mut moved = step * part;
            if let Some(states) = states {
                let pairs = self.states[passage - 1].iter().zip(states);
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

impl Model for Stages {
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
    /// Of choices that are kept as they are.
    fn none(count: usize) -> Self {
        Self { step: DVector::zeros(count), by: DMatrix::zeros(count, 0), held: Vec::new() }
    }
}

impl Value {
    /// Adds rows of the states here.
    fn add(&mut self, rows: &[(f64, usize, StateChange)]) {
        for (value, body, by) in rows {
            let by = DVector::from_column_slice(&by.to_array());
            let at = LEN * body;
            let mut part = self.matrix.view_mut((at, at), (LEN, LEN));
            part.ger(1.0, &by, &by, 1.0);
            self.gradient.rows_mut(at, LEN).axpy(*value, &by, 1.0);
        }
    }

    /// The same by what there is before `passage`: the states, what holds, and what is chosen.
    fn before(&self, passage: &Passage) -> Self {
        let Passage { acting, by, chosen } = passage;
        let (states, first) = (by.nrows(), by.ncols() - acting.len());
        // Where what holds here stands among the columns.
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
        // What is chosen comes last.
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

    /// The same where what stands from `first` on is chosen by these gains.
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

/// The choices that act in a step, and those that are made at its start.
fn choices_in(
    problem: &Problem,
    step: usize,
    controls: &[f64],
    constants: &Constants,
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

/// The passage of starts and constants.
fn to_start(
    problem: &Problem,
    controls: &[f64],
    scales: &DVector<f64>,
    constants: &Constants,
) -> Passage {
    let slopes = problem.start_slopes(controls);
    let acting: Vec<usize> =
        slopes.iter().map(|(place, ..)| *place).chain(constants.places()).collect();
    let mut by = DMatrix::zeros(LEN * problem.scene.starts.len(), acting.len());
    for (column, (place, body, slope)) in slopes.iter().enumerate() {
        let slope = DVector::from_column_slice(&slope.to_array()) * scales[*place];
        by.view_mut((LEN * body, column), (LEN, 1)).copy_from(&slope);
    }
    Passage { chosen: acting.clone(), acting, by }
}

/// The passage of a step: of every number of the states at its end the product with the transposed derivative.
fn passage(
    mut tape: Tape,
    (acting, chosen): (Vec<usize>, Vec<usize>),
    bodies: usize,
    scales: &DVector<f64>,
    constants: &Constants,
) -> Result<Passage, PlanError> {
    let states = LEN * bodies;
    let mut by = DMatrix::zeros(states, states + acting.len());
    let (mut gradient, mut found) = (StepGradient::default(), vec![0.0; scales.len()]);
    for row in 0..states {
        let mut numbers = [0.0; LEN];
        numbers[row % LEN] = 1.0;
        let mut dual = vec![StateChange::zero(); bodies];
        dual[row / LEN] = StateChange::from_array(&numbers);
        tape.pull(&mut dual, constants, &mut gradient, &mut found)?;
        let before = dual.iter().flat_map(StateChange::to_array);
        for (column, number) in before.enumerate() {
            by[(row, column)] = number;
        }
        for (column, &choice) in acting.iter().enumerate() {
            by[(row, states + column)] = std::mem::take(&mut found[choice]) * scales[choice];
        }
    }
    Ok(Passage { acting, chosen, by })
}

#[cfg(test)]
mod tests {
    use super::super::slopes::tests::pushed_box;
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    /// Where nothing is bounded, the stages' choices along the linear passages are the step of all controls at once, (JᵀJ + E)⁻¹ of the gradient,
    /// with J by rows; and gradient and D are those of J. Pushes of three knots and torques of two, a start, constants.
    #[test]
    fn stages_make_the_step_of_all_controls_at_once() {
        make_the_step_of_all_controls_at_once(12);
    }

    /// The same where derivatives are made passages of before the run is at its end, and where the last are as many.
    #[test]
    fn stages_of_more_steps_than_are_held_at_once() {
        make_the_step_of_all_controls_at_once(2 * AT_ONCE + 44);
        make_the_step_of_all_controls_at_once(2 * AT_ONCE);
    }

    fn make_the_step_of_all_controls_at_once(steps: usize) {
        let (problem, controls) = pushed_box(steps);
        let interrupt = Arc::new(AtomicBool::new(false));
        let mut trials = Trials { problem: &problem, interrupt: &interrupt, runs: 0 };
        let mut stages = Stages::of(&controls, 0, &mut trials).unwrap().unwrap();
        let (slopes, _) = problem.slopes(&controls, false, &interrupt).unwrap();
        let mut by = slopes.by;
        assert_eq!(stages.passages.len(), steps + 1);
        for (mut column, scale) in by.column_iter_mut().zip(&stages.centre.scales) {
            column *= *scale;
        }
        // Constants have no effort of their own; a little of it makes the step one.
        stages.efforts.apply(|effort| *effort += 1e-3);
        let efforts = &stages.efforts;
        let matrix = by.tr_mul(&by) + DMatrix::from_diagonal(efforts);
        let gradient = by.tr_mul(&slopes.rows) + efforts.component_mul(&stages.centre.x);
        let near = |a: &DVector<f64>, b: &DVector<f64>| (a - b).amax() < 1e-9 * b.amax();
        let plain = &gradient - &stages.centre.x * 1e-3;
        assert!(near(&stages.centre.gradient, &plain), "{} {plain}", stages.centre.gradient);
        let diagonal = matrix.diagonal().add_scalar(-1e-3);
        assert!(near(&stages.damping, &diagonal), "{} {diagonal}", stages.damping);
        assert!(stages.centre.moves);
        let wanted = matrix.cholesky().unwrap().solve(&-gradient);

        let count = wanted.len();
        stages.centre.room.down.fill(-1e3);
        stages.centre.room.up.fill(1e3);
        let gains = stages.gains(0.0).unwrap();
        let mut found = DVector::from_element(count, f64::NAN);
        let mut change = DVector::<f64>::zeros(0);
        for (passage, Gains { step, by, held }) in stages.passages.iter().zip(&gains) {
            let others = held.iter().map(|&of| found[of]);
            let z = change.iter().copied().chain(others);
            let z = DVector::from_iterator(change.len() + held.len(), z);
            let chosen = step + by.columns(0, z.len()) * z;
            for (&choice, value) in passage.chosen.iter().zip(&chosen) {
                found[choice] = *value;
            }
            let acting = passage.acting.iter().map(|&of| found[of]);
            let all =
                DVector::from_iterator(passage.by.ncols(), change.iter().copied().chain(acting));
            change = &passage.by * all;
        }
        // A condition of 1e6 of the matrix, and of each stage's.
        assert!((&found - &wanted).amax() < 1e-7 * wanted.amax(), "{found} {wanted}");
    }
}
