//! plan.html: the plan as a page.

use tumble_plan::{ContactMode, Miss, Mode, Plan, PlanProblem, PlanStatus, StageReport};
use tumble_view::plan::{Path, PlanReport, PlanStage, PlanTarget, PlanTouch, page as drawn};

/// Page of a plan, with the `costs` of all iterations.
pub fn page(problem: &PlanProblem, plan: &Plan, costs: Vec<f64>) -> String {
    let (replay, scene) = (&plan.replay, problem.scene());
    let (first, h) = (scene.start_index, scene.world.time_step());
    let mut least = f64::INFINITY;
    let progress = costs.into_iter().map(|cost| {
        least = least.min(cost);
        least
    });
    let paths = scene.bodies.iter().enumerate().map(|(body, name)| Path {
        body: name.clone(),
        points: replay.states.iter().map(|states| states[body].position.into()).collect(),
    });
    drawn(&PlanReport {
        program: format!("tumble {}", env!("CARGO_PKG_VERSION")),
        name: scene.name.clone(),
        status: (plan.status.name().to_owned(), plan.status == PlanStatus::Replayed),
        reason: plan.reason.clone(),
        stages: plan.stages.iter().map(stage).collect(),
        targets: replay.misses.iter().map(target).collect(),
        progress: progress.filter(|cost| cost.is_finite()).collect(),
        times: (0..=problem.steps()).map(|k| (first + k as u64) as f64 * h).collect(),
        controls: controls(problem, &replay.controls),
        contacts: contacts(problem, &replay.modes),
        paths: paths.collect(),
    })
}

fn stage(stage: &StageReport) -> PlanStage {
    PlanStage {
        name: stage.name.to_owned(),
        cost: stage.cost,
        counts: [stage.iterations, stage.runs],
        message: stage.message.clone(),
        kept: stage.kept,
    }
}

fn target(miss: &Miss) -> PlanTarget {
    PlanTarget {
        name: miss.name.clone(),
        miss: [miss.by, miss.tolerance],
        unit: miss.unit.to_owned(),
    }
}

/// Curves of the components with several pieces.
fn controls(problem: &PlanProblem, numbers: &[f64]) -> Vec<(String, Vec<f64>)> {
    let first = problem.variables().iter().filter(|variable| variable.knot == 0);
    let varies = first.filter(|variable| problem.controls()[variable.control].knots > 1);
    let curve = |variable: &tumble_plan::Variable| {
        let kind = &problem.controls()[variable.control].kind;
        let name = &problem.controls()[variable.control].name;
        let (component, unit) =
            (kind.components()[variable.component], kind.unit(variable.component));
        let unit = if unit.is_empty() { String::new() } else { format!(" ({unit})") };
        let at = |step| {
            let knot = problem.knot(variable.control, step);
            problem.numbers(variable.control, knot, numbers).0[variable.component]
        };
        (format!("{name}.{component}{unit}"), (0..problem.steps()).map(at).collect())
    };
    varies.map(curve).collect()
}

/// Modes over the steps of each contact with a force in some step, in the order of the keys.
fn contacts(problem: &PlanProblem, modes: &[Vec<ContactMode>]) -> Vec<(String, Vec<PlanTouch>)> {
    let scene = problem.scene();
    let pressing = modes.iter().flatten().filter(|of| of.mode != Mode::Open);
    let mut keys: Vec<_> = pressing.map(|of| of.key).collect();
    keys.sort_unstable();
    keys.dedup();
    let line = |key: &tumble_core::contact::ContactKey| {
        let name = format!("{} {}", scene.bodies[key.body], key.point);
        let touch = |modes: &Vec<ContactMode>| match modes
            .iter()
            .find(|of| of.key == *key)
            .map(|of| of.mode)
        {
            Some(Mode::Stick) => PlanTouch::Stick,
            Some(Mode::Slip) => PlanTouch::Slip,
            Some(Mode::Open) | None => PlanTouch::Open,
        };
        (name, modes.iter().map(touch).collect())
    };
    keys.iter().map(line).collect()
}
