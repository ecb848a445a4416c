//! Plans of the problems in `scenarios/plans` by given legs, one after the other, from no controls:
//! `cargo run --release --example plan_legs -- LEG[,LEG…] PROBLEM…`, as in `program,polish slide push`. `pace` times the
//! program's functions.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;
use tumble::plan::file::ProblemFile;
use tumble::plan::program::{PlanNlp, ProgramLeg, Smoothing};
use tumble::plan::{Leg, Method, Polish, Problem, Progress, Replay, Shoot, Watch};

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
    let mut arguments = std::env::args().skip(1);
    let legs = arguments.next().unwrap_or_default();
    println!(
        "problem  | leg     | iterations | cost of the replay | apart, m | other modes | s | status"
    );
    for name in arguments {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenarios/plans");
        let path = folder.join(&name).with_extension("toml");
        let text = std::fs::read_to_string(&path).unwrap();
        let read = &|path: &Path, _: u64| std::fs::read(path);
        let file = ProblemFile::of_text(&text, &path, read).unwrap_or_else(|why| panic!("{why:?}"));
        let problem = &file.problem;
        let mut best = problem.replay(&problem.zero()).unwrap();
        println!("{name:8} | start   | | {:.6}", best.cost);
        for leg in legs.split(',') {
            let leg: Box<dyn Leg> = match leg {
                "pace" => {
                    pace(&name, problem, &best);
                    continue;
                }
                "program" => Box::new(ProgramLeg::default()),
                "polish" => Box::new(Polish::default()),
                "shoot" => Box::new(Shoot::default()),
                "ddp" => {
                    let method = Method::DynamicProgramming;
                    Box::new(Shoot { method, ..Shoot::default() })
                }
                _ => Box::new(file.sample),
            };
            let interrupt = Arc::new(AtomicBool::new(false));
            let mut progress = |at: &Progress<'_>| {
                if std::env::var_os("ITERATIONS").is_some() {
                    eprintln!("{} {} {:.6}", at.leg, at.iteration, at.cost);
                }
                true
            };
            let mut watch = Watch { interrupt: &interrupt, progress: &mut progress };
            let before = Instant::now();
            let plan = problem.plan(&best.controls, &[leg], &mut watch).unwrap();
            let seconds = before.elapsed().as_secs_f64();
            let report = &plan.legs[0];
            let apart = report.apart.map(|apart| format!("{apart:.1e}")).unwrap_or_default();
            let modes = report.other_modes.map(|modes| modes.to_string()).unwrap_or_default();
            println!(
                "{name:8} | {:7} | {} | {:.7} | {apart} | {modes} | {seconds:.2} | {}, {}",
                report.name, report.iterations, report.cost, plan.status, report.message,
            );
            best = plan.replay;
        }
    }
}
