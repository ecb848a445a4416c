//! Plans by the program of N steps: its derivatives against central differences, the problems of docs/planning.md, and the
//! freedom that a program without compliance has.

#[path = "plan/casadi.rs"]
mod casadi;
mod common;
#[path = "plan/problems.rs"]
mod problems;
#[path = "derivatives/slopes.rs"]
mod slopes;

use common::cases;
use proptest::prelude::*;
use slopes::{Program, hessian_error, jacobian_error};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::plan::file::ProblemFile;
use tumble::plan::program::{PlanNlp, ProgramLeg, Smoothing};
use tumble::plan::{Leg, LegEnd, PlanError, PlanStatus, Polish, Problem, Replay, Watch};
use tumble::scenario::scene::Scene;
use tumble::scenario::settings::Settings;
use tumble::sparsity::SparsityPattern;

fn problem(scene: &str, text: &str) -> ProblemFile {
    let nothing = &mut |_: &Path, _| unreachable!();
    let scene = Scene::of_text(scene, Path::new("scene"), Settings::default(), nothing);
    let scene = scene.unwrap_or_else(|failure| panic!("{failure:?}"));
    ProblemFile::of_scene_text(scene, &format!("scene = \"scene\"\n{text}")).unwrap()
}

fn named(name: &str) -> (ProblemFile, Vec<f64>) {
    let (_, scene, text) = problems::ALL.iter().find(|(known, ..)| *known == name).unwrap();
    let file = problem(scene, text);
    let guess = problems::GUESSES.iter().find(|(of, _)| *of == name);
    let start = guess.map_or_else(|| file.problem.zero(), |(_, guess)| guess(&file.problem));
    (file, start)
}

fn run(leg: &dyn Leg, problem: &Problem, from: &Replay) -> Result<LegEnd, PlanError> {
    let interrupt = Arc::new(AtomicBool::new(false));
    leg.run(problem, from, &mut Watch { interrupt: &interrupt, progress: &mut |_| true })
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

/// A box that slides on the ground, a ball that rolls on it, and another box that it pushes.
const SEVERAL: &str = r#"
name = "several"
steps = 3
time_step = 0.05

[ground]
friction = 0.5

[[bodies]]
name = "lower"
box = [0.4, 0.3, 0.2]
mass = 1.5
position = [0.0, 0.0, 0.1]
velocity = [0.4, 0.1, 0.0]

[[bodies]]
name = "ball"
sphere = 0.1
mass = 0.7
position = [0.02, 0.01, 0.3]
spin = [0.3, -0.2, 0.5]

[[bodies]]
name = "next"
box = [0.2, 0.2, 0.2]
mass = 0.6
position = [0.31, 0.0, 0.1]
attitude = [0.9998, 0.0, 0.0, 0.02]
"#;

/// All kinds of controls that the program knows, all kinds of targets, and keeps.
const EVERYTHING: &str = r#"
steps = 3

[[controls]]
kind = "push"
body = "lower"
face = "-x"
normal = [0.0, 3.0]
tangential = [-0.7, 0.7]
tangential_2 = [-0.7, 0.7]
offset = [-0.1, 0.1]
offset_2 = [-0.1, 0.1]
friction = 0.4
knots = 2

[[controls]]
kind = "push"
body = "next"
face = "+y"
normal = [0.0, 3.0]
tangential = [-1.0, 1.0]
offset = [-0.05, 0.05]
knots = 3

[[controls]]
kind = "torque"
body = "ball"
x = [-1.0, 1.0]
z = [-1.0, 1.0]

[[controls]]
kind = "force"
body = "ball"
y = [-1.0, 1.0]

[[controls]]
kind = "start"
body = "ball"
of = "turn"
x = [-1.0, 1.0]
y = [-1.0, 1.0]
z = [-1.0, 1.0]

[[controls]]
kind = "start"
body = "lower"
of = "velocity"
x = [-1.0, 1.0]

[[target]]
body = "lower"
position = [0.5, 0.3]
velocity = [0.0, 0.1, 0.0]
spin = 0.0
turn = 40.0

[[target]]
body = "ball"
attitude = [0.8, 0.1, -0.5, 0.2]
after = 2

[[target]]
body = "next"
down = "+x"

[[keep]]
body = "ball"
above = { x = 0.1, width = 0.2, height = 0.3 }

[[keep]]
body = "lower"
away = { point = [1.0, 0.2, 0.1], radius = 0.8 }
"#;

/// Smoothed by so much that differences can follow.
const SMOOTH: Smoothing = Smoothing { delta: 25.0, compliance: 0.3 };

proptest! {
    #![proptest_config(cases(24))]

    #[test]
    fn derivatives_are_slopes(
        numbers in proptest::collection::vec(-1.0..1.0, 800), factor in 0.0..2.0, fixed in any::<bool>()
    ) {
        let problem = problem(SEVERAL, EVERYTHING).problem;
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

/// A run of the simulator obeys the rows: of fixed modes to rounding, with compliance to what it gives.
#[test]
fn a_run_obeys_the_rows() {
    for name in ["slide", "push", "throw", "hop"] {
        let (file, start) = named(name);
        let replay = file.problem.replay(&start).unwrap();
        let nlp = PlanNlp::with_modes(&file.problem, &replay, 0.0).unwrap();
        let x = nlp.point_of(&replay);
        let mut rows = vec![f64::NAN; nlp.rows()];
        nlp.constraints(&x, &mut rows);
        let bounds = nlp.bounds();
        let pairs = rows.iter().zip(&bounds.constraint_lower).zip(&bounds.constraint_upper);
        for (row, ((value, low), high)) in pairs.enumerate() {
            let off = (low - value).max(value - high).max(0.0);
            assert!(off < 1e-8, "{name}: row {row} is off by {off:e}");
        }
    }
}

#[test]
fn the_puck_stops_where_it_is_to() {
    reached("puck", &[&ProgramLeg::default(), &Polish::default()], PlanStatus::Exact);
}

#[test]
fn the_box_slides_to_its_place() {
    reached("slide", &[&ProgramLeg::default(), &Polish::default()], PlanStatus::Exact);
}

fn reached(name: &str, legs: &[&dyn Leg], status: PlanStatus) {
    let (file, start) = named(name);
    let mut best = file.problem.replay(&start).unwrap();
    for leg in legs {
        let end = run(*leg, &file.problem, &best).unwrap();
        best = file.problem.replay(&end.controls).unwrap();
        println!("{name} {}: {} {}", leg.name(), end.message, best.cost);
        if status == PlanStatus::Exact && leg.name() == "polish" {
            assert_eq!(best.other_modes(end.modes.as_ref().unwrap()), 0);
            assert!(best.apart(end.states.as_ref().unwrap()) < 1e-9);
        }
    }
    assert!(best.meets(), "{:?}", best.misses);
}
