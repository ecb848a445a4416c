//! Tosses of a solid cube with the same start and many coefficients of friction, on all cores. The
//! table shows the rest position, the time until rest and the sliding distance. It does not depend
//! on the number of threads.
//!
//! `cargo run --release --example friction_sweep` or, for 3 threads, `cargo run --release --example
//! friction_sweep -- 3`
//!
//! Exit code 3 if a step did not converge, 2 for a bad number.

use nalgebra::Vector3;
use std::error::Error;
use std::num::NonZeroUsize;
use std::process::ExitCode;
use std::thread;
use tumble::{
    Motion, Parameters, RigidBody, Simulation, State, StepRecord, StepStatus, World,
    random_attitude, tutorial_parameters,
};

/// Half side of the cube, m.
const HALF_SIDE: f64 = 0.1;
/// Initial speed along x, m/s.
const SPEED: f64 = 3.0;
/// Speed limit of rest, m/s. A cube slower than this for a tenth of a second is at rest.
const REST: f64 = 1e-6;
/// Longest simulated time of a toss, s.
const LONGEST: f64 = 10.0;

/// Result of one toss.
#[derive(Debug, Clone, Default)]
struct Outcome {
    friction: f64,
    /// Rest position, m.
    rest: Vector3<f64>,
    /// Time at which it came to rest, s; `None` if it did not.
    time: Option<f64>,
    /// Sliding distance, m.
    slid: f64,
    /// Largest residual of a step, m/s.
    largest_residual: f64,
    failed: u32,
}

/// Sliding distance of the contact in a step, m: slips of the points weighted by normal forces.
fn slip(record: &StepRecord, time_step: f64) -> f64 {
    let contacts = &record.solution.contacts;
    let load: f64 = contacts.iter().map(|contact| contact.normal_force).sum();
    let weighted: f64 =
        contacts.iter().map(|contact| contact.normal_force * contact.slip.norm()).sum();
    if load > 0.0 { time_step * weighted / load } else { 0.0 }
}

fn toss(friction: f64) -> Result<Outcome, tumble_core::error::Error> {
    let body = RigidBody::solid_box(1.0, Vector3::repeat(HALF_SIDE))?;
    let bodies = vec![body];
    let world = World::new(Parameters { bodies, friction, ..tutorial_parameters()? })?;
    let start = State {
        position: Vector3::new(0.0, 0.0, 0.5),
        attitude: random_attitude(42),
        velocity: Vector3::new(SPEED, 0.0, 0.0),
        spin: Vector3::new(0.0, 10.0, 5.0),
    };
    let h = world.time_step();
    let motion = Motion::native(&world);
    let mut simulation = Simulation::new(world, [start], motion)?;
    let mut record = StepRecord::new();
    let mut outcome = Outcome { friction, ..Outcome::default() };
    let mut resting = 0.0;
    while simulation.index() as f64 * h < LONGEST && resting < 0.1 {
        simulation.step(&mut record)?;
        outcome.slid += slip(&record, h);
        outcome.largest_residual = outcome.largest_residual.max(record.certificate.residual());
        outcome.failed += u32::from(record.report.status == StepStatus::Failed);
        let state = simulation.state();
        let moves = state.velocity.norm() + HALF_SIDE * state.spin.norm() > REST;
        resting = if moves { 0.0 } else { resting + h };
    }
    outcome.rest = simulation.state().position;
    outcome.time = (resting > 0.0).then(|| simulation.index() as f64 * h - resting);
    Ok(outcome)
}

/// Simulates every toss and returns the results in the order of `frictions`.
fn sweep(
    frictions: &[f64],
    threads: NonZeroUsize,
) -> Result<Vec<Outcome>, tumble_core::error::Error> {
    let mut outcomes = vec![Ok(Outcome::default()); frictions.len()];
    let share = frictions.len().div_ceil(threads.get()).max(1);
    thread::scope(|scope| {
        for (frictions, outcomes) in frictions.chunks(share).zip(outcomes.chunks_mut(share)) {
            scope.spawn(move || {
                for (&friction, outcome) in frictions.iter().zip(outcomes) {
                    *outcome = toss(friction);
                }
            });
        }
    });
    outcomes.into_iter().collect()
}

fn main() -> Result<ExitCode, Box<dyn Error>> {
    let threads = match std::env::args().nth(1).map(|threads| threads.parse()) {
        None => thread::available_parallelism()?,
        Some(Ok(threads)) => threads,
        Some(Err(_)) => {
            eprintln!("a number of threads from 1 is needed, for example: 3");
            return Ok(ExitCode::from(2));
        }
    };
    let frictions: Vec<f64> = (1..=12).map(|k| f64::from(k) / 10.0).collect();
    let outcomes = sweep(&frictions, threads)?;

    println!("   μ  rest at (m)             after (s)  slid (m)     residual (m/s)  failed");
    for outcome in &outcomes {
        let [x, y, z] = outcome.rest.into();
        let time = outcome.time.map_or("-".to_owned(), |time| format!("{time:.3}"));
        println!(
            "{:4.1}  {x:6.3} {y:6.3} {z:8.6}  {time:>9}  {:8.3}  {:17.1e}  {:6}",
            outcome.friction, outcome.slid, outcome.largest_residual, outcome.failed,
        );
    }
    let failed = outcomes.iter().any(|outcome| outcome.failed > 0);
    Ok(ExitCode::from(if failed { 3 } else { 0 }))
}
