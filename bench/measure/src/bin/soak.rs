//! Long runs of the drop scene in one process, with statistics of the steps and of the memory.
//!
//! `scripts/soak` runs it; `docs/soak.md` has its results.

use std::process::ExitCode;
use std::time::Instant;
use tumble::solver::ipopt::{IpoptSolver, Ladder, MOST_ITERATIONS, Rung, TOLERANCE};
use tumble_core::contact::detection::Detection;
use tumble_core::error::Error;
use tumble_core::simulation::scene::{self, TutorialScene};
use tumble_core::simulation::{Motion, Simulation, StepRecord};
use tumble_core::solver::native::NativeSolver;
use tumble_core::step::{StepSolver, StepStatus};
use tumble_core::world::World;

const USAGE: &str = "usage: soak [NATIVE_STEPS [IPOPT_STEPS]] | soak seeds FIRST END";
/// Number of steps for the native solver and for Ipopt.
const STEPS: [u64; 2] = [100_000, 10_000];
/// Steps per throw: the scene has 1000 rows.
const THROW: u64 = 999;
/// Allowed growth of memory after the warm-up (KiB); the allocator varies by this much.
const ALLOWED: i64 = 2048;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Who {
    Native,
    Ipopt,
}

/// Counts of the steps. Its memory does not grow with their number.
#[derive(Default)]
struct SoakCounts {
    steps: u64,
    by_status: [u64; 6],
    /// Largest residual (m/s) with its seed and step.
    worst: Option<(f64, u32, u64)>,
}

const STATUSES: [StepStatus; 6] = [
    StepStatus::Free,
    StepStatus::Converged,
    StepStatus::Retried,
    StepStatus::Fallback,
    StepStatus::Wild,
    StepStatus::Failed,
];

impl SoakCounts {
    fn add(&mut self, seed: u32, record: &StepRecord) {
        self.steps += 1;
        for (count, status) in self.by_status.iter_mut().zip(STATUSES) {
            *count += u64::from(record.report.status == status);
        }
        let residual = record.certificate.residual();
        if self.worst.is_none_or(|(worst, ..)| residual > worst || residual.is_nan()) {
            self.worst = Some((residual, seed, record.index));
        }
    }

    fn print(&self, name: &str) {
        print!("{name:7} {:8} steps:", self.steps);
        for (count, status) in self.by_status.iter().zip(STATUSES) {
            print!(" {status} {count}");
        }
        match self.worst {
            Some((worst, seed, k)) => {
                println!("; largest residual {worst:.1e} m/s (seed {seed}, k = {k})");
            }
            None => println!(),
        }
    }
}

fn world() -> Result<World, Error> {
    World::new(scene::tutorial_parameters()?)
}

fn solver(world: &World, who: Who) -> Result<Box<dyn StepSolver>, Error> {
    if who == Who::Native {
        return Ok(Box::new(NativeSolver::new(world)));
    }
    let options = IpoptSolver::options(TOLERANCE, MOST_ITERATIONS);
    let ipopt = IpoptSolver::new(world, options)?;
    Ok(Box::new(Ladder::new(world, ipopt, &Rung::ALL)))
}

/// Simulates the throw with `seed` for at most `most` steps. Returns their number.
fn throw(who: Who, seed: u32, most: u64, counts: &mut SoakCounts) -> Result<u64, Error> {
    let (world, scene) = (world()?, TutorialScene::drop());
    let start = scene.start(scene.attitude(seed));
    let mut record = StepRecord::new();
    let solver = solver(&world, who)?;
    let motion = Motion::Contact { detection: Detection::default(), solver };
    let mut simulation = Simulation::new(world, [start], motion)?;
    let steps = most.min(THROW);
    for _ in 0..steps {
        simulation.step(&mut record)?;
        counts.add(seed, &record);
    }
    Ok(steps)
}

/// Resident memory (KiB): `VmRSS` of Linux.
fn resident() -> i64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("VmRSS:"));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

/// Simulates consecutive seeds, each with a new simulation and solver, until `steps` steps are
/// done.
///
/// Returns the growth of the memory after the first throw (KiB).
fn soak(who: Who, steps: u64) -> Result<i64, Error> {
    let (mut counts, mut seed, mut tenths) = (SoakCounts::default(), 0, 0_u64);
    let (mut after_warm_up, clock) = (resident(), Instant::now());
    print!("{who:?}: resident memory, KiB: {after_warm_up} at the start;");
    while counts.steps < steps {
        throw(who, seed, steps - counts.steps, &mut counts)?;
        seed += 1;
        if seed == 1 {
            // One whole throw touches all code and all scratch memory.
            after_warm_up = resident();
            print!(" {after_warm_up} after the first throw;");
        }
        while tenths < 10 && (tenths + 1) * steps <= 10 * counts.steps {
            tenths += 1;
            print!(" {}", resident());
        }
    }
    let grown = resident() - after_warm_up;
    println!("; {} at the end, {grown:+} after the warm-up", resident());
    counts.print(&format!("{who:?}"));
    println!("{:?}: {seed} throws in {:.1} s", who, clock.elapsed().as_secs_f64());
    Ok(grown)
}

/// Simulates throws by the native solver with the seeds from `first` to `end` − 1.
fn seeds(first: u32, end: u32) -> Result<(), Error> {
    let (mut counts, clock) = (SoakCounts::default(), Instant::now());
    for seed in first..end {
        throw(Who::Native, seed, THROW, &mut counts)?;
    }
    counts.print("Native");
    println!("seeds {first} to before {end} in {:.1} s", clock.elapsed().as_secs_f64());
    Ok(())
}

fn run(args: &[String]) -> Result<ExitCode, Error> {
    let numbers =
        |args: &[String]| -> Option<Vec<u64>> { args.iter().map(|arg| arg.parse().ok()).collect() };
    match args {
        [verb, range @ ..] if verb == "seeds" => {
            let range: Option<Vec<u32>> = range.iter().map(|arg| arg.parse().ok()).collect();
            let Some([first, end]) = range.as_deref() else { return Ok(usage()) };
            seeds(*first, *end)?;
            Ok(ExitCode::SUCCESS)
        }
        counts if counts.len() <= 2 => {
            let Some(given) = numbers(counts) else { return Ok(usage()) };
            let steps = |k: usize| given.get(k).copied().unwrap_or(STEPS[k]);
            let grown = [soak(Who::Native, steps(0))?, soak(Who::Ipopt, steps(1))?];
            let fits = grown.iter().all(|grown| *grown <= ALLOWED);
            if !fits {
                eprintln!("soak: memory grew by more than {ALLOWED} KiB");
            }
            Ok(if fits { ExitCode::SUCCESS } else { ExitCode::FAILURE })
        }
        _ => Ok(usage()),
    }
}

fn usage() -> ExitCode {
    eprintln!("{USAGE}");
    ExitCode::from(2)
}

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    run(&args).unwrap_or_else(|error| {
        eprintln!("soak: {error}");
        ExitCode::FAILURE
    })
}
