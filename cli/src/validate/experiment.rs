//! Plan of the validation runs, checks before the first run, and the runs.

use crate::args::{Solvers, ValidateArgs};
use crate::outcome::{Failure, refuse_flags};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble::solver::MOST_BODIES;
use tumble::step_nlp::SMOOTHING;
use tumble_core::error::Error;
use tumble_core::solver::native::NativeSolver;
use tumble_core::step::StepSolver;
use tumble_core::world::World;
use tumble_model::shown;
use tumble_scene::solver_choice::{IPOPT_VERSION, ipopt_ladder};
use tumble_validation::{
    ErrorSeries, Input, PROBLEMS, Refusal, ReportedSolver, Runner, TestInputs, TestProblem, Trial,
    find,
};

/// Ipopt's default time step in default steps of the problem. Ipopt is some thousand times slower.
const IPOPT_STEP: f64 = 5.0;

/// A problem with the inputs of its runs.
pub struct ExperimentPlan {
    pub problem: &'static TestProblem,
    pub inputs: TestInputs,
    /// Time step of `--dt`, s.
    step: Option<f64>,
    /// Flags with an effect on this problem.
    flags: String,
}

/// Reason why a run has no result.
pub enum ExperimentStop {
    Interrupted,
    Failed(Failure),
}

/// Problems named in `args`, or all.
pub fn chosen(args: &ValidateArgs) -> Result<Vec<&'static TestProblem>, Failure> {
    if args.problems.is_empty() {
        return Ok(PROBLEMS.iter().collect());
    }
    let mut chosen: Vec<&'static TestProblem> = Vec::new();
    for name in &args.problems {
        let problem = find(name).ok_or_else(|| {
            let names: Vec<_> = PROBLEMS.iter().map(|problem| problem.name).collect();
            Failure::Input(format!(
                "unknown problem {name:?}; expected one of {}",
                names.join(", ")
            ))
        })?;
        if chosen.iter().all(|other| other.name != problem.name) {
            chosen.push(problem);
        }
    }
    Ok(chosen)
}

/// Plans the runs and checks that every problem accepts its inputs. Problems without a suitable
/// solver are left out.
pub fn plan(args: &ValidateArgs) -> Result<Vec<ExperimentPlan>, Failure> {
    let mut problems = chosen(args)?;
    problems.retain(|problem| each(args.solver).iter().any(|solver| takes(*solver, problem)));
    if problems.is_empty() {
        let left_out = left_out(args)?;
        let why: Vec<_> = left_out.iter().map(|(name, why)| format!("{name}: {why}")).collect();
        return Err(Failure::Input(format!(
            "--solver ipopt: no problem is left; {}; use --solver native",
            why.join("; ")
        )));
    }
    let given = given(args);
    for (input, _) in &given {
        let idle = !problems.iter().any(|problem| problem.inputs().has(*input));
        let names: Vec<_> = problems.iter().map(|problem| problem.name).collect();
        refuse_flags(&names.join(", "), &[(&format!("--{}", input.name()), idle)])?;
    }
    let plans: Vec<_> =
        problems.into_iter().map(|problem| ExperimentPlan::new(problem, &given, args.dt)).collect();
    for plan in &plans {
        for solver in each(args.solver).iter().filter(|solver| takes(**solver, plan.problem)) {
            for step in plan.time_steps(*solver) {
                plan.check(step)?;
            }
        }
    }
    Ok(plans)
}

/// Inputs set by flags.
pub fn given(args: &ValidateArgs) -> Vec<(Input, f64)> {
    let value = |input| match input {
        Input::Mass => args.mass,
        Input::Friction => args.mu,
        Input::Restitution => args.restitution,
        Input::Gravity => args.gravity,
        Input::Slope => args.slope,
        Input::Speed => args.speed,
    };
    Input::ALL.iter().filter_map(|&input| Some((input, value(input)?))).collect()
}

/// Solvers selected by `solvers`, in the order of their runs. In a build without Ipopt, both are the
/// native solver.
pub fn each(solvers: Solvers) -> &'static [ReportedSolver] {
    match solvers {
        Solvers::Both if IPOPT_VERSION.is_empty() => &[ReportedSolver::Native],
        Solvers::Native => &[ReportedSolver::Native],
        Solvers::Ipopt => &[ReportedSolver::Ipopt],
        Solvers::Both => &[ReportedSolver::Native, ReportedSolver::Ipopt],
    }
}

/// Reason why Ipopt cannot solve the problem, or `None`.
fn beyond_ipopt(problem: &TestProblem) -> Option<String> {
    let bodies = problem.bodies;
    let many = || format!("it has {bodies} bodies, and Ipopt solves at most {MOST_BODIES}");
    let why = problem.native_only.map(str::to_owned);
    why.or_else(|| (bodies > MOST_BODIES).then(many))
}

/// True if `solver` can solve the problem.
pub fn takes(solver: ReportedSolver, problem: &TestProblem) -> bool {
    solver == ReportedSolver::Native || beyond_ipopt(problem).is_none()
}

/// Problems that Ipopt cannot solve, with reasons. Empty if Ipopt is not selected.
pub fn left_out(args: &ValidateArgs) -> Result<Vec<(&'static str, String)>, Failure> {
    if !each(args.solver).contains(&ReportedSolver::Ipopt) {
        return Ok(Vec::new());
    }
    let problems = chosen(args)?.into_iter();
    Ok(problems.filter_map(|problem| Some((problem.name, beyond_ipopt(problem)?))).collect())
}

/// Flags for `values` and the time step.
pub fn flags(values: &[(Input, f64)], step: Option<f64>) -> String {
    let given = values.iter().map(|&(input, value)| (input.name(), value));
    let flag = |(name, value)| format!("--{name} {}", shown::number(value));
    given.chain(step.map(|step| ("dt", step))).map(flag).collect::<Vec<_>>().join(" ")
}

impl ExperimentPlan {
    fn new(problem: &'static TestProblem, given: &[(Input, f64)], step: Option<f64>) -> Self {
        let mut inputs = problem.inputs();
        let mut used = given.to_vec();
        used.retain(|(input, _)| inputs.has(*input));
        for &(input, value) in &used {
            inputs.set(input, value);
        }
        Self { problem, inputs, step, flags: flags(&used, step) }
    }

    /// Time steps of the runs with `solver`, s. Each is half of the previous one.
    pub fn time_steps(&self, solver: ReportedSolver) -> Vec<f64> {
        let usual = self.inputs.time_step;
        match solver {
            ReportedSolver::Native => {
                let step = self.step.unwrap_or(usual);
                vec![step, 0.5 * step, 0.25 * step]
            }
            ReportedSolver::Ipopt => {
                let step = self.step.unwrap_or(IPOPT_STEP * usual);
                vec![step, 0.5 * step]
            }
        }
    }

    /// Checks the inputs of the problem. They are checked before the first solver is created, where
    /// this check aborts.
    fn check(&self, step: f64) -> Result<(), Failure> {
        let give_up = |_: &World| Err(Error::Interrupted);
        match self.problem.solve(&self.inputs, &mut Runner::new(&give_up, step)) {
            Ok(_) | Err(Refusal::Model(Error::Interrupted)) => Ok(()),
            Err(why) => Err(self.refusal(&why)),
        }
    }

    /// Error message with the problem, the flags and the reason.
    fn refusal(&self, why: &Refusal) -> Failure {
        let flags = &self.flags;
        let with = if flags.is_empty() { String::new() } else { format!(" with {flags}") };
        let name = self.problem.name;
        Failure::Input(format!("{name}{with}: {why} (or leave this problem out)"))
    }

    /// Runs the problem with `solver` at all time steps, and calls `done` after each.
    pub fn run(
        &self,
        solver: ReportedSolver,
        interrupt: &Arc<AtomicBool>,
        done: impl Fn(),
    ) -> Result<ErrorSeries, ExperimentStop> {
        let make = |world: &World| make_solver(solver, world, interrupt);
        let smoothing = if solver == ReportedSolver::Ipopt { SMOOTHING } else { 0.0 };
        let mut trials = Vec::new();
        for time_step in self.time_steps(solver) {
            let runner = Runner::new(&make, time_step).smoothed(smoothing);
            let mut runner = runner.interrupted_by(Arc::clone(interrupt));
            let findings = match self.problem.solve(&self.inputs, &mut runner) {
                Ok(findings) => findings,
                Err(Refusal::Model(Error::Interrupted)) => return Err(ExperimentStop::Interrupted),
                Err(why) => return Err(ExperimentStop::Failed(self.refusal(&why))),
            };
            trials.push(Trial { time_step, findings, counts: runner.counts });
            done();
        }
        Ok(ErrorSeries { solver, trials })
    }
}

/// Text of a problem's inputs: `mass 2 kg, mu 0.3`.
pub fn inputs_in_words(problem: &TestProblem, inputs: &TestInputs) -> String {
    let word = |&(input, value): &(Input, f64)| {
        let value = shown::number(value);
        format!("{} {value} {}", input.name(), problem.unit(input)).trim_end().to_owned()
    };
    let bodies = problem.bodies;
    let several = (bodies > 1).then(|| format!("{bodies} bodies"));
    inputs.values().iter().map(word).chain(several).collect::<Vec<_>>().join(", ")
}

/// Creates a solver, unless the run was interrupted.
fn make_solver(
    solver: ReportedSolver,
    world: &World,
    interrupt: &Arc<AtomicBool>,
) -> Result<Box<dyn StepSolver>, Error> {
    if interrupt.load(Ordering::Relaxed) {
        return Err(Error::Interrupted);
    }
    Ok(match solver {
        ReportedSolver::Native => Box::new(NativeSolver::new(world)),
        ReportedSolver::Ipopt => ipopt_ladder(world)?,
    })
}
