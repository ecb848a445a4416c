//! Counts of the native solver's initial points on throws, heaps, scene files and robot files.
//!
//! Arguments: `cargo run --release -p tumble-measure --bin starts -- THROWS HEAPS FILES…`. The
//! throw runs with the seeds 0 to THROWS − 1 and every heap with HEAPS seeds, 1000 steps each. Each
//! file runs for its own number of steps. A step of several islands counts once. It counts for the
//! first island whose solution did not come from the last impulses.
//!
//! The exit code is 2 for a bad argument. Unsolved steps are part of the result and do not change
//! it.

#[path = "../heaps.rs"]
mod heaps;

use heaps::HEAPS;
use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_core::step::StepStatus;
use tumble_model::failure::Failure;
use tumble_scene::choices::{SceneName, SolverName};
use tumble_scene::scene::Scene;
use tumble_scene::settings::{Settings, SolverTable};
use tumble_scene::tutorial::CubeChanges;

/// First seed of the heaps.
const FIRST_SEED: u32 = 101;

/// Counts over the steps of a campaign.
#[derive(Default)]
struct StartCounts {
    steps: u64,
    contact: u64,
    /// Number of steps by initial point, with the names of the report.
    starts: BTreeMap<&'static str, u64>,
    iterations: u64,
    failed: u64,
    substepped: u64,
    wild: u64,
    /// Largest residual of solved steps (m/s).
    worst: f64,
    time: Duration,
}

impl StartCounts {
    /// Simulates `steps` steps.
    fn run(&mut self, simulation: &mut Simulation<'_>, steps: u64) -> Result<(), Box<dyn Error>> {
        let mut record = StepRecord::new();
        for _ in 0..steps {
            let begin = Instant::now();
            simulation.step(&mut record)?;
            self.time += begin.elapsed();
            self.add(&record);
        }
        Ok(())
    }

    fn add(&mut self, record: &StepRecord) {
        let report = &record.report;
        self.steps += 1;
        self.iterations += u64::from(report.iterations);
        self.contact += u64::from(report.status != StepStatus::Free);
        if let Some(start) = report.start {
            *self.starts.entry(start).or_default() += 1;
        }
        match report.status {
            StepStatus::Failed => self.failed += 1,
            StepStatus::Substepped => self.substepped += 1,
            StepStatus::Wild => self.wild += 1,
            _ => {}
        }
        if !matches!(report.status, StepStatus::Failed) {
            self.worst = self.worst.max(record.certificate.residual());
        }
    }

    fn print(&self, name: &str) {
        println!(
            "{name:24} {:9} {:9} {:5} {:5} {:5} {:9.1e} {:9.2} {:9.2}  {}",
            self.steps,
            self.contact,
            self.failed,
            self.substepped,
            self.wild,
            self.worst,
            self.iterations as f64 / self.steps as f64,
            1e6 * self.time.as_secs_f64() / self.steps as f64,
            self.starts
                .iter()
                .map(|(start, count)| format!("{start} {count}"))
                .collect::<Vec<_>>()
                .join(", "),
        );
    }
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [throws, heaps, files @ ..] = &arguments[..] else {
        eprintln!("usage: starts THROWS HEAPS FILES…");
        return Ok(ExitCode::from(2));
    };
    let (Ok(throws), Ok(heaps)) = (throws.parse::<u32>(), heaps.parse::<u32>()) else {
        eprintln!("starts: THROWS and HEAPS are numbers of seeds, 0 or more");
        return Ok(ExitCode::from(2));
    };
    println!(
        "{:24} {:>9} {:>9} {:>5} {:>5} {:>5} {:>9} {:>9} {:>9}  starts",
        "campaign", "steps", "contact", "fail", "sub", "wild", "worst m/s", "iter/step", "µs/step"
    );
    let text_of = |failure: Failure| failure.to_string();
    let interrupt = Arc::new(AtomicBool::new(false));
    let of_scene = |scene: &Scene, counts: &mut StartCounts| -> Result<(), Box<dyn Error>> {
        let mut simulation = scene.simulation(&interrupt).map_err(text_of)?;
        counts.run(&mut simulation, (scene.rows - 1) * scene.substeps)
    };
    if throws > 0 {
        let mut counts = StartCounts::default();
        for seed in 0..throws {
            let solver = SolverTable { name: Some(SolverName::Native), ..SolverTable::default() };
            let flags =
                Settings { seed: Some(seed), steps: Some(1000), solver, ..Settings::default() };
            let scene = Scene::from_tutorial(SceneName::Drop, flags, CubeChanges::default())
                .map_err(text_of)?;
            of_scene(&scene, &mut counts)?;
        }
        counts.print("throws");
    }
    for heap in HEAPS {
        let mut counts = StartCounts::default();
        for seed in FIRST_SEED..FIRST_SEED + heaps {
            counts.run(&mut heap.begin(seed)?, 1000)?;
        }
        if heaps > 0 {
            counts.print(&format!("{} {} {}", heap.name, heap.bodies, heap.friction));
        }
    }
    for file in files {
        let path = Path::new(file);
        let text = std::fs::read_to_string(path)?;
        let read = |path: &Path, _: u64| std::fs::read(path);
        let scene = Scene::from_text(&text, path, Settings::default(), &read).map_err(text_of)?;
        let mut counts = StartCounts::default();
        of_scene(&scene, &mut counts)?;
        counts.print(&path.file_stem().unwrap_or_default().to_string_lossy());
    }
    Ok(ExitCode::SUCCESS)
}
