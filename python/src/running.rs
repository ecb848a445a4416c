//! A simulation with its last step, as one thread has it.

use crate::last_step::LastStep;
use crate::recording::{PyRecording, add_forces};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tumble_core::contact::Contact;
use tumble_core::error::Error;
use tumble_core::mechanics::{State, Wrench};
use tumble_core::simulation::save::{Saved, from_bytes, to_bytes};
use tumble_core::simulation::{self, Motion, StepRecord};
use tumble_core::step::StepSolution;
use tumble_scene::output::tables::TableStep;
use tumble_scene::scene::Scene;

/// What a saved state has besides: of the last step its start, its contacts and its solution; whether nothing moved it but
/// what the scene says; and what Python's side of it keeps, in words of its own.
type StepNotes<'a> = (&'a str, Vec<State>, Vec<Contact>, StepSolution, Option<bool>, &'a str);

/// What these begin with.
const NOTES: &str = "python";

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
    /// One of `scene`, moved by `motion`, that goes on from where `saved` is, of [`Running::saved_with`] or of the
    /// command line; and what was kept besides, or nothing.
    pub fn restored(
        scene: &Scene,
        motion: Motion<'static>,
        saved: &Saved,
    ) -> Result<(Self, String), Error> {
        let simulation = simulation::Simulation::restored(scene.world.clone(), motion, saved)?;
        let mut running =
            Self { simulation, last: LastStep::none(), took: None, is_of_scene: None };
        // What the command line saves tells nothing of the last step.
        let Ok((NOTES, states, contacts, solution, is_of_scene, kept)) =
            from_bytes::<StepNotes<'_>>(saved.notes())
        else {
            return Ok((running, String::new()));
        };
        running.is_of_scene = is_of_scene;
        if states.len() == running.simulation.states().len()
            && contacts.iter().all(|contact: &Contact| contact.key.body < states.len())
        {
            let record = StepRecord { states, contacts, solution, ..StepRecord::new() };
            *running.last.change_bodies() = record;
        }
        Ok((running, kept.to_owned()))
    }

    /// Where it is, and `kept` besides, as bytes.
    pub fn saved_with(&mut self, kept: &str) -> Result<Vec<u8>, Error> {
        let record = self.last.record();
        let (states, contacts, solution) = (&record.states, &record.contacts, &record.solution);
        let notes = to_bytes(&(NOTES, states, contacts, solution, self.is_of_scene, kept))?;
        self.simulation.save().with_notes(notes).to_bytes()
    }

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
        recording: &mut PyRecording,
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
