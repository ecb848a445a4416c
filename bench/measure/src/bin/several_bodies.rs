//! Time of a scene of several boxes in tumble, for `scripts/bench`.
//!
//! The program reads a scene as JSON from standard input and writes the result as JSON to standard
//! output.

use rustix::time::{ClockId, clock_gettime};
use serde::{Deserialize, Serialize};
use tumble_core::simulation::StepRecord;
use tumble_core::solver::native::NativeSolver;
use tumble_measure::BenchScene;

type BoxesFailure = Box<dyn std::error::Error>;

/// Scene and options.
#[derive(Deserialize)]
struct BoxesRequest {
    #[serde(flatten)]
    scene: BenchScene,
    /// Number of steps before the timed ones.
    #[serde(default)]
    untimed: usize,
    /// Target residual (m/s); the default is 1e-9.
    residual: Option<f64>,
}

/// Result of a run.
#[derive(Serialize)]
struct BoxesOutcome {
    /// Processor time of the steps, including certificates (s).
    seconds: f64,
    /// Growth of memory to its peak (KiB).
    memory_kib: u64,
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
    for _ in 0..request.untimed {
        simulation.step(&mut record)?;
    }
    let start = clock();
    for _ in 0..request.scene.steps {
        simulation.step(&mut record)?;
    }
    let seconds = clock() - start;
    let memory_kib = memory("VmHWM:").saturating_sub(before);
    serde_json::to_writer(std::io::stdout(), &BoxesOutcome { seconds, memory_kib })?;
    Ok(())
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
