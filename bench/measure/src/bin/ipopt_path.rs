//! Effect of each setting of the Ipopt path on the drop scene: the table of `docs/ipopt-path.md`.
//!
//! `cargo run --release -p tumble-measure --bin ipopt_path -- 42 0` takes about a minute per seed.

use std::process::ExitCode;
use std::time::Instant;
use tumble::ipopt::{BarrierStrategy, Options};
use tumble::solver::ipopt::{IpoptSolver, Ladder, MOST_ITERATIONS, Rung, TOLERANCE};
use tumble_core::contact::detection::Detection;
use tumble_core::error::Error;
use tumble_core::simulation::scene::{self, TutorialScene};
use tumble_core::simulation::summary::RunSummary;
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::step::StepSolver;
use tumble_core::world::World;

/// Constructor of Ipopt: the tutorial's or the ladder's.
type Program = fn(&World, Options) -> Result<IpoptSolver, Error>;

/// Row of the table.
struct PathSetting {
    name: &'static str,
    detection: Detection,
    program: Program,
    options: Options,
    /// Rungs of the ladder; empty for a single solve.
    rungs: &'static [Rung],
}

/// Settings in the order of the table. Each row changes one setting of the previous row.
fn settings() -> Vec<PathSetting> {
    let tutorial = IpoptSolver::tutorial_options();
    let adaptive = Options { barrier: BarrierStrategy::Adaptive, ..tutorial.clone() };
    let recommended = IpoptSolver::options(TOLERANCE, MOST_ITERATIONS);
    let unscaled = Options { objective_scaling: 1.0, ..recommended.clone() };
    let (height, predictive) = (Detection::Height, Detection::Predictive);
    let (all, posed): (Program, Program) = (IpoptSolver::tutorial, IpoptSolver::new);
    let row = |name, detection, program, options: &Options, rungs| PathSetting {
        name,
        detection,
        program,
        options: options.clone(),
        rungs,
    };
    vec![
        row("the tutorial's settings", height, all, &tutorial, &[]),
        row("predictive flags", predictive, all, &tutorial, &[]),
        row("contacts posed by free flight", predictive, posed, &tutorial, &[]),
        row("adaptive barrier", predictive, posed, &adaptive, &[]),
        row("multipliers by dual infeasibility", predictive, posed, &unscaled, &[]),
        row("objective in weights", predictive, posed, &recommended, &[]),
        row("ladder without warm start", predictive, posed, &recommended, &Rung::ALL[1..]),
        row("ladder", predictive, posed, &recommended, &Rung::ALL),
    ]
}

fn run(world: &World, setting: &PathSetting, seed: u32) -> Result<RunSummary, Error> {
    let scene = TutorialScene::drop();
    let ipopt = (setting.program)(world, setting.options.clone())?;
    let solver: Box<dyn StepSolver> = if setting.rungs.is_empty() {
        Box::new(ipopt)
    } else {
        Box::new(Ladder::new(world, ipopt, setting.rungs))
    };
    let start = scene.start(scene.attitude(seed));
    let motion = Motion::Contact { detection: setting.detection, solver };
    let mut simulation = Simulation::new(world.clone(), [start], motion)?;
    let mut record = StepRecord::new();
    let mut summary = RunSummary::default();
    for _ in 1..scene.rows {
        simulation.step(&mut record)?;
        summary.add(&record);
    }
    Ok(summary)
}

fn main() -> ExitCode {
    let seeds: Result<Vec<u32>, _> = std::env::args().skip(1).map(|seed| seed.parse()).collect();
    let Ok(seeds) = seeds else {
        eprintln!("seeds from 0 to 4294967295 are needed, for example: 42 0");
        return ExitCode::from(2);
    };
    let world = match scene::tutorial_parameters().and_then(World::new) {
        Ok(world) => world,
        Err(error) => {
            eprintln!("{error}");
            return ExitCode::FAILURE;
        }
    };
    for seed in seeds {
        println!("seed {seed}: iterations a contact step, seconds, statuses, residual (m/s)");
        for setting in settings() {
            let clock = Instant::now();
            match run(&world, &setting, seed) {
                Ok(summary) => println!(
                    "  {:34} {:5.1} {:6.1}  retried {:3}, fallback {:2}, failed {:3}  \
                     median {:.1e}, largest {:.1e}",
                    setting.name,
                    summary.iterations as f64 / summary.contact_steps() as f64,
                    clock.elapsed().as_secs_f64(),
                    summary.retried,
                    summary.fallback,
                    summary.failed,
                    summary.median_residual().unwrap_or(0.0),
                    summary.largest_residual().unwrap_or(0.0),
                ),
                Err(error) => {
                    eprintln!("{}: {error}", setting.name);
                    return ExitCode::FAILURE;
                }
            }
        }
    }
    ExitCode::SUCCESS
}
