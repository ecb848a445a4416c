//! The path of programs.

use super::candidates::{candidates, missing};
use super::shift::Shift;
use super::smoothing::Smoothing;
use super::staged::PlanNlp;
use crate::contact::{Contact, ContactKey};
use crate::error::Error;
use crate::ipopt::{
    BarrierStrategy, IpoptError, NonlinearProgram, Options, Progress as Iteration, ReturnStatus,
    Solver, StartPoint,
};
use crate::plan::{Leg, LegEnd, PlanError, Problem, Progress, Replay, Watch};
use crate::sparsity::SparsityPattern;
use std::cell::Cell;

/// The leg `program`.
#[derive(Debug, Clone)]
pub struct ProgramLeg {
    /// The path.
    pub path: Vec<Smoothing>,
    /// Iterations of one program, at most.
    pub most_iterations: u32,
    /// How often it is posed anew with contacts that its replay has and it had not.
    pub rounds: usize,
}

/// δ of the path from a start of which nothing is known.
const PATH: [f64; 6] = [1e-2, 1e-3, 1e-4, 1e-6, 1e-8, 1e-10];
const COMPLIANCE: f64 = 1e-3;
/// δ with which the path begins at what meets all targets.
const NEAR: f64 = 1e-4;

impl Default for ProgramLeg {
    fn default() -> Self {
        let path = PATH.map(|delta| Smoothing { delta, compliance: COMPLIANCE });
        Self { path: path.to_vec(), most_iterations: 500, rounds: 3 }
    }
}

impl Leg for ProgramLeg {
    fn name(&self) -> &'static str {
        "program"
    }

    fn run(
        &self,
        problem: &Problem,
        from: &Replay,
        watch: &mut Watch<'_>,
    ) -> Result<LegEnd, PlanError> {
        or_refused(self.search(problem, from, watch), from)
    }
}

impl ProgramLeg {
    fn search(
        &self,
        problem: &Problem,
        from: &Replay,
        watch: &mut Watch<'_>,
    ) -> Result<LegEnd, PlanError> {
        let mut end = LegEnd { controls: from.controls.clone(), ..LegEnd::default() };
        let mut start = from.clone();
        let mut admitted: Vec<ContactKey> = Vec::new();
        // Near a solution already: not from the beginning of the path, which would leave it.
        let near = self.path.iter().position(|smoothing| smoothing.delta <= NEAR).unwrap_or(0);
        let mut path = if from.meets() { &self.path[near..] } else { &self.path[..] };
        for round in 0..self.rounds.max(1) {
            let contacts = candidates(&problem.scene().world, &start, &admitted);
            let (replay, goes_on) =
                self.follow(problem, (&start, &contacts), path, watch, &mut end)?;
            let Some(replay) = replay.filter(|_| goes_on) else { break };
            let more = missing(&replay, &contacts);
            if more.is_empty() {
                break;
            }
            if round + 1 < self.rounds {
                end.message.push_str("; posed anew with other contacts");
            }
            admitted.extend(more);
            path = &self.path[near..];
            start = replay;
        }
        Ok(end)
    }

    /// Follows `path` from a replay with the contacts of its steps; the replay of its end, and whether to go on.
    fn follow(
        &self,
        problem: &Problem,
        (from, contacts): (&Replay, &[Vec<Contact>]),
        path: &[Smoothing],
        watch: &mut Watch<'_>,
        end: &mut LegEnd,
    ) -> Result<(Option<Replay>, bool), PlanError> {
        let Some(first) = path.first() else { return Ok((None, false)) };
        let mut program = PlanNlp::smoothed_with(problem, from, contacts, *first)?;
        program.set_factor(1.0 / usual_cost(problem, from)?);
        let mut at = Solved { x: program.path_point_of(from), multipliers: None };
        let (mut best, mut goes_on) = (None::<Replay>, true);
        for (stage, smoothing) in path.iter().enumerate() {
            program.smooth(*smoothing);
            let options = Options {
                tolerance: 1e-8,
                max_iterations: self.most_iterations,
                barrier: BarrierStrategy::Adaptive,
                initial_barrier: if stage == 0 && smoothing.delta > NEAR { 0.1 } else { 1e-4 },
                mumps_pivot_order: MINIMUM_FILL,
                mumps_scaling: UNSCALED,
                ..Options::default()
            };
            let known = best.as_ref().unwrap_or(from);
            let told = Told { leg: "program", done: end.iterations, controls: &known.controls };
            let (status, iterations, stopped) = solve(&mut program, &mut at, options, told, watch)?;
            end.iterations += u64::from(iterations);
            end.message = format!("{} at smoothing {:e}", status.name(), smoothing.delta);
            goes_on = !stopped;
            let replay = problem.replay(&program.controls(&at.x))?;
            end.runs += 1;
            if best.as_ref().is_none_or(|best| replay.is_better(best)) {
                end.controls.clone_from(&replay.controls);
                end.cost = Some(program.cost(&at.x));
                end.states = Some(program.states(&at.x));
                best = Some(replay);
            }
            if stopped || !status.is_success() {
                break;
            }
        }
        Ok((best, goes_on))
    }
}

/// What a leg comes to; of a problem that it cannot pose where it began, with why: other legs may go on.
pub(crate) fn or_refused(
    end: Result<LegEnd, PlanError>,
    from: &Replay,
) -> Result<LegEnd, PlanError> {
    match end {
        Err(PlanError::Problem(message)) => {
            Ok(LegEnd { controls: from.controls.clone(), message, ..LegEnd::default() })
        }
        end => end,
    }
}

/// MUMPS's ordering for programs of many stages: approximate minimum fill. With that of minimum degree, for small problems, more pivots are
/// put off; METIS is not in Debian's MUMPS, which takes this one in its place.
pub(crate) const MINIMUM_FILL: u32 = 2;

/// MUMPS's matrix as it is. With MUMPS's own scaling an iteration of `stop.toml` takes up to 0.3 s in place of 10 ms: nearly all of it in dense
/// products of large fronts, as where pivots are put off from front to front.
pub(crate) const UNSCALED: u32 = 0;

/// What the cost is measured with, so that it is of order 1: that of the start or, of a start that is good, a part of that of no
/// controls.
pub(crate) fn usual_cost(problem: &Problem, from: &Replay) -> Result<f64, PlanError> {
    let idle = problem.replay(&problem.zero())?.cost;
    Ok(from.cost.max(1e-2 * idle).max(1e-6))
}

/// A point of a program with its multipliers, where it is known.
pub(crate) struct Solved {
    pub(crate) x: Vec<f64>,
    /// Of rows, of lower and of upper bounds.
    pub(crate) multipliers: Option<[Vec<f64>; 3]>,
}

/// Who is told of iterations: the leg, its iterations so far, and its best controls.
pub(crate) struct Told<'a> {
    pub(crate) leg: &'static str,
    pub(crate) done: u64,
    pub(crate) controls: &'a [f64],
}

/// Solves `program` from `at`, which becomes its end: how it ended, its iterations, whether it was stopped.
pub(crate) fn solve(
    program: &mut PlanNlp<'_>,
    at: &mut Solved,
    options: Options,
    told: Told<'_>,
    watch: &mut Watch<'_>,
) -> Result<(ReturnStatus, u32, bool), PlanError> {
    let bounds = program.bounds().clone();
    let x = at.x.clone();
    let start = match &at.multipliers {
        None => StartPoint::Cold { x: &x },
        Some([rows, lower, upper]) => StartPoint::Warm {
            x: &x,
            constraint_multipliers: rows,
            lower_multipliers: lower,
            upper_multipliers: upper,
        },
    };
    let stopped = Cell::new(false);
    let shift = Shift::new(program.hessian_pattern(), program.variables());
    let mut watched = Watched { program, shift, told, watch, stopped: &stopped };
    let mut solver = Solver::new(&watched, options).map_err(failed)?;
    let outcome = solver.solve(&mut watched, &bounds, &start).map_err(failed)?;
    let (status, iterations) = (outcome.status, outcome.iterations);
    if let Some(point) = outcome.point {
        at.x = point.x.to_vec();
        at.multipliers = Some([
            point.constraint_multipliers.to_vec(),
            point.lower_multipliers.to_vec(),
            point.upper_multipliers.to_vec(),
        ]);
    }
    Ok((status, iterations, stopped.get()))
}

fn failed(error: IpoptError) -> PlanError {
    PlanError::Step(Error::from(error))
}

/// A program as Ipopt's wrapper takes it, with who watches.
struct Watched<'a, 'p, 'w> {
    program: &'a PlanNlp<'p>,
    shift: Shift,
    told: Told<'a>,
    watch: &'a mut Watch<'w>,
    stopped: &'a Cell<bool>,
}

impl NonlinearProgram for Watched<'_, '_, '_> {
    fn keep_going(&mut self, iteration: &Iteration) -> bool {
        self.shift.follow((!iteration.in_restoration).then_some(iteration.regularization));
        let progress = Progress {
            leg: self.told.leg,
            iteration: self.told.done + u64::from(iteration.iteration),
            cost: self.program.unscaled(iteration.objective),
            controls: self.told.controls,
        };
        let goes_on = self.watch.goes_on(&progress);
        self.stopped.set(!goes_on);
        goes_on
    }

    fn variable_count(&self) -> usize {
        self.program.variables()
    }

    fn constraint_count(&self) -> usize {
        self.program.rows()
    }

    fn jacobian_pattern(&self) -> &SparsityPattern {
        self.program.jacobian_pattern()
    }

    fn hessian_pattern(&self) -> &SparsityPattern {
        self.shift.pattern()
    }

    fn objective(&mut self, x: &[f64]) -> f64 {
        self.program.objective(x)
    }

    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        self.program.gradient(x, gradient);
    }

    fn constraints(&mut self, x: &[f64], constraints: &mut [f64]) {
        self.program.constraints(x, constraints);
    }

    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        self.program.jacobian(x, values);
    }

    fn hessian(&mut self, x: &[f64], factor: f64, multipliers: &[f64], values: &mut [f64]) {
        let program = self.program;
        self.shift.fill(values, |own| program.hessian(x, factor, multipliers, own));
    }
}
