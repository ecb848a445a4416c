//! Derivatives of a number of every rollout by what the rollout started from: products with the transposed
//! derivative of the whole run ([`Simulation::gradient`]), on as many threads as are given.

use super::batch::Batch;
use super::run::{RolloutError, Watch, begin};
use super::threads::each;
use crate::derivative::StateChange;
use crate::error::Error;
use crate::mechanics::State;
use crate::simulation::{Checkpoints, Run, RunGradient, Simulation};
use crate::world::Constant;
use std::num::NonZeroUsize;
use std::sync::atomic::Ordering;

/// Differentiates a number of each rollout of `batch`, of which `by_ends` are the derivatives by the states after the
/// last step: (B, N, 12), in the order of a [`StateChange`]. They are derivatives by the states at the start, by the
/// controls, and by `constants`: one [`RunGradient`] a rollout.
///
/// # Errors
/// As [`roll_out`](super::roll_out), and where a step [has no derivative](Simulation::linearise).
pub fn gradients(
    batch: &Batch<'_>,
    by_ends: &[f64],
    constants: &[Constant],
    threads: NonZeroUsize,
    watch: Watch<'_>,
) -> Result<Vec<RunGradient>, RolloutError> {
    let width = StateChange::LEN * batch.world.bodies().len();
    let refused = |error| RolloutError { rollout: None, error };
    batch.check(&super::Outputs::default()).map_err(refused)?;
    if by_ends.len() != batch.rollouts * width {
        let (field, count) = ("derivatives by the ends", by_ends.len());
        return Err(refused(Error::Count { field, count, allowed: "(B, N, 12)" }));
    }
    let interrupted = || watch.interrupt.is_some_and(|flag| flag.load(Ordering::Relaxed));
    each(by_ends.chunks_exact(width), threads, interrupted, |rollout, by_end, (): &mut ()| {
        one(batch, rollout, by_end, constants, watch)
    })
}

/// Those of one rollout.
fn one(
    batch: &Batch<'_>,
    rollout: usize,
    by_end: &[f64],
    constants: &[Constant],
    watch: Watch<'_>,
) -> Result<RunGradient, Error> {
    let mut simulation = begin(batch, rollout, watch)?;
    let steps = batch.steps as u64;
    let change = |numbers: &[f64]| {
        StateChange::from_array(&std::array::from_fn(|k| numbers.get(k).copied().unwrap_or(0.0)))
    };
    let mut by_states = |k: u64, _: &[State]| {
        (k == steps).then(|| by_end.chunks_exact(StateChange::LEN).map(change).collect())
    };
    let mut before = |simulation: &mut Simulation<'_>| batch.set(rollout, simulation);
    let mut run = Run {
        steps,
        before: &mut before,
        by_states: &mut by_states,
        constants,
        checkpoints: Checkpoints::default(),
    };
    let found = simulation.gradient(&mut run)?;
    if let Some(done) = watch.done {
        done.fetch_add(steps, Ordering::Relaxed);
    }
    Ok(found)
}
