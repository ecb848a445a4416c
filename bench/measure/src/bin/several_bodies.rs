//! Scenes of several boxes in tumble, for `scripts/bench`.
//!
//! The program reads a scene as JSON from standard input and writes the result as JSON to standard
//! output.

use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};
use tumble_core::mechanics::State;
use tumble_core::simulation::StepRecord;
use tumble_core::solver::native::NativeSolver;
use tumble_core::step::StepStatus;
use tumble_measure::BenchScene;

type BoxesFailure = Box<dyn std::error::Error>;

/// Largest residual of a certified step (m/s).
const CERTIFIED: f64 = 1e-9;

/// Scene and output options.
#[derive(Deserialize)]
struct BoxesRequest {
    #[serde(flatten)]
    scene: BenchScene,
    /// Number of steps before the timed and recorded ones.
    #[serde(default)]
    untimed: usize,
    /// True to record the states; a timed run does not.
    record: bool,
    /// True to time each step without recording.
    #[serde(default)]
    each: bool,
    /// Target residual (m/s); the default is 1e-9.
    residual: Option<f64>,
}

/// Result of a run.
#[derive(Serialize, Default)]
struct BoxesOutcome {
    /// Processor time of the steps, including certificates (s).
    seconds: f64,
    /// Time of the slowest step (s); 0 if steps are neither timed nor recorded.
    slowest_seconds: f64,
    /// Growth of memory to its peak (KiB).
    memory_kib: u64,
    /// Number of steps with a residual of at most 1e-9 m/s.
    certified: usize,
    /// Number of steps with the status failed.
    failed: usize,
    /// Largest residual (m/s).
    residual: f64,
    /// Largest number of contacts in a step, and the sum of all iterations.
    contacts: usize,
    iterations: u64,
    /// State r, q, v, ω of each box, starting with the initial state; empty if not recorded.
    states: Vec<Vec<[f64; 13]>>,
}

fn main() -> Result<(), BoxesFailure> {
    let request: BoxesRequest = serde_json::from_reader(std::io::stdin())?;
    let before = memory("VmRSS:");
    let world = request.scene.world()?;
    let solver = NativeSolver::new(&world);
    let solver = match request.residual {
        Some(residual) => solver.with_residual(residual)?,
        None => solver,
    };
    let mut simulation = request.scene.begin(&world, solver)?;
    let mut record = StepRecord::new();
    let mut outcome = BoxesOutcome::default();
    for _ in 0..request.untimed {
        simulation.step(&mut record)?;
    }
    if request.record {
        outcome.states.push(rows(simulation.states()));
    }
    let start = clock();
    let mut last = start;
    for _ in 0..request.scene.steps {
        simulation.step(&mut record)?;
        outcome.add(&record);
        if request.record || request.each {
            outcome.slowest_seconds = outcome.slowest_seconds.max(clock() - last);
            if request.record {
                outcome.states.push(rows(simulation.states()));
            }
            last = clock();
        }
    }
    outcome.seconds = clock() - start;
    outcome.memory_kib = memory("VmHWM:").saturating_sub(before);
    serde_json::to_writer(std::io::stdout(), &outcome)?;
    Ok(())
}

impl BoxesOutcome {
    fn add(&mut self, record: &StepRecord) {
        let residual = record.certificate.residual();
        self.certified += usize::from(residual <= CERTIFIED);
        self.failed += usize::from(record.report.status == StepStatus::Failed);
        self.contacts = self.contacts.max(record.contacts.len());
        self.iterations += u64::from(record.report.iterations);
        // A NaN becomes null in JSON, which ends the comparison as intended.
        let larger = residual > self.residual || residual.is_nan();
        self.residual = if larger { residual } else { self.residual };
    }
}

fn rows(states: &[State]) -> Vec<[f64; 13]> {
    states.iter().map(|state| state.to_vector().into()).collect()
}

/// Processor time of this process (s).
fn clock() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Value in Linux's /proc/self/status (KiB): `VmRSS:` is resident memory, `VmHWM:` its peak.
fn memory(name: &str) -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix(name));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}
