//! plan.json, and the summary on the terminal.

use crate::outcome::Failure;
use serde::Serialize;
use std::fmt::Write as _;
use tumble_plan::{Miss, Mode, Plan, PlanProblem, StageReport};

/// Content of plan.json.
#[derive(Serialize)]
struct PlanReportFile<'a> {
    status: &'static str,
    /// Null if the plan meets all targets.
    reason: Option<&'a str>,
    outcome: &'static str,
    tumble_version: &'static str,
    scene: &'a str,
    steps: usize,
    time_step_s: f64,
    variables: usize,
    cost: f64,
    effort: f64,
    residual_m_s: f64,
    unsolved: usize,
    /// Smallest margin of a contact mode, and its step.
    margin: Option<Margin>,
    targets: Vec<TargetFile<'a>>,
    at_bounds: Vec<String>,
    stages: Vec<StageFile<'a>>,
    /// Numbers of open, sticking and slipping contacts in each step.
    modes: Vec<[usize; 3]>,
}

#[derive(Serialize)]
struct Margin {
    m_s: f64,
    step: usize,
}

#[derive(Serialize)]
struct TargetFile<'a> {
    name: &'a str,
    missed_by: f64,
    tolerance: f64,
    unit: &'static str,
    after: usize,
    met: bool,
}

#[derive(Serialize)]
struct StageFile<'a> {
    name: &'static str,
    iterations: u64,
    runs: u64,
    message: &'a str,
    cost: Option<f64>,
    meets: bool,
    kept: bool,
}

/// Numbers of contacts in each mode, by step.
pub fn modes(plan: &Plan) -> Vec<[usize; 3]> {
    let count = |modes: &Vec<tumble_plan::ContactMode>| {
        [Mode::Open, Mode::Stick, Mode::Slip]
            .map(|mode| modes.iter().filter(|of| of.mode == mode).count())
    };
    plan.replay.modes.iter().map(count).collect()
}

/// Text of plan.json.
pub fn json(problem: &PlanProblem, plan: &Plan, interrupted: bool) -> Result<String, Failure> {
    let replay = &plan.replay;
    let variables = problem.variables();
    let report = PlanReportFile {
        status: plan.status.name(),
        reason: (!plan.reason.is_empty()).then_some(&plan.reason),
        outcome: if interrupted { "interrupted" } else { "complete" },
        tumble_version: env!("CARGO_PKG_VERSION"),
        scene: &problem.scene().name,
        steps: problem.steps(),
        time_step_s: problem.scene().world.time_step(),
        variables: variables.len(),
        cost: replay.cost,
        effort: replay.effort,
        residual_m_s: replay.residual,
        unsolved: replay.unsolved,
        margin: replay.margin.map(|(m_s, step)| Margin { m_s, step }),
        targets: replay.misses.iter().map(target).collect(),
        at_bounds: replay.at_bounds.iter().map(|at| problem.name_of(&variables[*at])).collect(),
        stages: plan.stages.iter().map(stage).collect(),
        modes: modes(plan),
    };
    let text = serde_json::to_string_pretty(&report);
    let text = text.map_err(|error| Failure::Other(format!("plan.json: {error}")))?;
    Ok(text + "\n")
}

fn target(miss: &Miss) -> TargetFile<'_> {
    let Miss { name, by, tolerance, unit, after } = miss;
    TargetFile {
        name,
        missed_by: *by,
        tolerance: *tolerance,
        unit,
        after: *after,
        met: miss.is_met(),
    }
}

fn stage(stage: &StageReport) -> StageFile<'_> {
    StageFile {
        name: stage.name,
        iterations: stage.iterations,
        runs: stage.runs,
        message: &stage.message,
        cost: stage.cost.is_finite().then_some(stage.cost),
        meets: stage.meets,
        kept: stage.kept,
    }
}

/// Summary on the terminal.
pub fn described(problem: &PlanProblem, plan: &Plan) -> String {
    let replay = &plan.replay;
    let (steps, variables) = (problem.steps(), problem.variables().len());
    let mut text = format!(
        "{}: {} after {steps} steps, {variables} variables\n",
        problem.scene().name,
        plan.status
    );
    if !plan.reason.is_empty() {
        let _ = writeln!(text, "  {}", plan.reason);
    }
    for stage in &plan.stages {
        let kept = if stage.kept { "kept" } else { "not kept" };
        let _ = writeln!(
            text,
            "  {:<9} J {:<12.6} {} iterations, {} runs, {kept}: {}",
            stage.name, stage.cost, stage.iterations, stage.runs, stage.message
        );
    }
    let _ = writeln!(
        text,
        "  replay    J {:.6}, effort {:.6}, residual {:.1e} m/s",
        replay.cost, replay.effort, replay.residual
    );
    for Miss { name, by, tolerance, unit, .. } in &replay.misses {
        let _ = writeln!(text, "    {name:<20} off by {by:.3e} {unit} ({tolerance} allowed)");
    }
    if !replay.at_bounds.is_empty() {
        let _ = writeln!(text, "    {} of {variables} variables at bounds", replay.at_bounds.len());
    }
    text
}
