//! The rollouts of a batch on as many threads as are given.

use super::run::RolloutError;
use crate::error::Error;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

/// Does `one` for every rollout, which gets its number, its `share` of the outputs, and memory of its thread. The results
/// are in the order of the rollouts, whatever the number of threads.
///
/// # Errors
/// The first rollout that is refused, by its index; [`Error::Interrupted`] where `interrupted` says so.
pub(super) fn each<S: Send, M: Default, R: Send>(
    shares: impl ExactSizeIterator<Item = S> + Send,
    threads: NonZeroUsize,
    interrupted: impl Fn() -> bool + Sync,
    one: impl Fn(usize, S, &mut M) -> Result<R, Error> + Sync,
) -> Result<Vec<R>, RolloutError> {
    let rollouts = shares.len();
    // They are handed out in order. One that is refused ends the handing out, so that those before
    // it have all been begun: the first refusal is the same on any number of threads.
    let queue = Mutex::new(shares.enumerate());
    let refused = AtomicBool::new(false);
    let work = || {
        let (mut found, mut memory) = (Vec::new(), M::default());
        while !refused.load(Ordering::Relaxed) && !interrupted() {
            let next = queue.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some((rollout, share)) = next else { break };
            let result = one(rollout, share, &mut memory);
            if result.is_err() {
                refused.store(true, Ordering::Relaxed);
            }
            found.push((rollout, result));
        }
        found
    };
    let helpers = threads.get().min(rollouts) - 1;
    let mut results = thread::scope(|scope| {
        let helpers: Vec<_> = (0..helpers)
            // Where no more threads are to be had, those that run do all the work.
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
    results.sort_unstable_by_key(|(rollout, _)| *rollout);
    let complete = results.len() == rollouts;
    let mut all = Vec::with_capacity(rollouts);
    for (rollout, result) in results {
        match result {
            Ok(part) => all.push(part),
            Err(Error::Interrupted) => {}
            Err(error) => return Err(RolloutError { rollout: Some(rollout), error }),
        }
    }
    if interrupted() || !complete {
        return Err(RolloutError { rollout: None, error: Error::Interrupted });
    }
    Ok(all)
}
