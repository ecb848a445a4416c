//! The stage `ddp`: closed forms within bounds, starts at rest, and early ends.

use super::{assert_replays, campaign, plan, shipped, told};
use crate::campaign::size;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_plan::file::StageName;
use tumble_plan::{
    Method, Plan, PlanProblem, PlanStatus, SearchProgress, SearchWatch, Shoot, Stage,
};

fn ddp() -> Shoot {
    Shoot { method: Method::DynamicProgramming, ..Shoot::default() }
}

fn by_ddp(problem: &PlanProblem) -> Plan {
    plan(problem, &problem.zero(), &[Box::new(ddp())])
}

/// Checks a flight with minimal effort. In free flight the force of step k moves a body by h²/m (N
/// − k), and the force of a control piece by the sum over its steps. With one target of weight w
/// and an effort e per step, the minimum is
///
/// ```text
/// u = μ Σ a / count  within its bounds,   μ = w (d − Σ a u)/e
/// ```
#[test]
fn a_flight_has_the_least_effort_within_bounds() {
    let scene = "
        time_step = 0.02
        [ground]
        none = true
        friction = 0.5
        [[bodies]]
        box = [0.3, 0.3, 0.2]
        mass = 1.5
        position = [0, 0, 5]
        ";
    let (h, mass, weight, effort) = (0.02, 1.5, 100.0, 1e-4_f64);
    for (steps, knots, most) in [(40, 40, 50.0), (40, 40, 9.0), (40, 7, 50.0), (31, 6, 9.0)] {
        let text = format!(
            "steps = {steps}
            [[controls]]
            kind = \"force\"
            x = [-1, {most}]
            knots = {knots}
            [target]
            x = 2
            weight = {{ position = {weight} }}
            [cost]
            effort = {effort}
            "
        );
        let file = told(scene, &text);
        let found = by_ddp(&file.problem);
        let u = &found.replay.controls;
        let place = found.replay.states[steps][0].position[0];
        let share = weight * (2.0 - place) / effort;
        let mut at_bounds = 0;
        for (knot, u) in u.iter().enumerate() {
            let piece = file.problem.steps_of(0, knot);
            let count = piece.len() as f64;
            let moved: f64 = piece.map(|k| h * h / mass * (steps - k) as f64).sum();
            let wanted = (share * moved / count).clamp(-1.0, most);
            at_bounds += usize::from(wanted == most);
            // The last iterations reduce the cost by less than 1e-10 of it.
            assert!(
                (u - wanted).abs() < 1e-4 * most,
                "{steps} {knots} {most} {knot}: {u} {wanted}"
            );
        }
        assert_eq!(at_bounds > 0, most < 10.0, "{at_bounds}");
        assert_replays(&file, &found);
    }
}

/// Checks starts at rest, where exact derivatives are zero.
#[test]
#[ignore = "slow"]
fn resting_boxes_are_moved_by_the_default_stages() {
    for name in ["slide.toml", "uphill.toml", "push.toml", "planar-push.toml", "lift.toml"] {
        let file = shipped(name);
        let zero = file.problem.zero();
        let least = plan(&file.problem, &zero, &[Box::new(Shoot::default())]);
        assert_eq!(least.status, PlanStatus::Missed);
        let found = by_ddp(&file.problem);
        assert_eq!(found.status, PlanStatus::Replayed, "{name}: {}", found.reason);
        assert_eq!(found.stages[0].name, "ddp");
        assert!(found.replay.residual < 1e-9, "{name}");
    }
}

/// Checks a target on a body that no control can move.
#[test]
fn body_that_no_control_moves_is_reported() {
    let scene = "
        time_step = 0.02
        [ground]
        friction = 0.4
        [[bodies]]
        name = \"box\"
        box = [0.3, 0.3, 0.2]
        mass = 1.0
        position = [0, 0, 0.1]
        [[bodies]]
        name = \"other\"
        box = [0.3, 0.3, 0.2]
        mass = 1.0
        position = [2, 0, 0.1]
        ";
    let text = "
        steps = 10
        [[controls]]
        kind = \"force\"
        body = \"other\"
        x = [-9, 9]
        [target]
        body = \"box\"
        x = 1
        ";
    let found = by_ddp(&told(scene, text).problem);
    assert_eq!(found.status, PlanStatus::Missed);
    assert!(found.reason.contains("all derivatives are zero"), "{}", found.reason);
}

/// Plans random pushes from zero forces.
#[test]
#[ignore = "slow"]
fn random_pushes_are_planned() {
    campaign(11, size(5, 50), &[StageName::Ddp]);
}

/// Checks that the stage stops on request and returns its best result. An interrupt ends it within
/// an iteration.
#[test]
fn ddp_stops_on_interrupt_and_on_callback() {
    let file = shipped("push.toml");
    let zero = file.problem.zero();
    let stages: [Box<dyn Stage>; 1] = [Box::new(ddp())];
    let interrupt = Arc::new(AtomicBool::new(false));
    let mut best = f64::INFINITY;
    for raises in [false, true] {
        let mut progress = |progress: &SearchProgress<'_>| {
            best = progress.cost;
            let ends = progress.iteration >= 7;
            interrupt.store(ends && raises, std::sync::atomic::Ordering::Relaxed);
            !ends || raises
        };
        let mut watch = SearchWatch { interrupt: &interrupt, progress: &mut progress };
        let found = file.problem.plan(&zero, &stages, &mut watch).unwrap();
        assert!(found.stages[0].iterations < 12, "{}", found.stages[0].iterations);
        assert_eq!(found.replay.cost, best);
    }
}
