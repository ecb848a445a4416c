//! Several boxes by tumble, for `scripts/bench`: a scene as JSON on standard input, what became
//! of it as JSON on standard output.

use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};
use tumble_core::mechanics::State;
use tumble_core::simulation::StepRecord;
use tumble_core::solver::native::NativeSolver;
use tumble_core::step::StepStatus;
use tumble_measure::BenchScene;

type BoxesFailure = Box<dyn std::error::Error>;

/// A step counts as certified with a residual of at most this, m/s.
const CERTIFIED: f64 = 1e-9;

/// A scene, and what is to be kept of it.
#[derive(Deserialize)]
struct BoxesRequest {
    #[serde(flatten)]
    scene: BenchScene,
    /// Steps before those that are timed, counted and kept.
    #[serde(default)]
    untimed: usize,
    /// Whether to keep the states; a timed run does not.
    record: bool,
    /// Whether to time each step although they are not kept.
    #[serde(default)]
    each: bool,
    /// What steps are solved to, m/s; 1e-9 where it is not said.
    residual: Option<f64>,
}

/// What came out.
#[derive(Serialize, Default)]
struct BoxesOutcome {
    /// Of the stepping, certificates included, processor time.
    seconds: f64,
    /// Of the slowest step; 0 if steps are neither timed nor kept.
    slowest_seconds: f64,
    /// What memory grew by to its peak, KiB.
    memory_kib: u64,
    /// Steps with a residual of at most 1e-9 m/s.
    certified: usize,
    /// Steps that the simulation calls failed.
    failed: usize,
    /// The largest residual, m/s.
    residual: f64,
    /// The most contacts in a step, and all steps' iterations.
    contacts: usize,
    iterations: u64,
    /// r, q, v, ω of each box, the start first; empty if not recorded.
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
        // A NaN would become null and end the comparison, as it should.
        let larger = residual > self.residual || residual.is_nan();
        self.residual = if larger { residual } else { self.residual };
    }
}

fn rows(states: &[State]) -> Vec<[f64; 13]> {
    states.iter().map(|state| state.to_vector().into()).collect()
}

/// Processor time of this process, s.
fn clock() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// A line of Linux's /proc/self/status in KiB: `VmRSS:` is what is resident, `VmHWM:` its peak.
fn memory(name: &str) -> u64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix(name));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}
