//! Statistics of the solver on heaps: solved steps and successful initial points. No test uses
//! these seeds.
//!
//! `cargo run --release -p tumble-measure --bin heaps`, optionally with the number of seeds, the
//! steps per run and the first seed: `… -- 16 2500 101`. A fourth argument selects a scene
//! (`boxes`, `sticks`, `balls`, `mixed`, `ratio`, `dense`, `wall`).
//!
//! The exit code is 2 for a bad argument. Unsolved steps are part of the result and do not change
//! it.

#[path = "../heaps.rs"]
mod heaps;

use heaps::{HEAPS, Heap};
use std::error::Error;
use std::process::ExitCode;
use std::time::Instant;
use tumble_core::simulation::StepRecord;
use tumble_core::step::StepStatus;

/// Counts over the runs of a scene.
#[derive(Default)]
struct HeapCounts {
    contact: u32,
    retried: u32,
    failed: u32,
    wild: u32,
    /// Runs whose last step needed at most one iteration per body from the first initial point.
    still: u32,
    /// Largest residual of unsolved steps (m/s).
    worst: f64,
    /// Largest overlap (m).
    overlap: f64,
    contacts: usize,
    iterations: u64,
    /// Slowest step (s).
    slowest: f64,
    time: f64,
}

impl HeapCounts {
    fn add(&mut self, record: &StepRecord, seconds: f64) {
        self.contact += u32::from(record.report.status != StepStatus::Free);
        match record.report.status {
            StepStatus::Retried => self.retried += 1,
            StepStatus::Wild => self.wild += 1,
            StepStatus::Failed => {
                self.failed += 1;
                self.worst = self.worst.max(record.certificate.residual());
            }
            _ => {}
        }
        self.overlap = self.overlap.max(record.overlap);
        self.contacts = self.contacts.max(record.contacts.len());
        self.iterations += u64::from(record.report.iterations);
        self.slowest = self.slowest.max(seconds);
        self.time += seconds;
    }
}

fn run(
    heap: &Heap,
    seeds: std::ops::Range<u32>,
    steps: u32,
) -> Result<HeapCounts, tumble_core::error::Error> {
    let mut counts = HeapCounts::default();
    for seed in seeds {
        let mut simulation = heap.begin(seed)?;
        let mut record = StepRecord::new();
        for _ in 0..steps {
            let begin = Instant::now();
            simulation.step(&mut record)?;
            counts.add(&record, begin.elapsed().as_secs_f64());
        }
        let few = record.report.iterations as usize <= heap.bodies;
        counts.still += u32::from(record.report.status == StepStatus::Converged && few);
    }
    Ok(counts)
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |place: usize, default: u32| match arguments.get(place) {
        Some(text) => text.parse().ok(),
        None => Some(default),
    };
    let known = |name: &String| HEAPS.iter().any(|heap| heap.name == name);
    let (Some(seeds @ 1..), Some(steps @ 1..), Some(first), true, ..=4) = (
        number(0, 4),
        number(1, 1000),
        number(2, 1),
        arguments.get(3).is_none_or(known),
        arguments.len(),
    ) else {
        eprintln!("usage: heaps [SEEDS [STEPS [FIRST_SEED [SCENE]]]], numbers of at least 1");
        return Ok(ExitCode::from(2));
    };
    println!(
        "scene    bodies  mu  contact steps  retried     wild   failed  worst failed  still  overlap  \
         contacts  iterations  slowest  a step"
    );
    let wanted = |heap: &&Heap| arguments.get(3).is_none_or(|name| name == heap.name);
    for heap in HEAPS.iter().filter(wanted) {
        let counts = run(heap, first..first.saturating_add(seeds), steps)?;
        let part = |number: u32| 100.0 * f64::from(number) / f64::from(counts.contact.max(1));
        println!(
            "{:8} {:6} {:3} {:14} {:7.2}% {:8} {:8} {:9.1e} m/s {:6} {:5.2} mm {:9} {:11.2} {:5.0} ms {:5.0} µs",
            heap.name,
            heap.bodies,
            heap.friction,
            counts.contact,
            part(counts.retried),
            counts.wild,
            counts.failed,
            counts.worst,
            counts.still,
            1e3 * counts.overlap,
            counts.contacts,
            counts.iterations as f64 / f64::from(counts.contact.max(1)),
            1e3 * counts.slowest,
            1e6 * counts.time / f64::from(seeds * steps),
        );
    }
    Ok(ExitCode::SUCCESS)
}
