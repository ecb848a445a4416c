//! Pattern and values are one sequence.

use super::super::smoothing::Smoothing;
use super::PlanNlp;
use crate::plan::file::ProblemFile;
use crate::scenario::scene::Scene;
use crate::scenario::settings::Settings;
use std::path::Path;

/// The pattern is that of every point, not only of the one that it was made at: zero, where products vanish, and any
/// other.
#[test]
fn the_sequence_of_entries_is_that_of_the_pattern() {
    let scene = r#"
        [ground]
        friction = 0.5
        [[bodies]]
        name = "box"
        box = [0.4, 0.3, 0.2]
        mass = 1.5
        position = [0.0, 0.0, 0.1]
        [[bodies]]
        name = "ball"
        sphere = 0.1
        mass = 0.7
        position = [0.02, 0.01, 0.3]
    "#;
    let problem = r#"
        scene = "-"
        steps = 3
        [[controls]]
        kind = "push"
        body = "box"
        face = "-x"
        normal = [0.0, 3.0]
        tangential = [-0.7, 0.7]
        offset = [-0.1, 0.1]
        friction = 0.4
        [[controls]]
        kind = "torque"
        body = "ball"
        x = [-1.0, 1.0]
        [[controls]]
        kind = "start"
        body = "ball"
        of = "turn"
        x = [-1.0, 1.0]
        [target]
        body = "ball"
        attitude = [0.8, 0.1, -0.5, 0.2]
        [[keep]]
        body = "box"
        away = { point = [1.0, 0.2, 0.1], radius = 0.8 }
    "#;
    let none = &|_: &Path, _: u64| Err(std::io::ErrorKind::NotFound.into());
    let scene = Scene::of_text(scene, Path::new("-"), Settings::default(), none);
    let scene = scene.unwrap_or_else(|why| panic!("{why:?}"));
    let problem = ProblemFile::of_scene_text(scene, problem).unwrap().problem;
    let replay = problem.replay(&problem.zero()).unwrap();
    let smoothing = Smoothing { delta: 1e-2, compliance: 1e-3 };
    for nlp in [
        PlanNlp::smoothed(&problem, &replay, smoothing),
        PlanNlp::with_modes(&problem, &replay, 1e-6),
    ] {
        let nlp = nlp.unwrap();
        let any = (0..nlp.variables).map(|i| f64::from(i as u32 * 37 % 19) / 7.0 - 1.2);
        for x in [vec![0.0; nlp.variables], nlp.point_of(&replay), any.collect()] {
            let (read, y) = (nlp.read(&x), vec![0.7; nlp.rows]);
            assert!(nlp.jacobian.is_of(|sink| nlp.emit_jacobian(&read, sink)));
            assert!(nlp.hessian.is_of(|sink| nlp.emit_hessian(&read, 1.0, &y, sink)));
        }
    }
}
