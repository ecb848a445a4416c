//! A simulation with its last step, as one thread has it.

use crate::last_step::LastStep;
use crate::recording::{Recording, add_forces};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tumble::error::Error;
use tumble::mechanics::Wrench;
use tumble::simulation::tables::TableStep;
use tumble::simulation::{self, StepRecord};

/// A simulation and its last step.
pub struct Running {
    pub simulation: simulation::Simulation<'static>,
    pub last: LastStep,
    /// How long the last single step took.
    pub took: Option<Duration>,
    /// Whether nothing moved it so far but what the scene says; `None` where nobody knows.
    pub is_of_scene: Option<bool>,
}

impl Running {
    /// Pushes all bodies from now on by these wrenches, six numbers of each.
    pub fn set_wrenches(&mut self, numbers: &[f64]) -> Result<(), Error> {
        if numbers.iter().any(|number| *number != 0.0) {
            self.is_of_scene = Some(false);
        }
        numbers.chunks_exact(6).enumerate().try_for_each(|(body, six)| {
            let (force, torque) = six.split_at(3);
            let wrench = Wrench {
                force: nalgebra::Vector3::from_column_slice(force),
                torque: nalgebra::Vector3::from_column_slice(torque),
            };
            self.simulation.set_wrench(body, wrench)
        })
    }

    /// A step; `rests` is whether it begins at rest.
    pub fn step(&mut self, rests: bool) -> Result<(), Error> {
        let Self { simulation, last, .. } = self;
        // One that rests on has the contacts of the one before, to the last bit.
        let taken = simulation.step(last.repeat());
        if !(taken.is_ok() && rests && simulation.rests()) {
            last.change();
        }
        taken
    }

    /// `steps` steps into `recording`, with the wrenches of each where some are given.
    pub fn run(
        &mut self,
        steps: usize,
        wrenches: Option<&[f64]>,
        recording: &mut Recording,
        done: &AtomicU64,
    ) -> Result<(), Error> {
        recording.rows.reserve(steps.min(1 << 20) + 1);
        let width = 6 * self.simulation.states().len();
        for step in 0..steps {
            if let Some(wrenches) = wrenches {
                self.set_wrenches(&wrenches[step * width..][..width])?;
            }
            self.simulation.step(self.last.change())?;
            let mut row = TableStep::of(self.simulation.world(), self.last.record());
            add_forces(&row, &mut recording.forces);
            if !recording.has_contacts {
                row.contacts = Vec::new();
                row.row.contacts = 0;
            }
            recording.rows.push(row);
            done.fetch_add(1, Ordering::Relaxed);
        }
        Ok(())
    }

    /// The state now, as the last row of a recording.
    pub fn end(&self) -> TableStep {
        let mut end = StepRecord::new();
        self.simulation.end(&mut end);
        TableStep::of(self.simulation.world(), &end)
    }
}
