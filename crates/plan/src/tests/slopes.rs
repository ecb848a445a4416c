//! Unit tests of `slopes.rs`.

use super::*;
use crate::file::ProblemFile;
use std::path::Path;
use tumble_core::world::Integrator;
use tumble_scene::scene::Scene;

const SCENE: &str = "
        time_step = 0.01
        [ground]
        friction = 0.3
        [[bodies]]
        name = \"box\"
        box = [0.3, 0.25, 0.2]
        mass = 1.5
        position = [0, 0, 0.1]
        velocity = [0.9, 0.3, 0]
        spin = [0, 0, 1.5]
        load = { force = [0.4, 0.2, 0.0], at = [0.05, 0.02, 0.03] }
        ";

const PROBLEM: &str = "
        scene = \"-\"
        steps = STEPS
        [[controls]]
        kind = \"push\"
        face = \"-x\"
        at = [-0.15, 0.01, -0.05]
        friction = 0.5
        normal = [0, 5]
        tangential = [-1, 1]
        offset = [-0.1, 0.1]
        knots = 3
        [[controls]]
        kind = \"torque\"
        z = [-1, 1]
        knots = 2
        [[controls]]
        kind = \"start\"
        of = \"velocity\"
        x = [0, 2]
        y = [0, 2]
        [[controls]]
        kind = \"start\"
        of = \"spin\"
        z = [0, 3]
        [[controls]]
        kind = \"constant\"
        constant = \"friction\"
        value = [0.1, 0.6]
        [[controls]]
        kind = \"constant\"
        constant = \"mass\"
        value = [0.5, 2]
        [target]
        position = [0.4, 0.3]
        turn = 60
        speed = 0
        tolerance = { position = 1, turn = 57.29577951308232, speed = 1 }
        [[path_constraints]]
        x = [0.05, 0.06]
        weight = 1
        ";

/// A problem of `steps` steps, and controls within its bounds.
pub(crate) fn pushed_box(steps: usize) -> (PlanProblem, Vec<f64>) {
    let read = |_: &Path, _: u64| Ok(Vec::new());
    let path = Path::new("box.toml");
    let mut scene = Scene::from_text(SCENE, path, &[], &read).unwrap();
    scene.use_integrator(Integrator::Euler);
    let problem =
        ProblemFile::from_scene_text(scene, &PROBLEM.replace("STEPS", &steps.to_string()));
    let problem = problem.unwrap().problem;
    let zero = problem.zero();
    let inside = zero.iter().zip(problem.variables()).enumerate().map(|(k, (value, of))| {
        let way = 0.3 + 0.1 * (k as f64).sin();
        if *value > of.bounds[0] && *value < of.bounds[1] && *value != 0.0 {
            *value
        } else {
            of.bounds[0] + way * of.scale()
        }
    });
    let controls = inside.collect();
    (problem, controls)
}

/// The run slides throughout. Twelve steps with an error of 3e-11 m/s leave 4e-6 in the differences.
#[test]
fn derivatives_by_controls_are_those_of_differences() {
    let (problem, controls) = pushed_box(12);
    let interrupt = Arc::new(AtomicBool::new(false));
    let (exact, runs) = problem.slopes(&controls, false, &interrupt).unwrap();
    let (other, _) = problem.slopes(&controls, true, &interrupt).unwrap();
    assert_eq!(runs, 1);
    assert_eq!(exact.rows, other.rows);
    assert!(exact.rows.len() > 6, "path constraints are among the rows");
    for (row, column) in
        (0..exact.rows.len()).flat_map(|i| (0..controls.len()).map(move |j| (i, j)))
    {
        let (a, b) = (exact.by[(row, column)], other.by[(row, column)]);
        assert!((a - b).abs() < 1e-5 * (1.0 + b.abs()), "{row}, {column}: {a} {b}");
    }
    assert!(exact.by.column_iter().all(|column| column.amax() > 1e-6), "every control matters");
}
