//! The simulation loop: one step after another, each with its report and certificate.
//!
//! A step is free flight, [detection](crate::contact::detection) of the contacts, a
//! solver for their forces, and the
//! [certificate](crate::contact::certificate) that judges the answer. Around it: starts
//! ([`scene`], [`random`]), what is kept of a step ([`record`]) and of a run ([`summary`]).

mod assembly;
mod balance;
mod bodies;
pub mod bounce;
mod driving;
pub mod energy;
#[cfg(feature = "save")]
pub mod gradient;
mod islands;
mod linearised;
mod locked;
mod median;
mod motion;
mod one_step;
mod parts;
pub mod random;
pub mod record;
mod rest;
#[cfg(feature = "save")]
pub mod save;
pub mod scene;
mod squeeze;
mod start;
mod stiffness;
pub mod summary;
pub mod wild;

pub use assembly::Assembly;
pub use balance::EnergyBalance;
#[cfg(feature = "save")]
pub use gradient::{Checkpoints, Run, RunGradient};
pub use locked::{Finding, Lock};
pub use motion::Motion;
pub use record::StepRecord;
#[cfg(feature = "save")]
pub use save::Saved;
pub use squeeze::Squeeze;
pub use start::JOINT_AT_THE_START;
pub use stiffness::Stiffness;

use crate::contact::certificate::Certifier;
use crate::contact::{Candidates, Memory};
use crate::error::Error;
use crate::joint::JointForce;
use crate::mechanics::{Load, State, Wrench};
use crate::step::{StepSolution, StepStatus};
use crate::world::World;
use bounce::Bounce;
use one_step::{contact_step, floating_step};
#[cfg(feature = "save")]
use std::cell::OnceCell;
use std::mem::{swap, take};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// More steps than this are not counted: a time k h is one double.
const MOST_STEPS: u64 = 1 << 53;

/// A running simulation.
pub struct Simulation<'a> {
    world: World,
    motion: Motion<'a>,
    /// What acts on each body from outside.
    outside: Vec<Outside>,
    /// What drives the joints over time.
    driving: driving::Driving,
    interrupt: Option<Arc<AtomicBool>>,
    index: u64,
    /// The solution that led to step k: X at k and the forces of the step before, the start
    /// of the next.
    now: StepSolution,
    /// The same for k − 1, where the last step can be taken back, and for k − 2, which that step
    /// has seen.
    before: Option<StepSolution>,
    long_before: Option<StepSolution>,
    /// Whether the last step was taken back already.
    taken_back: bool,
    /// Whether its steps are parts of one, which are not taken in parts again.
    is_part: bool,
    scratch: StepScratch,
    /// That of the world, once it was asked for.
    #[cfg(feature = "save")]
    digest: OnceCell<u64>,
}

/// The external wrench on a body, gravity apart.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
struct Outside {
    wrench: Wrench,
    load: Load,
}

impl Outside {
    fn nothing() -> Self {
        Self { wrench: Wrench::zero(), load: Load::none() }
    }
}

/// The solutions that a step can see.
#[derive(Clone, Copy)]
struct Past<'a> {
    now: &'a StepSolution,
    before: Option<&'a StepSolution>,
}

/// Memory that steps use again.
#[derive(Default)]
struct StepScratch {
    wrenches: Vec<Wrench>,
    free: Vec<State>,
    candidates: Candidates,
    /// What the search knew before the step, where that may be interrupted.
    rewind: Memory,
    bounce: Bounce,
    solution: StepSolution,
    certifier: Certifier,
    judge: wild::EnergyJudge,
    stiffness: Stiffness,
    /// What squeezed in a step that failed.
    squeeze: Option<Squeeze>,
    rest: rest::RestingBodies,
}

impl<'a> Simulation<'a> {
    /// A simulation of `world` from `states`, one a body.
    ///
    /// # Errors
    /// Another number of states than bodies; a state that [`State::checked`] refuses; pieces that
    /// overlap by more than [a start may](Candidates::overlap_at_start); with [`Motion::Contact`], a
    /// contact point deeper below the ground than the [contact band](crate::contact::detection::CONTACT_BAND). Both is 5 mm for a
    /// reach of 1 m: a step takes every point out of what it is in, with the speed that this needs, a
    /// thousand metres a second for three metres. Within the band lie the states of recorded runs,
    /// which a run may start from again.
    pub fn new(
        world: World,
        states: impl IntoIterator<Item = State>,
        motion: Motion<'a>,
    ) -> Result<Self, Error> {
        let bodies = world.bodies().len();
        let states =
            states.into_iter().map(|state| state.checked()).collect::<Result<Vec<_>, _>>()?;
        if states.len() != bodies {
            return Err(Error::Count {
                field: "states at the start",
                count: states.len(),
                allowed: "one a body",
            });
        }
        let mut candidates = Candidates::new();
        let touches = matches!(motion, Motion::Contact { .. });
        start::check(&world, &states, &[], touches, &mut candidates, |_| true)?;
        Self::at(world, &states, motion, candidates)
    }

    /// At rest from all that was before, in `states`, one a body, wherever they are.
    fn at(
        world: World,
        states: &[State],
        motion: Motion<'a>,
        candidates: Candidates,
    ) -> Result<Self, Error> {
        if matches!(motion, Motion::Floating) && !world.joints().is_empty() {
            return Err(Error::Unsupported {
                what: "joints of a floating body",
                why: "the Runge-Kutta method knows no forces; use the contact step",
            });
        }
        let angles = world.angles_near(states, &[]).into_iter();
        let joints = angles.map(JointForce::none).collect();
        let gears = vec![0.0; world.gears().len()];
        let now = StepSolution { joints, gears, ..StepSolution::free(states) };
        Ok(Self {
            outside: vec![Outside::nothing(); world.bodies().len()],
            world,
            motion,
            driving: driving::Driving::default(),
            interrupt: None,
            index: 0,
            now,
            before: None,
            long_before: None,
            taken_back: false,
            is_part: false,
            scratch: StepScratch { candidates, ..StepScratch::default() },
            #[cfg(feature = "save")]
            digest: OnceCell::new(),
        })
    }

    /// The world.
    #[must_use]
    pub fn world(&self) -> &World {
        &self.world
    }

    /// X at the current step, one a body.
    #[must_use]
    pub fn states(&self) -> &[State] {
        &self.now.states
    }

    /// X at the current step of the first body.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.now.states[0]
    }

    /// k.
    #[must_use]
    pub fn index(&self) -> u64 {
        self.index
    }

    /// Calls the state now that of step `index`, at the time index h: loads are those of the times from there
    /// on. The last step cannot be taken back any more.
    ///
    /// # Errors
    /// More steps than a time of k h can tell apart, 2⁵³.
    pub fn set_index(&mut self, index: u64) -> Result<(), Error> {
        if index >= MOST_STEPS {
            let count = usize::try_from(index).unwrap_or(usize::MAX);
            return Err(Error::Count { field: "index of the step", count, allowed: "below 2^53" });
        }
        self.index = index;
        self.taken_back = true;
        Ok(())
    }

    /// Sets the state of body `index` now, as if it had come to be there: with other velocities, or
    /// somewhere else. The forces of the last step stay what the next one starts from, as far as their
    /// contacts are still there; the last step cannot be taken back any more.
    ///
    /// # Errors
    /// What [`Simulation::new`] refuses of a start, of this body alone; a body that is not there. The
    /// state then stays what it was.
    pub fn set_state(&mut self, index: usize, state: State) -> Result<(), Error> {
        self.outside_mut(index)?;
        let state = state.checked()?;
        self.exchange_states(&[(index, state)])
    }

    /// Sets the states of all bodies now, as [`Simulation::set_state`]: those that a joint ties
    /// can only be moved together.
    ///
    /// # Errors
    /// Another number of states than bodies; as [`Simulation::set_state`].
    pub fn set_states(&mut self, states: &[State]) -> Result<(), Error> {
        let count = states.len();
        if count != self.now.states.len() {
            return Err(Error::Count { field: "states", count, allowed: "one a body" });
        }
        let checked = states.iter().enumerate().map(|(body, state)| Ok((body, state.checked()?)));
        let checked = checked.collect::<Result<Vec<_>, Error>>()?;
        self.exchange_states(&checked)
    }

    /// Sets these states, if the bodies that they move elsewhere may start there.
    fn exchange_states(&mut self, states: &[(usize, State)]) -> Result<(), Error> {
        let Self { world, motion, now, scratch, .. } = self;
        let before = now.states.clone();
        for (body, state) in states {
            now.states[*body] = *state;
        }
        let StepScratch { candidates, rewind, rest, .. } = scratch;
        rest.end();
        rewind.copy_from(candidates.memory());
        let is_moved = |body: usize| before[body].pose() != now.states[body].pose();
        let touches = matches!(motion, Motion::Contact { .. });
        let near: Vec<_> = now.joints.iter().map(|joint| joint.angles).collect();
        if let Err(error) = start::check(world, &now.states, &near, touches, candidates, is_moved) {
            candidates.recall(world, rewind);
            now.states = before;
            return Err(error);
        }
        let angles = world.angles_near(&now.states, &near);
        now.joints.iter_mut().zip(angles).for_each(|(joint, angles)| joint.angles = angles);
        self.taken_back = true;
        Ok(())
    }

    /// Exchanges what moves the bodies from here on with `motion`, which must be made for this
    /// simulation's world: to repeat a step with another solver, after
    /// [`Simulation::take_back`].
    pub fn swap_motion(&mut self, motion: &mut Motion<'a>) {
        self.scratch.rest.end();
        swap(&mut self.motion, motion);
    }

    /// Sets the external wrench on body `index` in the steps to come (force in N, world; torque
    /// in N m, body), gravity and the load apart: for a program that decides it from step to
    /// step.
    ///
    /// # Errors
    /// A body that is not there; a wrench that [`Wrench::validate`] refuses. The wrench before
    /// it stays.
    pub fn set_wrench(&mut self, index: usize, wrench: Wrench) -> Result<(), Error> {
        wrench.validate()?;
        self.outside_mut(index)?.wrench = wrench;
        Ok(())
    }

    /// Sets the external load on body `index` over time, counted from step 0.
    ///
    /// # Errors
    /// A body that is not there.
    pub fn set_load(&mut self, index: usize, load: Load) -> Result<(), Error> {
        self.outside_mut(index)?.load = load;
        Ok(())
    }

    fn outside_mut(&mut self, index: usize) -> Result<&mut Outside, Error> {
        let missing = Error::Count { field: "body", count: index, allowed: "an index of a body" };
        self.outside.get_mut(index).ok_or(missing)
    }

    /// Gives up a step with [`Error::Interrupted`] soon after `flag` is raised, whoever solves
    /// it, and takes no other while it is.
    pub fn interrupt_by(&mut self, flag: Arc<AtomicBool>) {
        self.interrupt = Some(flag);
    }

    /// Advances by one step and describes it in `record`. A step that did not converge is taken
    /// all the same, with its status in the report.
    ///
    /// # Errors
    /// Only where a step could not be posed or was interrupted; the simulation stays where it
    /// was.
    pub fn step(&mut self, record: &mut StepRecord) -> Result<(), Error> {
        if self.interrupt.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            return Err(Error::Interrupted);
        }
        self.set_wrenches();
        record.wrenches.clone_from(&self.scratch.wrenches);
        record.unsolved.clear();
        self.scratch.squeeze = None;
        if self.scratch.rest.is_known() && self.rest(record) {
            return Ok(());
        }
        self.driving.set(&mut self.world, &self.now.states, self.index);
        let Self { world, motion, interrupt, now, before, scratch, .. } = &mut *self;
        let (report, certificate, share) = match motion {
            Motion::Floating => {
                let (report, certificate) = floating_step(world, &now.states, scratch);
                (report, certificate, 1.0)
            }
            Motion::Contact { detection, solver } => {
                let past = Past { now, before: before.as_ref() };
                let (interrupt, solver) = (interrupt.as_deref(), solver.as_mut());
                let StepScratch { rest, candidates, wrenches, .. } = &mut *scratch;
                rest.begin(now, before.as_ref(), candidates.memory(), solver, wrenches);
                // Where no pieces can meet there is nothing to go back to.
                let rewinds = interrupt.is_some() && !candidates.memory().is_empty();
                if rewinds {
                    scratch.rewind.copy_from(scratch.candidates.memory());
                }
                let taken = contact_step(world, past, *detection, solver, interrupt, scratch);
                if taken.is_err() {
                    scratch.rest.end();
                }
                if taken.is_err() && rewinds {
                    // What the search found in a part of a step is not to be found again.
                    scratch.candidates.recall(world, &scratch.rewind);
                }
                taken?
            }
        };
        let (mut report, mut certificate) = (report, certificate);
        if report.status == StepStatus::Failed
            && !self.is_part
            && let Some(rescued) = self.rescued((report, certificate), &mut record.unsolved)
        {
            (report, certificate) = rescued;
        }
        record.index = self.index;
        record.report = report;
        record.certificate = certificate;
        record.restitution_share = share;
        record.squeeze = self.scratch.squeeze;
        let StepScratch { stiffness, solution, .. } = &mut self.scratch;
        record.stiffness =
            stiffness.of_step(&self.world, &self.now.states, &solution.joints, &solution.gears);
        let overlap =
            self.scratch.candidates.deepest_overlap(&self.world, &self.scratch.solution.states);
        record.overlap = overlap.map_or(0.0, |(depth, ..)| depth);
        record.states.clear();
        record.states.extend_from_slice(&self.now.states);
        record.solution.copy_from(&self.scratch.solution);
        self.scratch.candidates.hand_over(&mut record.contacts);

        // solution → now → before → long before; the oldest one's memory is used again.
        let last = &mut self.scratch.solution;
        swap(&mut self.now, last);
        for past in [&mut self.before, &mut self.long_before] {
            let Some(past) = past else {
                *past = Some(take(last));
                break;
            };
            swap(past, last);
        }
        self.taken_back = false;
        self.index += 1;
        self.note_rest(record);
        // One body by itself is all that can rest.
        if self.now.states.len() > 1 {
            self.note_islands(record);
        }
        Ok(())
    }

    /// Whether the last step left all as it was, to the last bit, so that the one to come ends as that one did, as long as nothing is
    /// changed from outside.
    #[must_use]
    pub fn rests(&self) -> bool {
        self.scratch.rest.is_known()
    }

    /// The wrenches of the step to come.
    fn set_wrenches(&mut self) {
        let (index, h) = (self.index, self.world.time_step());
        let now = self.outside.iter().zip(&self.now.states).map(|(outside, state)| {
            if outside.load.is_none() {
                return outside.wrench;
            }
            outside.wrench.plus(&outside.load.wrench(index, h, &state.attitude))
        });
        self.scratch.wrenches.clear();
        self.scratch.wrenches.extend(now);
    }

    /// Goes back to before the step that `record` describes, which must be the last one
    /// taken: for a run that ends there, or to repeat the step, in the same way or another. Any
    /// other record changes nothing, nor does a second call.
    pub fn take_back(&mut self, record: &StepRecord) {
        if self.taken_back || record.index + 1 != self.index {
            return;
        }
        if let Some(before) = self.before.take() {
            self.scratch.rest.end();
            self.now = before;
            self.before = self.long_before.take();
            self.taken_back = true;
            self.index = record.index;
        }
    }

    /// Describes the current state as the last row of a trajectory: no step follows. Joints have the angles
    /// to which they have turned, and no forces.
    pub fn end(&self, record: &mut StepRecord) {
        let joints = self.now.joints.iter().map(|joint| JointForce::none(joint.angles));
        let gears = vec![0.0; self.world.gears().len()];
        let solution = StepSolution {
            joints: joints.collect(),
            gears,
            ..StepSolution::free(&self.now.states)
        };
        *record = StepRecord {
            index: self.index,
            states: self.now.states.clone(),
            solution,
            ..StepRecord::new()
        };
    }
}
