//! Plans by the program of N steps: its derivatives against central differences, the problems of docs/planning.md, and the
//! freedom that a program without compliance has.

mod casadi;
mod scenes;

use crate::common::cases;
use crate::slopes::{Program, hessian_error, jacobian_error};
use proptest::prelude::*;
use scenes::{CARRIED, DRIVEN, EVERYTHING, GEARED, PULLED, SEVERAL, TIED, TURNED};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::plan::file::ProblemFile;
use tumble::plan::program::{PlanNlp, ProgramLeg, Smoothing};
use tumble::plan::{DrivePart, Leg, Plan, PlanStatus, Polish, Problem, Shoot, Side, Watch};
use tumble::scenario::scene::Scene;
use tumble::scenario::settings::Settings;
use tumble::sparsity::SparsityPattern;

fn problem(scene: &str, text: &str) -> ProblemFile {
    let nothing = &mut |_: &Path, _| unreachable!();
    let scene = Scene::of_text(scene, Path::new("scene"), Settings::default(), nothing);
    let scene = scene.unwrap_or_else(|failure| panic!("{failure:?}"));
    ProblemFile::of_scene_text(scene, &format!("scene = \"scene\"\n{text}")).unwrap()
}

/// A problem of `scenarios/plans`.
fn shipped(name: &str) -> Problem {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/plans").join(name);
    let text = std::fs::read_to_string(&path).unwrap();
    let read = &|path: &Path, _: u64| std::fs::read(path);
    ProblemFile::of_text(&text, &path, read).unwrap_or_else(|why| panic!("{why:?}")).problem
}

fn plan(problem: &Problem, start: &[f64], legs: &[Box<dyn Leg>]) -> Plan {
    let interrupt = Arc::new(AtomicBool::new(false));
    let mut watch = Watch { interrupt: &interrupt, progress: &mut |_| true };
    problem.plan(start, legs, &mut watch).unwrap()
}

struct Whole<'p>(PlanNlp<'p>);

impl Program for Whole<'_> {
    fn gradient_at(&self, x: &[f64]) -> Vec<f64> {
        let mut gradient = vec![f64::NAN; x.len()];
        self.0.gradient(x, &mut gradient);
        gradient
    }

    fn constraints_at(&self, x: &[f64]) -> Vec<f64> {
        let mut rows = vec![f64::NAN; self.0.rows()];
        self.0.constraints(x, &mut rows);
        rows
    }

    fn jacobian_at(&self, x: &[f64]) -> Vec<f64> {
        let mut values = vec![f64::NAN; self.0.jacobian_pattern().len()];
        self.0.jacobian(x, &mut values);
        values
    }

    fn hessian_at(&self, x: &[f64], factor: f64, multipliers: &[f64]) -> Vec<f64> {
        let mut values = vec![f64::NAN; self.0.hessian_pattern().len()];
        self.0.hessian(x, factor, multipliers, &mut values);
        values
    }

    fn patterns(&self) -> [&SparsityPattern; 2] {
        [self.0.jacobian_pattern(), self.0.hessian_pattern()]
    }
}

/// Smoothed by so much that differences can follow.
const SMOOTH: Smoothing = Smoothing { delta: 25.0, compliance: 0.3 };

proptest! {
    #![proptest_config(cases(24))]

    #[test]
    fn derivatives_are_slopes(
        numbers in proptest::collection::vec(-1.0..1.0, 800),
        factor in 0.0..2.0,
        fixed in any::<bool>(),
        which in 0..4_usize,
    ) {
        let (scene, sought) =
            [(SEVERAL, EVERYTHING), (TIED, DRIVEN), (CARRIED, PULLED), (GEARED, TURNED)][which];
        let problem = problem(scene, sought).problem;
        let replay = problem.replay(&problem.zero()).unwrap();
        let nlp = match fixed {
            false => PlanNlp::smoothed(&problem, &replay, SMOOTH),
            true => PlanNlp::with_modes(&problem, &replay, 0.3),
        };
        let nlp = Whole(nlp.unwrap());
        let x: Vec<_> = (0..nlp.0.variables()).map(|i| numbers[i % 701] + 0.3).collect();
        let y: Vec<_> = (0..nlp.0.rows()).map(|i| numbers[(i + 97) % 797]).collect();
        let error = jacobian_error(&nlp, &x);
        prop_assert!(error < 1e-7, "{error:e}");
        for (row, col) in nlp.0.hessian_pattern().positions() {
            prop_assert!(row >= col, "({row}, {col}) is above the diagonal");
        }
        let error = hessian_error(&nlp, &x, factor, &y);
        prop_assert!(error < 1e-7, "{error:e}");
    }
}

/// Fixed bounds of a row, and how far its value is outside.
fn outside(nlp: &PlanNlp<'_>, x: &[f64]) -> f64 {
    let mut rows = vec![f64::NAN; nlp.rows()];
    nlp.constraints(x, &mut rows);
    let bounds = nlp.bounds();
    let ends = bounds.constraint_lower.iter().zip(&bounds.constraint_upper);
    let off = rows.iter().zip(ends).map(|(value, (low, high))| (low - value).max(value - high));
    off.fold(0.0, |most, off| if off <= most { most } else { off })
}

/// A run of the simulator obeys the rows of its own modes.
#[test]
fn a_run_obeys_the_rows() {
    for (name, size) in [
        ("slide.toml", 6.0),
        ("push.toml", 3.0),
        ("flip.toml", 0.7),
        ("hop.toml", 8.0),
        ("throw.toml", 1.0),
        ("hit.toml", 3.0),
    ] {
        let problem = shipped(name);
        let start: Vec<_> = (0..problem.variables().len())
            .map(|i| size * f64::from(i as u32 * 7 % 5) / 4.0)
            .collect();
        let replay = problem.replay(&start).unwrap();
        let nlp = PlanNlp::with_modes(&problem, &replay, 0.0).unwrap();
        let off = outside(&nlp, &nlp.point_of(&replay));
        assert!(off < 1e-9, "{name}: {off:e}");
    }
}

/// So does one of joints, whose drives are on every side of their bounds in it.
#[test]
fn a_run_of_joints_obeys_the_rows() {
    let mut seen = std::collections::HashSet::new();
    let tied = problem(TIED, DRIVEN.replace("steps = 3", "steps = 40").as_str()).problem;
    let carried = problem(CARRIED, PULLED.replace("steps = 3", "steps = 40").as_str()).problem;
    let geared = problem(GEARED, TURNED.replace("steps = 3", "steps = 40").as_str()).problem;
    for (name, problem) in [
        ("swing-up", shipped("swing-up.toml")),
        ("leap", shipped("leap.toml")),
        ("tied", tied),
        ("carried", carried),
        ("geared", geared),
    ] {
        let start: Vec<_> = problem
            .variables()
            .iter()
            .enumerate()
            .map(|(i, of)| of.bounds[0] + of.scale() * (0.5 + 0.45 * (1.7 * i as f64).sin()))
            .collect();
        let replay = problem.replay(&start).unwrap();
        seen.extend(replay.modes.axes.iter().flatten().map(|of| (of.part, of.side)));
        let nlp = PlanNlp::with_modes(&problem, &replay, 0.0).unwrap();
        let x = nlp.point_of(&replay);
        let off = outside(&nlp, &x);
        assert!(off < 1e-8, "{name}: {off:e}");
        let bounds = nlp.bounds().lower.iter().zip(&nlp.bounds().upper);
        let beyond = x.iter().zip(bounds).map(|(x, (low, high))| (low - x).max(x - high));
        let beyond = beyond.fold(0.0, f64::max);
        assert!(beyond < 1e-9, "{name}: {beyond:e}");
    }
    assert!(seen.len() >= 7, "{seen:?}");
}

fn legs() -> Vec<Box<dyn Leg>> {
    vec![Box::new(ProgramLeg::default()), Box::new(Polish::default())]
}

fn exact(name: &str, start: Option<&[f64]>) -> Plan {
    let problem = shipped(name);
    let found = plan(&problem, start.unwrap_or(&problem.zero()), &legs());
    assert_eq!(found.status, PlanStatus::Exact, "{name}: {} {:?}", found.reason, found.legs);
    assert!(found.apart.unwrap() <= 1e-9);
    assert!(found.replay.residual < 1e-9);
    found
}

/// A motor at a wheel moves a nut by a gear of 0.15 m/rad, 0.09 m along x where its guide leans by 3 to 4: the wheel turns by a radian, the
/// arm that it carries back by 2.5.
#[test]
fn a_wheel_moves_a_nut_by_its_gear() {
    let problem = problem(GEARED, &TURNED.replace("steps = 3", "steps = 80")).problem;
    let found = plan(&problem, &problem.zero(), &legs());
    assert_eq!(found.status, PlanStatus::Exact, "{} {:?}", found.reason, found.legs);
    let end = &found.replay.states[80];
    let turn = |of: usize| 2.0 * f64::atan2(end[of].attitude[2], end[of].attitude[0]);
    let place = end[1].position[0] - 1.0;
    assert!((place - 0.09).abs() < 1e-3, "{place}");
    let wheel = place / 0.6 / 0.15;
    // A residual of 1e-9 m/s or rad/s over lengths of 0.1 m.
    assert!((turn(0) - wheel).abs() < 1e-8, "{} {wheel}", turn(0));
    assert!((turn(2) - (1.0 - 2.5) * wheel).abs() < 1e-8, "{} {wheel}", turn(2));
}

/// A box is pulled over a tray that goes, turns and rises (at 0.05 m/s where it ends) beneath it, and its plan is a run.
#[test]
fn a_box_is_pulled_over_a_driven_tray() {
    let problem = problem(CARRIED, &PULLED.replace("steps = 3", "steps = 25")).problem;
    let found = plan(&problem, &problem.zero(), &legs());
    assert_eq!(found.status, PlanStatus::Exact, "{} {:?}", found.reason, found.legs);
    assert!(found.replay.residual < 1e-9);
    // At 0.5 s, three quarters of the way between two knots.
    let tray = found.replay.states[25][0].position;
    assert!((tray - nalgebra::Vector3::new(0.325, 0.0375, 0.315)).norm() < 1e-9, "{tray}");
}

/// With m steps at a speed above 0 it comes to d = h (m v₀ − h μ g m (m + 1)/2).
#[test]
fn the_start_that_stops_at_a_place_is_that_of_the_sum() {
    let found = exact("stop.toml", Some(&[2.0]));
    let (h, lost) = (0.02, 0.02 * 0.4 * 9.81);
    let speed = |m: f64| (1.0 / h + lost * m * (m + 1.0) / 2.0) / m;
    let m = (1..100).map(f64::from).find(|m| (speed(*m) / lost).floor() == *m).unwrap();
    let v = found.replay.controls[0];
    assert!((v - speed(m)).abs() < 1e-9, "{v} {}", speed(m));
}

/// From no force at all, where no exact derivative leads away.
#[test]
fn a_box_at_rest_slides_to_its_place() {
    exact("slide.toml", None);
}

/// And up a slope that it would rest on.
#[test]
fn a_box_is_pushed_up_a_slope() {
    let found = exact("uphill.toml", None);
    let (end, slope) = (&found.replay.states[50][0], 11.31_f64.to_radians());
    let along = end.position.x * slope.cos() - end.position.z * slope.sin();
    assert!((along + 1.0).abs() < 0.05 && end.velocity.norm() < 1e-2, "{along}");
}

/// 180 numbers, from no push at all.
#[test]
fn a_push_to_a_pose_replays() {
    let problem = shipped("push.toml");
    let found = plan(&problem, &problem.zero(), &[Box::new(ProgramLeg::default())]);
    assert!(found.replay.meets(), "{} {:?}", found.reason, found.legs);
    assert!(found.apart.unwrap() < 1e-3, "{:?}", found.apart);
}

/// From no force at all: dry friction holds a plate until its motor has done more, and no exact derivative leads there.
#[test]
fn a_plate_is_lifted_to_its_stop() {
    let found = exact("lift.toml", None);
    let modes = found.replay.modes.axes.iter().flatten();
    let of_friction = modes.filter(|of| of.part == DrivePart::Friction);
    let sides: Vec<_> = of_friction.map(|of| of.side).collect();
    // It swings back and then forwards, against friction both times, and at last it rests.
    assert!(sides.contains(&Side::Least) && sides.contains(&Side::Most), "{sides:?}");
    assert_eq!(sides.last(), Some(&Side::Between));
}

/// Near a speed that `sample` finds. Some contacts of the boxes only just press: a barrier that pushes them off their bounds moves the
/// boxes far away, and the polish is that about the run's own forces.
#[test]
fn a_hit_ends_at_its_place() {
    let problem = shipped("hit.toml");
    let legs: [Box<dyn Leg>; 2] = [Box::new(Shoot::default()), Box::new(Polish::default())];
    let found = plan(&problem, &[5.7076, -0.62877], &legs);
    assert_eq!(found.status, PlanStatus::Exact, "{} {:?}", found.reason, found.legs);
    let end = found.replay.states[75][1].position;
    assert!((end.x - 1.0).hypot(end.y - 0.1) < 1e-8, "{end}");
    // The first program does not end; the second one is within the iterations of one.
    assert!(found.legs[1].iterations <= 150, "{}", found.legs[1].iterations);
}

/// Where a face slides as it turns, the laws leave the shares of its forces open, and an optimiser moves the end by them: every step
/// exact in the laws, and no run. A compliance closes it.
#[test]
fn without_compliance_the_plan_is_no_run() {
    let scene = r#"
time_step = 0.02

[ground]
friction = 0.4

[[bodies]]
name = "box"
box = [0.3, 0.3, 0.2]
mass = 1.0
position = [0, 0, 0.1]
velocity = [1.2, 0.2, 0]
spin = [0, 0, 3]
"#;
    for y in [-1.0, 1.0] {
        // Ipopt leaves the objective out where there are as many rows as variables: a force that does nothing.
        let idle = "[[controls]]\nkind = \"force\"\nknots = 1\nz = [0, 1e-9]";
        let target = format!("[target]\ny = {y}\nweight = {{ position = 1.0 }}");
        let problem = problem(scene, &format!("steps = 15\n{idle}\n{target}\n")).problem;
        let apart = |compliance: f64| {
            let polish = Polish { compliance, anchored: 0, rounds: 1, ..Polish::default() };
            let found = plan(&problem, &[0.0], &[Box::new(polish)]);
            found.legs[0].apart.unwrap()
        };
        let (free, held) = (apart(0.0), apart(1e-6));
        assert!(free > 1e-3, "{free:e}");
        assert!(held < 1e-7, "{held:e}");
        let found = plan(&problem, &[0.0], &[Box::new(Polish::default())]);
        assert!(found.legs[0].apart.unwrap() < 1e-9, "{:?}", found.legs);
    }
}

/// What the program cannot pose is refused in one sentence.
#[test]
fn what_cannot_be_posed_is_said() {
    let scene = r#"
[ground]
friction = 0.4
restitution = 0.5

[[bodies]]
name = "box"
box = [0.3, 0.3, 0.2]
mass = 1.0
position = [0, 0, 0.1]
"#;
    let problem = problem(scene, "steps = 3\n[target]\ny = 1.0\n").problem;
    let replay = problem.replay(&[]).unwrap();
    let why = PlanNlp::with_modes(&problem, &replay, 1e-6).err().unwrap().to_string();
    assert_eq!(why, "the program cannot pose this problem: its scene has restitution");
    // Other legs may go on.
    let found = plan(&problem, &[], &legs());
    assert!(found.legs.iter().all(|leg| leg.message == why), "{:?}", found.legs);
    assert_eq!(found.status, PlanStatus::Missed);
}
