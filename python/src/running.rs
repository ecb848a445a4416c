//! A simulation with its last step, owned by one thread.

use crate::arrays::to_wrenches;
use crate::last_step::LastStep;
use crate::recording::PyRecording;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use tumble::rollout::Driven;
use tumble_core::contact::Contact;
use tumble_core::error::Error;
use tumble_core::mechanics::State;
use tumble_core::simulation::save::{Saved, from_bytes, to_bytes};
use tumble_core::simulation::{self, Interval, Motion, StepRecord};
use tumble_core::step::{StepSolution, StepStatus};
use tumble_scene::output::tables::IntervalRows;
use tumble_scene::scene::Scene;

/// Notes in a saved state:
///
/// - start states, contacts and solution of the last step;
/// - true if only inputs of the scene moved the run;
/// - text stored by the Python side.
type StepNotes<'a> = (&'a str, LastInterval, Option<bool>, &'a str);

/// States, length, length before, contacts and solution of the last interval.
type LastInterval = (Vec<State>, f64, Vec<f64>, Vec<Contact>, StepSolution);

/// Tag of these notes.
const NOTES: &str = "python 2";

/// Inputs of each step of a run, one step after the other.
#[derive(Default)]
pub struct StepInputs<'a> {
    pub wrenches: Option<&'a [f64]>,
    /// Targets of motors.
    pub motors: Option<&'a [f64]>,
    pub joint_forces: Option<&'a [f64]>,
}

/// A simulation and its last step.
pub struct Running {
    pub simulation: simulation::Simulation<'static>,
    pub last: LastStep,
    /// Duration of the last single step.
    pub took: Option<Duration>,
    /// True if only inputs of the scene moved it so far; `None` if unknown.
    pub is_of_scene: Option<bool>,
}

impl Running {
    /// Restores a simulation of `scene` with `motion` from a state saved by [`Running::saved_with`]
    /// or the command line. Also returns the stored text, or an empty one.
    pub fn restored(
        scene: &Scene,
        motion: Motion<'static>,
        saved: &Saved,
    ) -> Result<(Self, String), Error> {
        let simulation = simulation::Simulation::restored(scene.world.clone(), motion, saved)?;
        let mut running =
            Self { simulation, last: LastStep::none(), took: None, is_of_scene: None };
        // A state saved by the command line has no last step.
        let Ok((NOTES, interval, is_of_scene, kept)) = from_bytes::<StepNotes<'_>>(saved.notes())
        else {
            return Ok((running, String::new()));
        };
        running.is_of_scene = is_of_scene;
        let (states, length, before, contacts, solution) = interval;
        if states.len() == running.simulation.states().len()
            && contacts.iter().all(|contact: &Contact| contact.key.body < states.len())
        {
            let mut interval = Interval::new(states, contacts, solution);
            (interval.length, interval.before) = (length, before);
            *running.last.change_bodies() = interval.into();
        }
        Ok((running, kept.to_owned()))
    }

    /// Serialises the simulation and the text `kept`.
    pub fn saved_with(&mut self, kept: &str) -> Result<Vec<u8>, Error> {
        let record = self.last.record();
        // Of a divided step, only its last interval is kept.
        let Interval { states, length, before, contacts, solution, .. } = record.last();
        let interval = (states, length, before, contacts, solution);
        let notes = to_bytes(&(NOTES, interval, self.is_of_scene, kept))?;
        self.simulation.save().with_notes(notes).to_bytes()
    }

    /// Sets the wrenches on all bodies for the following steps, six numbers per body.
    pub fn set_wrenches(&mut self, numbers: &[f64]) -> Result<(), Error> {
        if numbers.iter().any(|number| *number != 0.0) {
            self.is_of_scene = Some(false);
        }
        let mut wrenches = to_wrenches(numbers).enumerate();
        wrenches.try_for_each(|(body, wrench)| self.simulation.set_wrench(body, wrench))
    }

    /// Takes a step. `rests` is true if it begins at rest.
    pub fn step(&mut self, rests: bool) -> Result<(), Error> {
        let Self { simulation, last, .. } = self;
        // A step that stays at rest has exactly the contacts of the previous one.
        let taken = simulation.step(last.repeat());
        if !(taken.is_ok() && rests && simulation.rests()) {
            last.change();
        }
        taken
    }

    /// Takes `steps` steps and returns how many of them failed or are wild.
    pub fn unsolved_of(&mut self, steps: usize) -> Result<usize, Error> {
        let mut unsolved = 0;
        for _ in 0..steps {
            self.step(self.simulation.rests())?;
            let status = self.last.record().status();
            unsolved += usize::from(matches!(status, StepStatus::Failed | StepStatus::Wild));
        }
        Ok(unsolved)
    }

    /// Takes `steps` steps with their inputs and records them.
    pub fn run<'i>(
        &mut self,
        steps: usize,
        inputs: &StepInputs<'i>,
        recording: &mut PyRecording,
        done: &AtomicU64,
    ) -> Result<(), Error> {
        recording.rows.reserve(steps.min(1 << 20) + 1);
        let driven = Driven::new(self.simulation.world());
        if inputs.motors.is_some() || inputs.joint_forces.is_some() {
            self.is_of_scene = Some(false);
        }
        for step in 0..steps {
            let now = |all: Option<&'i [f64]>| {
                let all = all.unwrap_or_default();
                let width = all.len() / steps;
                &all[step * width..][..width]
            };
            self.set_wrenches(now(inputs.wrenches))?;
            let (forces, targets) = (now(inputs.joint_forces), now(inputs.motors));
            driven.set(&mut self.simulation, forces, targets)?;
            self.simulation.step(self.last.change())?;
            let record = self.last.record();
            let bodies = 0..record.states().len();
            recording.forces.extend(bodies.map(|body| record.mean_force(body)));
            for rows in IntervalRows::from_step(self.simulation.world(), record) {
                recording.add(rows);
            }
            done.fetch_add(1, Ordering::Relaxed);
        }
        Ok(())
    }

    /// Current state as the last row of a recording.
    pub fn end(&self) -> IntervalRows {
        let mut end = StepRecord::new();
        self.simulation.end(&mut end);
        IntervalRows::new(self.simulation.world(), end.index, 0, end.first())
    }
}
