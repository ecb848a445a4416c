//! Islands solved at the same time, on threads that wait between steps. Each is a problem of its own
//! in memory of its own, so that what comes out does not depend on who solves it.

use super::islands::{IslandParts, IslandView};
use super::part::{IslandPart, PartRequest, Parts};
use super::settings::SETTLED;
use crate::contact::Contact;
use crate::error::Error;
use crate::step::Step;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::num::NonZeroUsize;
use std::sync::Arc;

/// How much there must be to solve, in contacts at rest: these take 0.12 µs each, and asking the
/// threads takes 10 µs until they are awake and what they did is known (`examples/islands.rs`).
const LEAST_WORK: usize = 512;
/// How many contacts at rest one of an island that has not settled is like, at least: 0.5 µs for a
/// box that slides, 6 µs in a heap.
const UNSETTLED: usize = 8;

/// More threads than this are a mistake.
const MOST_THREADS: usize = 1024;

/// Threads of a solver and its copies.
#[derive(Debug, Clone)]
pub(super) struct Threads {
    pool: Arc<ThreadPool>,
}

impl Threads {
    /// So many threads; `None` for one, which is the caller's.
    ///
    /// # Errors
    /// Too many, or threads that cannot be started.
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

    /// Whether what is to be solved takes longer than asking the threads.
    pub(super) fn are_worth_it(&self, islands: &IslandParts) -> bool {
        let mut work = 0;
        let of = |island: &IslandView<'_>| match island.unsettled > SETTLED {
            true => UNSETTLED * island.contacts.len(),
            false => island.contacts.len(),
        };
        // From the second island on.
        islands.changed().enumerate().any(|(index, (_, island))| {
            work += of(&island);
            index > 0 && work >= LEAST_WORK
        })
    }

    /// Solves the problem of every island that changed, each in its part.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if the step was.
    pub(super) fn solve(
        &self,
        step: &Step<'_>,
        contacts: &[Contact],
        islands: &IslandParts,
        parts: &mut Parts,
        asked: PartRequest,
    ) -> Result<(), Error> {
        let parts = parts.all().par_iter_mut().with_max_len(1);
        let solve = |part: &mut IslandPart| match part.island().and_then(|n| islands.changed_one(n))
        {
            Some(island) => part.solve(step, contacts, &island, asked),
            None => Ok(()),
        };
        self.pool.install(|| parts.try_for_each(solve))
    }
}
