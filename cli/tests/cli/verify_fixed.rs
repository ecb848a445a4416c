//! `tumble verify` accepts unchanged runs of bodies on tilted fixed obstacles. Contact planes of
//! the bodies lie on corners and edges of the obstacles.

use super::scenario::run_scenario;
use super::support::run;

/// Scene with a tilted board, a rod and a pike, for bricks, a rounded hull and two-piece bodies
/// from above.
const SCENE: &str = r#"
steps = 200
time_step = 0.005
[ground]
friction = 0.4
[[fixed]]
name = "board"
box = [1.0, 0.8, 0.1]
position = [0.0, 0.0, 0.3]
attitude = { axis = [1.0, 0.3, 0.0], degrees = 25.0 }
[[fixed]]
name = "rod"
capsule = { length = 1.0, radius = 0.03 }
position = [0.1, 0.1, 0.6]
attitude = { axis = [0.0, 1.0, 0.2], degrees = 80.0 }
[[fixed]]
name = "pike"
hull = [[0.3, 0.3, 0.4], [0.5, 0.3, 0.4], [0.4, 0.5, 0.4], [0.4, 0.4, 0.7]]
"#;

const SHAPES: [&str; 4] = [
    "box = [0.07, 0.03, 0.11]",
    "box = [0.2, 0.15, 0.04]",
    "hull = [[0.1, 0.1, 0.02], [-0.05, -0.06, 0.06], [-0.1, 0.1, 0.0], [0.07, -0.03, -0.06], [0.0, 0.0, 0.1]]\nradius = 0.01",
    "pieces = [{ box = [0.15, 0.15, 0.05] }, { box = [0.04, 0.04, 0.15], position = [0.0, 0.0, 0.11] }]",
];

#[test]
fn unchanged_runs_on_inclined_fixed_bodies_verify() {
    for seed in 1..=6 {
        let bodies = (0..8).map(|number: usize| {
            let shape = SHAPES[number % SHAPES.len()];
            let height = 1.0 + 0.5 * number as f64;
            let aside = 0.2 * (0.9 * number as f64 + seed as f64).sin();
            format!(
                "[[bodies]]\nname = \"b{number}\"\n{shape}\nmass = 1.0\nposition = [{aside:.3}, {:.3}, {height}]\n\
                 attitude = \"random\"\nvelocity = [0.3, -0.2, -1.5]\nspin = [3.0, -4.0, 2.0]\n",
                -aside
            )
        });
        let text = format!("seed = {seed}\n{SCENE}{}", bodies.collect::<String>());
        let (end, directory) = run_scenario(&text, &[]);
        let steps = directory.path().join("out/steps.csv");
        let verified = run(&["verify", steps.to_str().unwrap()]);
        assert_eq!(verified.code, end.code, "{seed}: {verified:?}");
    }
}
