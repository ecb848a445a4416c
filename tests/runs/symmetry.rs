//! Bodies that a quarter turn takes to each other stay images of each other, whatever their order is.

use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::{State, StepRecord};
use tumble_scene::scene::Scene;

/// Four bodies that meet in the middle, each turned by 90° against the one before.
fn scene(shape: &str, height: f64, restitution: f64, friction: f64, spin: f64) -> String {
    let mut text = format!(
        "time_step = 0.002\n[ground]\nfriction = {friction:?}\nrestitution = {restitution:?}\n"
    );
    for (quarter, [c, s]) in [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]].iter().enumerate() {
        let _ = writeln!(
            text,
            "[[bodies]]\nname = \"b{quarter}\"\nmass = 1.0\n{shape}\nposition = [{:?}, {:?}, {height:?}]\n\
             attitude = {{ axis = [0, 0, 1], degrees = {:?} }}\nvelocity = [{:?}, {:?}, 0]\nspin = [0, 0, {spin:?}]",
            0.5 * c,
            0.5 * s,
            90.0 * quarter as f64,
            -c - 0.15 * s,
            -s + 0.15 * c
        );
    }
    text
}

/// Largest distance of a body from its image of the first one (m).
fn asymmetry(states: &[State]) -> f64 {
    let place = |state: &State| [state.position.x, state.position.y, state.position.z];
    let [mut x, mut y, z] = place(&states[0]);
    let mut most: f64 = 0.0;
    for state in states {
        let found = place(state);
        most = [x, y, z].iter().zip(found).map(|(a, b)| (a - b).abs()).fold(most, f64::max);
        (x, y) = (-y, x);
    }
    most
}

#[test]
fn four_bodies_keep_their_fourfold_symmetry() {
    let shapes = [
        ("sphere = 0.1", 0.1),
        ("box = [0.2, 0.2, 0.2]", 0.1),
        ("cylinder = { radius = 0.1, length = 0.2 }", 0.1),
        ("box = [0.3, 0.2, 0.1]", 0.05),
    ];
    for (shape, height) in shapes {
        for (restitution, friction, spin) in
            [(0.0, 0.0, 0.0), (0.5, 0.0, 3.0), (0.0, 0.3, 0.0), (0.5, 0.3, 3.0)]
        {
            let text = scene(shape, height, restitution, friction, spin);
            let read = |path: &Path, _: u64| std::fs::read(path);
            let scene = Scene::from_text(&text, Path::new("scene.toml"), &[], &read).unwrap();
            let mut simulation = scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap();
            let mut record = StepRecord::new();
            for _ in 0..500 {
                simulation.step(&mut record).unwrap();
            }
            let off = asymmetry(simulation.states());
            assert!(off <= 1e-9, "{shape}, e {restitution}, mu {friction}, spin {spin}: {off:e} m");
        }
    }
}
