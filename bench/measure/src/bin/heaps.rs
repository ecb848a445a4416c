//! How many steps of heaps are solved, and from which start: other seeds than those of any test.
//!
//! `cargo run --release -p tumble-measure --bin heaps` or, for another number of seeds, steps of a run and first seed,
//! `… -- 16 2500 101`; with the name of a scene (`boxes`, `sticks`, `balls`, `mixed`, `ratio`, `dense`,
//! `wall`) behind them, that scene alone.
//!
//! Exit code 2 for a bad argument. Steps that are not solved are what is counted here: they do not
//! change the code.

#[path = "../heaps.rs"]
mod heaps;

use heaps::{HEAPS, Heap};
use std::error::Error;
use std::process::ExitCode;
use std::time::Instant;
use tumble_core::simulation::StepRecord;
use tumble_core::step::StepStatus;

/// What the runs of a scene came to.
#[derive(Default)]
struct HeapCounts {
    contact: u32,
    retried: u32,
    failed: u32,
    wild: u32,
    /// Runs whose last step took no more iterations than one a body, from the first start.
    still: u32,
    /// Of steps that were not solved, m/s.
    worst: f64,
    /// m.
    overlap: f64,
    contacts: usize,
    /// s.
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
         contacts  slowest  a step"
    );
    let wanted = |heap: &&Heap| arguments.get(3).is_none_or(|name| name == heap.name);
    for heap in HEAPS.iter().filter(wanted) {
        let counts = run(heap, first..first.saturating_add(seeds), steps)?;
        let part = |number: u32| 100.0 * f64::from(number) / f64::from(counts.contact.max(1));
        println!(
            "{:8} {:6} {:3} {:14} {:7.2}% {:8} {:8} {:9.1e} m/s {:6} {:5.2} mm {:9} {:5.0} ms {:5.0} µs",
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
            1e3 * counts.slowest,
            1e6 * counts.time / f64::from(seeds * steps),
        );
    }
    Ok(ExitCode::SUCCESS)
}
