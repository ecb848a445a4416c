//! Steps of many simulations at once.

use crate::errors::step_error;
use crate::running::Running;
use crate::simulation::PySimulation;
use pyo3::prelude::*;
use std::panic::resume_unwind;
use std::sync::{Mutex, PoisonError};
use std::thread;

/// Takes `steps` steps of each simulation, on at most `threads` threads. Returns the number of failed
/// or wild steps of each.
#[pyfunction]
pub fn step_all(
    py: Python<'_>,
    simulations: Vec<PyRef<'_, PySimulation>>,
    steps: usize,
    threads: usize,
) -> PyResult<Vec<usize>> {
    let mut owned = Vec::new();
    for simulation in &simulations {
        let mut own = simulation.owned()?;
        own.leave_lost_threads()?;
        owned.push(own);
    }
    let all: Vec<&mut Running> = owned.iter_mut().map(|own| &mut own.running).collect();
    let count = all.len();
    let queue = Mutex::new(all.into_iter().enumerate());
    let work = || {
        let mut found = Vec::new();
        loop {
            let next = queue.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some((index, running)) = next else { return found };
            found.push((index, running.unsolved_of(steps)));
        }
    };
    let mut found = py.detach(|| {
        thread::scope(|scope| {
            let helpers = threads.min(count).saturating_sub(1);
            let helpers: Vec<_> = (0..helpers)
                // If no more threads can be spawned, the running ones do all the work.
                .map_while(|_| thread::Builder::new().spawn_scoped(scope, work).ok())
                .collect();
            let mut found = work();
            for helper in helpers {
                match helper.join() {
                    Ok(more) => found.extend(more),
                    Err(panic) => resume_unwind(panic),
                }
            }
            found
        })
    });
    found.sort_unstable_by_key(|(index, _)| *index);
    found.into_iter().map(|(_, unsolved)| unsolved.map_err(|error| step_error(&error))).collect()
}
