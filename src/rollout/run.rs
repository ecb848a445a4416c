//! Execution of rollouts on several threads.

use super::batch::{Batch, RolloutOutputs};
use super::watch::RolloutWatch;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use tumble_core::error::Error;
use tumble_core::simulation::{Simulation, StepRecord};
use tumble_core::step::StepStatus;

/// Number of steps between two progress reports.
const CHUNK: usize = 64;

/// A step that failed or is wild.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unsolved {
    /// Index of the rollout.
    pub rollout: usize,
    /// Step index k, from 0.
    pub step: usize,
    /// Status: [`StepStatus::Failed`] or [`StepStatus::Wild`].
    pub status: StepStatus,
    /// Residual of the step, m/s.
    pub residual: f64,
}

/// Counts of step results.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RolloutTally {
    /// Number of steps with each status, in the order of [`StepStatus::ALL`].
    pub statuses: [u64; StepStatus::ALL.len()],
    /// Number of steps that applied only a [part](StepRecord::restitution_share) of their
    /// restitution, because full restitution would have created energy.
    pub tempered: u64,
    /// Largest residual, m/s.
    pub largest_residual: f64,
}

/// Report of a batch: 80 bytes per rollout and 32 per step that failed or is wild.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RolloutReport {
    /// Tally of all steps.
    pub all: RolloutTally,
    /// Tally of each rollout.
    pub each: Vec<RolloutTally>,
    /// Every step that failed or is wild, sorted by rollout and step.
    pub unsolved: Vec<Unsolved>,
}

/// Error that ended a batch early.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{}{error}", rollout.map_or(String::new(), |index| format!("rollout {index}: ")))]
pub struct RolloutError {
    /// First rollout with refused input; `None` if the error concerns all rollouts.
    pub rollout: Option<usize>,
    /// Cause.
    pub error: Error,
}

/// Simulates all rollouts of `batch` on at most `threads` threads and fills `outputs`. The number
/// of threads changes neither numbers nor report. The simulation continues after a step that did
/// not converge; the report lists it.
///
/// # Errors
/// Arrays with other lengths than [`Batch`] and [`RolloutOutputs`] define; the first rollout by
/// index whose world, start or control is refused; [`Error::Interrupted`]. The outputs may then be
/// partly filled.
pub fn roll_out(
    batch: &Batch<'_>,
    outputs: RolloutOutputs<'_>,
    threads: NonZeroUsize,
    watch: RolloutWatch<'_>,
) -> Result<RolloutReport, RolloutError> {
    batch.check(&outputs).map_err(|error| RolloutError { rollout: None, error })?;
    let shares = outputs.shares(batch.rollouts);
    let results = hand_out(shares, batch.rollouts, threads, watch, |rollout, share, record| {
        one(batch, rollout, share, record, watch)
    })?;
    let mut report = RolloutReport::default();
    results.into_iter().for_each(|part| report.add(part));
    Ok(report)
}

/// Applies `work` to each of `count` items on at most `threads` threads and returns the results in
/// order. Each thread has its own record.
pub(super) fn hand_out<S: Send, T: Send>(
    items: impl Iterator<Item = S> + Send,
    count: usize,
    threads: NonZeroUsize,
    watch: RolloutWatch<'_>,
    work: impl Fn(usize, S, &mut StepRecord) -> Result<T, Error> + Sync,
) -> Result<Vec<T>, RolloutError> {
    let interrupted = || watch.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed));
    // Items are handed out in order, and a refusal ends this. All earlier items have then been
    // started, so the first refusal is the same on any number of threads.
    let queue = Mutex::new(items.enumerate());
    let refused = AtomicBool::new(false);
    let work = || {
        let mut found = Vec::new();
        let mut record = StepRecord::new();
        while !refused.load(Ordering::Relaxed) && !interrupted() {
            let next = queue.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some((rollout, share)) = next else { break };
            let result = work(rollout, share, &mut record);
            if result.is_err() {
                refused.store(true, Ordering::Relaxed);
            }
            found.push((rollout, result));
        }
        found
    };
    // The calling thread works too.
    let helpers = threads.get().min(count) - 1;
    let mut results = thread::scope(|scope| {
        let helpers: Vec<_> = (0..helpers)
            // If no more threads can be spawned, the running ones do all the work.
            .map_while(|_| thread::Builder::new().spawn_scoped(scope, work).ok())
            .collect();
        let mut results = work();
        for helper in helpers {
            match helper.join() {
                Ok(found) => results.extend(found),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        results
    });
    // Results in the order of the items
    results.sort_unstable_by_key(|(rollout, _)| *rollout);
    let mut all = Vec::with_capacity(count);
    for (rollout, result) in results {
        match result {
            Ok(found) => all.push(found),
            Err(Error::Interrupted) => {}
            Err(error) => return Err(RolloutError { rollout: Some(rollout), error }),
        }
    }
    if interrupted() || all.len() != count {
        return Err(RolloutError { rollout: None, error: Error::Interrupted });
    }
    Ok(all)
}

/// Simulates one rollout.
fn one(
    batch: &Batch<'_>,
    rollout: usize,
    share: RolloutOutputs<'_>,
    record: &mut StepRecord,
    watch: RolloutWatch<'_>,
) -> Result<RolloutReport, Error> {
    let (mut simulation, driven) = batch.simulation(rollout, watch)?;
    let RolloutOutputs { states, ends, forces, residuals, statuses } = share;
    let bodies = simulation.states().len();
    let mut report = RolloutReport::default();
    let mut counted = 0;
    for step in 0..batch.steps {
        batch.set(&driven, rollout, step, &mut simulation)?;
        simulation.step(record)?;
        report.count(rollout, step, record);
        // Outputs that are not requested are empty.
        if !states.is_empty() {
            copy_states(&simulation, &mut states[step * bodies * 13..][..bodies * 13]);
        }
        if !forces.is_empty() {
            let numbers = forces[step * bodies * 3..][..bodies * 3].chunks_exact_mut(3);
            for (body, numbers) in numbers.enumerate() {
                numbers.copy_from_slice(record.first().solution.total_force(body).as_slice());
            }
        }
        if let Some(residual) = residuals.get_mut(step) {
            *residual = record.residual();
        }
        if let Some(status) = statuses.get_mut(step) {
            *status = place(record.status());
        }
        // Progress is counted in chunks, because the counter is shared between threads.
        if (step + 1) % CHUNK == 0 || step + 1 == batch.steps {
            if let Some(done) = watch.done {
                done.fetch_add((step + 1 - counted) as u64, Ordering::Relaxed);
            }
            counted = step + 1;
        }
    }
    copy_states(&simulation, ends);
    report.each = vec![report.all];
    Ok(report)
}

/// Copies the states of all bodies, as far as the buffer has space.
fn copy_states(simulation: &Simulation<'_>, numbers: &mut [f64]) {
    for (numbers, state) in numbers.chunks_exact_mut(13).zip(simulation.states()) {
        numbers.copy_from_slice(state.to_vector().as_slice());
    }
}

/// Index of a status in [`StepStatus::ALL`].
fn place(status: StepStatus) -> u8 {
    StepStatus::ALL.iter().position(|known| *known == status).unwrap_or(0) as u8
}

impl RolloutTally {
    /// Number of steps.
    pub fn steps(&self) -> u64 {
        self.statuses.iter().sum()
    }

    /// Number of steps with this status.
    pub fn count(&self, status: StepStatus) -> u64 {
        self.statuses[usize::from(place(status))]
    }

    fn add(&mut self, other: &Self) {
        for (sum, count) in self.statuses.iter_mut().zip(other.statuses) {
            *sum += count;
        }
        self.tempered += other.tempered;
        // A NaN counts as the largest.
        if self.largest_residual < other.largest_residual || other.largest_residual.is_nan() {
            self.largest_residual = other.largest_residual;
        }
    }
}

impl RolloutReport {
    /// Number of all steps.
    pub fn steps(&self) -> u64 {
        self.all.steps()
    }

    fn count(&mut self, rollout: usize, step: usize, record: &StepRecord) {
        let status = record.status();
        let residual = record.residual();
        let mut statuses = [0; StepStatus::ALL.len()];
        statuses[usize::from(place(status))] = 1;
        let tempered = u64::from(record.restitution_share() < 1.0);
        self.all.add(&RolloutTally { statuses, tempered, largest_residual: residual });
        if !status.is_solved() {
            self.unsolved.push(Unsolved { rollout, step, status, residual });
        }
    }

    fn add(&mut self, part: Self) {
        self.all.add(&part.all);
        self.each.extend(part.each);
        self.unsolved.extend(part.unsolved);
    }
}
