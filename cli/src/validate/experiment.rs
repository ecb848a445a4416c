//! The plan of the runs, its checks before the first run, and the runs.

use crate::args::{Solvers, ValidateArgs};
use crate::outcome::{Failure, refuse_flags};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tumble::solver::ipopt::{
    Formulation, IpoptSolver, MOST_BODIES, MOST_ITERATIONS, TOLERANCE, ladder_for,
};
use tumble::step_nlp::SMOOTHING;
use tumble_core::error::Error;
use tumble_core::solver::native::NativeSolver;
use tumble_core::step::StepSolver;
use tumble_core::world::World;
use tumble_model::shown;
use tumble_validation::{
    ErrorSeries, Input, PROBLEMS, Refusal, ReportedSolver, Runner, TestInputs, TestProblem, Trial,
    find,
};

/// Ipopt's usual step in steps of the problem: it is some thousand times slower.
const IPOPT_STEP: f64 = 5.0;

/// A problem with the inputs it is to be run with.
pub struct ExperimentPlan {
    pub problem: &'static TestProblem,
    pub inputs: TestInputs,
    /// The time step of `--dt`, s.
    step: Option<f64>,
    /// The flags that change something for this problem.
    flags: String,
}

/// Why a run has no findings.
pub enum ExperimentStop {
    Interrupted,
    Failed(Failure),
}

/// The problems that `args` name, or all.
pub fn chosen(args: &ValidateArgs) -> Result<Vec<&'static TestProblem>, Failure> {
    if args.problems.is_empty() {
        return Ok(PROBLEMS.iter().collect());
    }
    let mut chosen: Vec<&'static TestProblem> = Vec::new();
    for name in &args.problems {
        let problem = find(name).ok_or_else(|| {
            let names: Vec<_> = PROBLEMS.iter().map(|problem| problem.name).collect();
            Failure::Input(format!("{name:?} is not a problem; there are {}", names.join(", ")))
        })?;
        if chosen.iter().all(|other| other.name != problem.name) {
            chosen.push(problem);
        }
    }
    Ok(chosen)
}

/// The plan of `args`: every input is one that its problem can be posed with. Problems that no
/// solver of theirs takes are left out.
pub fn plan(args: &ValidateArgs) -> Result<Vec<ExperimentPlan>, Failure> {
    let mut problems = chosen(args)?;
    problems.retain(|problem| each(args.solver).iter().any(|solver| takes(*solver, problem)));
    if problems.is_empty() {
        let left_out = left_out(args)?;
        let why: Vec<_> = left_out.iter().map(|(name, why)| format!("{name}: {why}")).collect();
        return Err(Failure::Input(format!(
            "--solver ipopt: nothing is left; {}; use --solver native",
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

/// The inputs that were given.
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

/// The solvers that `solvers` names, in the order of their runs.
pub fn each(solvers: Solvers) -> &'static [ReportedSolver] {
    match solvers {
        Solvers::Native => &[ReportedSolver::Native],
        Solvers::Ipopt => &[ReportedSolver::Ipopt],
        Solvers::Both => &[ReportedSolver::Native, ReportedSolver::Ipopt],
    }
}

/// Why Ipopt does not take the problem; `None` where it does.
fn beyond_ipopt(problem: &TestProblem) -> Option<String> {
    let bodies = problem.bodies;
    let many = || format!("it has {bodies} bodies, and Ipopt's path takes up to {MOST_BODIES}");
    let why = problem.native_only.map(str::to_owned);
    why.or_else(|| (bodies > MOST_BODIES).then(many))
}

/// Whether `solver` takes the problem.
pub fn takes(solver: ReportedSolver, problem: &TestProblem) -> bool {
    solver == ReportedSolver::Native || beyond_ipopt(problem).is_none()
}

/// The problems of `args` that are not run with Ipopt where it is asked for, each with the reason.
pub fn left_out(args: &ValidateArgs) -> Result<Vec<(&'static str, String)>, Failure> {
    if !each(args.solver).contains(&ReportedSolver::Ipopt) {
        return Ok(Vec::new());
    }
    let problems = chosen(args)?.into_iter();
    Ok(problems.filter_map(|problem| Some((problem.name, beyond_ipopt(problem)?))).collect())
}

/// The flags that set `values` and the step.
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

    /// The steps with which `solver` runs it, each half of the one before.
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

    /// Whether the problem can be posed. Inputs are checked before the first solver is made; this one
    /// gives up there.
    fn check(&self, step: f64) -> Result<(), Failure> {
        let give_up = |_: &World| Err(Error::Interrupted);
        match self.problem.solve(&self.inputs, &mut Runner::new(&give_up, step)) {
            Ok(_) | Err(Refusal::Model(Error::Interrupted)) => Ok(()),
            Err(why) => Err(self.refusal(&why)),
        }
    }

    /// One sentence with the problem, the flags and the reason.
    fn refusal(&self, why: &Refusal) -> Failure {
        let flags = &self.flags;
        let with = if flags.is_empty() { String::new() } else { format!(" with {flags}") };
        let name = self.problem.name;
        Failure::Input(format!("{name}{with}: {why} (or leave this problem out)"))
    }

    /// All runs by `solver`; `done` is called after each.
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

/// The inputs of a problem in words: `mass 2 kg, mu 0.3`.
pub fn inputs_in_words(problem: &TestProblem, inputs: &TestInputs) -> String {
    let word = |&(input, value): &(Input, f64)| {
        let value = shown::number(value);
        format!("{} {value} {}", input.name(), problem.unit(input)).trim_end().to_owned()
    };
    let bodies = problem.bodies;
    let several = (bodies > 1).then(|| format!("{bodies} bodies"));
    inputs.values().iter().map(word).chain(several).collect::<Vec<_>>().join(", ")
}

/// A solver, unless Ctrl-C came before it.
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
        ReportedSolver::Ipopt => {
            let options = IpoptSolver::options(TOLERANCE, MOST_ITERATIONS);
            ladder_for(world, Formulation::default(), options)?
        }
    })
}
