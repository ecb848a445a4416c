//! Plans of the problems of docs/planning.md by the program and its polish, leg by leg:
//! `cargo run --release --example plan_legs -- [PROBLEM…]`.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;
use tumble::plan::file::{ProblemFile, Start};
use tumble::plan::program::{PlanNlp, Smoothing};
use tumble::plan::{Problem, Progress, Replay, Watch};
use tumble::scenario::scene::Scene;
use tumble::scenario::settings::Settings;

#[path = "../tests/plan/problems.rs"]
mod problems;

/// Seconds of one call of each of the program's functions at the start of a problem, with its size.
fn pace(name: &str, problem: &Problem, replay: &Replay) {
    let smoothing = Smoothing { delta: 1e-4, compliance: 1e-3 };
    let Ok(nlp) = PlanNlp::smoothed(problem, replay, smoothing) else { return };
    let x = nlp.point_of(replay);
    let (entries, curves) = (nlp.jacobian_pattern().len(), nlp.hessian_pattern().len());
    let y = vec![0.3; nlp.rows()];
    let mut rows = vec![0.0; nlp.rows()];
    let (mut slopes, mut bends) = (vec![0.0; entries], vec![0.0; curves]);
    const CALLS: u32 = 50;
    let time = |call: &mut dyn FnMut()| {
        let before = Instant::now();
        (0..CALLS).for_each(|_| call());
        1e6 * before.elapsed().as_secs_f64() / f64::from(CALLS)
    };
    let first = time(&mut || nlp.constraints(&x, &mut rows));
    let second = time(&mut || nlp.jacobian(&x, &mut slopes));
    let third = time(&mut || nlp.hessian(&x, 1.0, &y, &mut bends));
    println!(
        "{name:8} | pace    | {} variables, {} rows, {entries} and {curves} entries: rows {first:.0} µs, \
         Jacobian {second:.0} µs, Hessian {third:.0} µs",
        nlp.variables(),
        nlp.rows(),
    );
}

fn main() {
    let wanted: Vec<_> = std::env::args().skip(1).collect();
    println!("problem  | leg     | iterations | cost of the replay | apart, m | other modes | s");
    for (name, scene, text) in problems::ALL {
        if !wanted.is_empty() && !wanted.iter().any(|wanted| wanted == name) {
            continue;
        }
        let nothing = &mut |_: &Path, _| unreachable!();
        let scene = Scene::of_text(scene, Path::new(name), Settings::default(), nothing).unwrap();
        let text = format!("scene = \"{name}\"\n{text}");
        let file = ProblemFile::of_scene_text(scene, &text).unwrap();
        assert_eq!(file.start, Start::Zero);
        let interrupt = Arc::new(AtomicBool::new(false));
        let mut start = file.problem.zero();
        if let Some((_, guess)) = problems::GUESSES.iter().find(|(of, _)| of == name) {
            start = guess(&file.problem);
        }
        let mut best = file.problem.replay(&start).unwrap();
        println!("{name:8} | start   | | {:.6}", best.cost);
        pace(name, &file.problem, &best);
        for leg in file.made_legs() {
            let before = Instant::now();
            let mut progress = |at: &Progress<'_>| {
                if std::env::var_os("ITERATIONS").is_some() {
                    eprintln!("{} {} {:.6}", at.leg, at.iteration, at.cost);
                }
                true
            };
            let mut watch = Watch { interrupt: &interrupt, progress: &mut progress };
            let end = leg.run(&file.problem, &best, &mut watch).unwrap();
            let seconds = before.elapsed().as_secs_f64();
            let replay = file.problem.replay(&end.controls).unwrap();
            let apart = end.states.as_ref().map(|states| replay.apart(states));
            let modes = end.modes.as_ref().map(|modes| replay.other_modes(modes));
            let shown = |of: Option<String>| of.unwrap_or_default();
            println!(
                "{name:8} | {:7} | {} | {:.7} | {} | {} | {seconds:.2} | {}, meets {}, claims {}",
                leg.name(),
                end.iterations,
                replay.cost,
                shown(apart.map(|apart| format!("{apart:.1e}"))),
                shown(modes.map(|modes| modes.to_string())),
                end.message,
                replay.meets(),
                shown(end.cost.map(|cost| format!("{cost:.7}"))),
            );
            best = replay;
        }
    }
}
