//! Solves a problem, with a probe that can observe and change its callbacks.

use super::problems::Problem;
use tumble::ipopt::{
    IpoptProgress, NonlinearProgram, Options, RawSolver, ReturnStatus, SolveOutcome, StartPoint,
};
use tumble::sparsity::SparsityPattern;

/// Result of a solve, copied out of the solver.
#[derive(Debug, Clone, PartialEq)]
pub struct Answer {
    pub status: ReturnStatus,
    pub iterations: u32,
    pub objective: f64,
    /// x, g, and the multipliers of g, lower and upper bounds.
    pub arrays: [Vec<f64>; 5],
}

impl Answer {
    pub fn from_outcome(outcome: &SolveOutcome<'_>) -> Self {
        let point = outcome.point.expect("a solve that iterated has a point");
        let arrays = [
            point.x,
            point.constraints,
            point.constraint_multipliers,
            point.lower_multipliers,
            point.upper_multipliers,
        ];
        Self {
            status: outcome.status,
            iterations: outcome.iterations,
            objective: point.objective,
            arrays: arrays.map(<[f64]>::to_vec),
        }
    }

    /// All numbers as bits, for exact comparison.
    pub fn bits(&self) -> (i32, u32, Vec<u64>) {
        let numbers = self.arrays.iter().flatten().chain([&self.objective]);
        (self.status.code(), self.iterations, numbers.map(|number| number.to_bits()).collect())
    }

    /// Warm start from this result.
    pub fn as_start(&self) -> StartPoint<'_> {
        let [x, _, constraint_multipliers, lower_multipliers, upper_multipliers] = &self.arrays;
        StartPoint::Warm { x, constraint_multipliers, lower_multipliers, upper_multipliers }
    }
}

pub fn solver(problem: &Problem) -> RawSolver {
    RawSolver::new(problem, Options::default()).unwrap()
}

/// Solves with `solver` from the problem's own start.
pub fn solve_with(solver: &mut RawSolver, problem: &Problem) -> Answer {
    let mut program = problem.clone();
    let start = StartPoint::Cold { x: &problem.start };
    Answer::from_outcome(&solver.solve(&mut program, &problem.bounds, &start).unwrap())
}

pub fn solve(problem: &Problem) -> Answer {
    solve_with(&mut solver(problem), problem)
}

/// Callbacks of a solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Callback {
    Objective,
    Gradient,
    Constraints,
    Jacobian,
    Hessian,
    KeepGoing,
}

pub const CALLBACKS: [Callback; 6] = [
    Callback::Objective,
    Callback::Gradient,
    Callback::Constraints,
    Callback::Jacobian,
    Callback::Hessian,
    Callback::KeepGoing,
];

/// Data of a callback: its kind, the number of earlier calls of that kind, and the values for Ipopt
/// (none for `KeepGoing`), which may be changed.
pub struct Call<'a> {
    pub callback: Callback,
    pub earlier: usize,
    pub values: &'a mut [f64],
    pub progress: Option<&'a IpoptProgress>,
}

/// Problem that shows every callback to `hook`. The hook's return value for `KeepGoing` goes to
/// Ipopt.
pub struct Probe<'a, H> {
    problem: &'a Problem,
    counts: [usize; 6],
    hook: H,
}

impl<'a, H: FnMut(Call<'_>) -> bool> Probe<'a, H> {
    pub fn new(problem: &'a Problem, hook: H) -> Self {
        Self { problem, counts: [0; 6], hook }
    }

    fn show(
        &mut self,
        callback: Callback,
        values: &mut [f64],
        progress: Option<&IpoptProgress>,
    ) -> bool {
        let count = &mut self.counts[callback as usize];
        *count += 1;
        (self.hook)(Call { callback, earlier: *count - 1, values, progress })
    }
}

impl<H: FnMut(Call<'_>) -> bool> NonlinearProgram for Probe<'_, H> {
    fn variable_count(&self) -> usize {
        self.problem.variable_count()
    }
    fn constraint_count(&self) -> usize {
        self.problem.constraint_count()
    }
    fn jacobian_pattern(&self) -> &SparsityPattern {
        &self.problem.jacobian
    }
    fn hessian_pattern(&self) -> &SparsityPattern {
        &self.problem.hessian
    }
    fn objective(&mut self, x: &[f64]) -> f64 {
        let mut value = [(self.problem.objective)(x)];
        self.show(Callback::Objective, &mut value, None);
        value[0]
    }
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]) {
        (self.problem.gradient)(x, gradient);
        self.show(Callback::Gradient, gradient, None);
    }
    fn constraints(&mut self, x: &[f64], constraints: &mut [f64]) {
        (self.problem.constraints)(x, constraints);
        self.show(Callback::Constraints, constraints, None);
    }
    fn jacobian(&mut self, x: &[f64], values: &mut [f64]) {
        (self.problem.jacobian_values)(x, values);
        self.show(Callback::Jacobian, values, None);
    }
    fn hessian(&mut self, x: &[f64], factor: f64, multipliers: &[f64], values: &mut [f64]) {
        (self.problem.hessian_values)(x, factor, multipliers, values);
        self.show(Callback::Hessian, values, None);
    }
    fn keep_going(&mut self, progress: &IpoptProgress) -> bool {
        self.show(Callback::KeepGoing, &mut [], Some(progress))
    }
}
