//! Runs with an accuracy: errors of the motion against closed forms and against finer runs.

use crate::leapfrog::*;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble::{Simulation, State, StepRecord};
use tumble_scene::scene::Scene;
use tumble_scene::settings::Settings;

/// Scene of `text` with steps of 10 ms in parts that keep `accuracy` (m).
fn simulation(text: &str, accuracy: f64) -> Simulation<'static> {
    let text = format!("time_step = 0.01\naccuracy = {accuracy:?}\n{text}");
    let read = |path: &Path, _: u64| std::fs::read(path);
    let scene =
        Scene::from_text(&text, Path::new("scene.toml"), Settings::default(), &read).unwrap();
    scene.simulation(&Arc::new(AtomicBool::new(false))).unwrap()
}

fn ends(text: &str, time: f64, accuracy: f64) -> (Vec<State>, u32, f64, bool) {
    let mut simulation = simulation(text, accuracy);
    let mut record = StepRecord::new();
    let mut parts = 0;
    let mut coarse = false;
    for _ in 0..(time / 0.01).round() as u64 {
        simulation.step(&mut record).unwrap();
        parts += record.parts.count;
        coarse |= record.parts.is_coarse;
        assert!(record.report.status.is_one_problem(), "step {}", record.index);
    }
    let error = simulation.time_errors().iter().copied().fold(0.0, f64::max);
    (simulation.states().to_vec(), parts, error, coarse)
}

fn bounce() -> String {
    "[ground]\nfriction = 0.3\nrestitution = 0.5\n[[bodies]]\nname = \"body\"\nmass = 1.0\nsphere = 0.1\nposition = [0, 0, 1.1]\n".to_owned()
}

fn rocking_block() -> String {
    let (sine, cosine) = 10f64.to_radians().sin_cos();
    format!(
        "[ground]\nfriction = 0.4\n[[bodies]]\nname = \"body\"\nmass = 1.0\nbox = [0.2, 0.2, 0.6]\nattitude = {{ axis = [0, 1, 0], degrees = 10 }}\nposition = [{:?}, 0, {:?}]\n",
        0.3 * sine - 0.1 * cosine,
        0.3 * cosine + 0.1 * sine
    )
}

fn brick() -> String {
    "[ground]\nfriction = 0.4\n[[bodies]]\nname = \"body\"\nmass = 1.0\nbox = [0.4, 0.2, 0.1]\nposition = [0, 0, 0.4]\nvelocity = [1.5, 0.5, 0]\nspin = [3, 5, 2]\n".to_owned()
}

#[test]
fn probe() {
    for (name, text, time) in [
        ("oblique", oblique_slide(), 0.4),
        ("pendulum", pendulum(), 2.0),
        ("sprung", sprung_pendulum(), 1.0),
        ("servo", servo(), 1.0),
        ("double", shipped("double-pendulum.toml"), 0.5),
        ("four-bar", shipped("four-bar.toml"), 0.4),
        ("top", top(), 0.5),
        ("bounce", bounce(), 1.2),
        ("rocking", rocking_block(), 0.8),
        ("brick", brick(), 0.6),
        ("dominoes", shipped("dominoes.toml"), 0.4),
    ] {
        let fixed = [2e-4, 1e-4].map(|h| crate::leapfrog::at(&text, time, h));
        let finest: Vec<State> = fixed[0]
            .iter()
            .zip(&fixed[1])
            .map(|(a, b)| State { position: b.position + (b.position - a.position) / 3.0, ..*b })
            .collect();
        let mut last = finest.clone();
        for accuracy in [1e-3, 1e-4, 1e-5, 1e-6, 1e-7] {
            let start = std::time::Instant::now();
            let (states, parts, error, coarse) = ends(&text, time, accuracy);
            let took = start.elapsed().as_secs_f64();
            let step = states
                .iter()
                .zip(&last)
                .map(|(a, b)| (a.position - b.position).norm())
                .fold(0.0, f64::max);
            let apart = states
                .iter()
                .zip(&finest)
                .map(|(a, b)| (a.position - b.position).norm())
                .fold(0.0, f64::max);
            last = states.clone();
            println!(
                "{name} {accuracy:e}: error {apart:.2e} last {step:.2e} estimate {error:.2e} parts {parts} {coarse} {:.2} ms",
                took * 1e3
            );
        }
    }
}

#[test]
fn probe_four() {
    for time in [0.01, 0.02, 0.05, 0.1, 0.2, 0.4] {
        for (name, text) in [("four", shipped("four-bar.toml")), ("pend", pendulum())] {
            let fixed = [2e-4, 1e-4].map(|h| crate::leapfrog::at(&text, time, h));
            let all: Vec<_> = [1e-5, 1e-7].map(|a| ends(&text, time, a)).into_iter().collect();
            let d = |a: &[State], b: &[State]| {
                a.iter().zip(b).map(|(a, b)| (a.position - b.position).norm()).fold(0.0, f64::max)
            };
            let v = |a: &[State], b: &[State]| {
                a.iter().zip(b).map(|(a, b)| (a.velocity - b.velocity).norm()).fold(0.0, f64::max)
            };
            println!(
                "{name} {time}: fixed {:.1e} {:.1e}; acc {:.1e} {:.1e}; {:.1e} {:.1e} parts {}",
                d(&fixed[0], &fixed[1]),
                v(&fixed[0], &fixed[1]),
                d(&all[0].0, &fixed[1]),
                v(&all[0].0, &fixed[1]),
                d(&all[1].0, &fixed[1]),
                v(&all[1].0, &fixed[1]),
                all[1].1
            );
        }
    }
}
