//! Islands solved at the same time, on threads that wait between steps. Each is a problem of its own
//! in memory of its own, so that what comes out does not depend on who solves it.

use super::islands::Islands;
use super::part::Part;
use crate::contact::Contact;
use crate::error::Error;
use crate::step::Step;
use rayon::prelude::*;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::num::NonZeroUsize;
use std::sync::Arc;

/// With fewer contacts in the islands to be solved, waking a thread takes longer than what it would do.
const LEAST_CONTACTS: usize = 64;

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

    /// Whether what is to be solved is more than asking takes.
    pub(super) fn are_worth_it(&self, islands: &Islands) -> bool {
        let mut contacts = 0;
        let sizes = islands.changed().map(|(_, island)| island.contacts.len());
        // From the second island on.
        sizes.enumerate().any(|(index, size)| {
            contacts += size;
            index > 0 && contacts >= LEAST_CONTACTS
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
        islands: &Islands,
        parts: &mut [Part],
        accepted: f64,
    ) -> Result<(), Error> {
        let parts = parts[..islands.len()].par_iter_mut().with_max_len(1).enumerate();
        let solve = |(number, part): (usize, &mut Part)| match islands.changed_one(number) {
            Some(island) => part.solve(step, contacts, &island, accepted),
            None => Ok(()),
        };
        self.pool.install(|| parts.try_for_each(solve))
    }
}
