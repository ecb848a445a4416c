//! Data of a running simulation, and its threads after a fork.

use crate::coordinates::LastCoordinates;
use crate::errors::refused;
use crate::query::Placed;
use crate::running::Running;
use pyo3::{PyErr, PyResult};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use tumble_core::error::Error;
use tumble_core::simulation::Motion;
use tumble_scene::scene::Scene as Content;

/// Data used by one call at a time.
pub struct Owned {
    pub content: Arc<Content>,
    pub running: Running,
    pub interrupt: Arc<AtomicBool>,
    /// True if the solver has threads of its own.
    pub threads: bool,
    /// Process of the threads. A forked process does not have them.
    pub process: u32,
    /// Text stored in the restored state, until it is read.
    pub kept: String,
    pub coordinates: LastCoordinates,
}

impl Owned {
    /// Scene at the current states.
    pub fn placed(&self) -> Placed<'_> {
        let simulation = &self.running.simulation;
        Placed { content: &self.content, world: simulation.world(), states: simulation.states() }
    }

    /// Time t = k h, s.
    pub fn time(&self) -> f64 {
        let simulation = &self.running.simulation;
        simulation.index() as f64 * simulation.world().time_step()
    }

    /// Converts an error with the names of the scene.
    pub fn named(&self, error: &Error) -> PyErr {
        refused(error.display(&*self.content))
    }

    /// Marks the run as moved by inputs outside the scene.
    pub fn moved(&mut self) -> &mut Running {
        self.running.is_of_scene = Some(false);
        &mut self.running
    }

    /// True in a process forked after the threads were created.
    fn has_lost_threads(&self) -> bool {
        self.threads && self.process != std::process::id()
    }

    /// Switches to the caller's thread alone if the threads are lost, with the same results.
    pub fn leave_lost_threads(&mut self) -> PyResult<()> {
        if self.has_lost_threads() {
            let motion = self.content.motion(&self.content.world).map_err(refused)?;
            self.move_by(motion);
            self.threads = false;
        }
        Ok(())
    }

    /// Replaces the motion. The old one is not dropped, because its lost threads cannot be joined.
    fn move_by(&mut self, mut motion: Motion<'static>) {
        self.running.simulation.swap_motion(&mut motion);
        std::mem::forget(motion);
    }
}

impl Drop for Owned {
    fn drop(&mut self) {
        if self.has_lost_threads() {
            self.move_by(Motion::Floating);
        }
    }
}
