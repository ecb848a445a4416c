//! Islands solved in parallel, on threads that wait between steps.
//!
//! Each island is a separate problem with its own memory. Results do not depend on the thread.

use super::island_problem::{IslandProblem, ProblemPool, SolveAccuracy};
use super::islands::{IslandPartition, IslandView};
use super::settings::SETTLED;
use crate::contact::Contact;
use crate::error::Error;
use crate::step::Step;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::num::NonZeroUsize;
use std::sync::Arc;

/// Smallest amount of work for threads, in resting contacts. One takes 0.12 µs, and waking the
/// threads takes 10 µs (`bench/measure/src/bin/islands.rs`).
const LEAST_WORK: usize = 512;
/// Cost of a contact in an unsettled island, in resting contacts. It is at least 0.5 µs for a
/// sliding box, and 6 µs in a heap.
const UNSETTLED: usize = 8;

/// Largest number of threads.
const MOST_THREADS: usize = 1024;

/// Threads of a solver and its copies.
#[derive(Debug, Clone)]
pub(super) struct Threads {
    pool: Arc<ThreadPool>,
}

impl Threads {
    /// Starts `count` threads. `None` for one, which is the caller's.
    ///
    /// # Errors
    /// Too many threads, or threads that cannot be started.
    pub(super) fn new(count: NonZeroUsize) -> Result<Option<Self>, Error> {
        let count = count.get();
        if count > MOST_THREADS {
            return Err(Error::Count { field: "threads", count, allowed: "1 to 1024" });
        }
        if count == 1 {
            return Ok(None);
        }
        let pool = ThreadPoolBuilder::new().num_threads(count).build();
        let pool = pool.map_err(|error| Error::Solver {
            solver: "the native solver",
            why: format!("its threads cannot be started: {error}"),
        })?;
        Ok(Some(Self { pool: Arc::new(pool) }))
    }

    /// True if solving takes longer than waking the threads.
    pub(super) fn are_worth_it(&self, islands: &IslandPartition) -> bool {
        let mut work = 0;
        let of = |island: &IslandView<'_>| {
            if island.unsettled > SETTLED {
                UNSETTLED * island.contacts.len()
            } else {
                island.contacts.len()
            }
        };
        // True from the second island on.
        islands.changed().enumerate().any(|(index, (_, island))| {
            work += of(&island);
            index > 0 && work >= LEAST_WORK
        })
    }

    /// Solves the problem of every changed island, each in its part.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if the step was interrupted.
    pub(super) fn solve(
        &self,
        step: &Step<'_>,
        contacts: &[Contact],
        islands: &IslandPartition,
        parts: &mut ProblemPool,
        asked: SolveAccuracy,
    ) -> Result<(), Error> {
        let parts = parts.all().par_iter_mut().with_max_len(1);
        let solve =
            |part: &mut IslandProblem| match part.island().and_then(|n| islands.changed_one(n)) {
                Some(island) => part.solve(step, contacts, &island, asked),
                None => Ok(()),
            };
        self.pool.install(|| parts.try_for_each(solve))
    }
}
