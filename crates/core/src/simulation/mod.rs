//! Simulation loop: a sequence of steps, each with its report and certificate.
//!
//! A step consists of free flight, contact [detection](crate::contact::detection), the solve for
//! the forces, and the [certificate](crate::contact::certificate) that checks the solution. Related
//! modules are initial states ([`scene`], [`random`]), step records ([`record`]) and run summaries
//! ([`summary`]).

mod abrupt;
mod accuracy;
mod assembly;
mod balance;
mod bodies;
pub mod bounce;
mod driving;
pub mod energy;
#[cfg(feature = "save")]
pub mod gradient;
mod infeasible_gap;
mod islands;
mod leapfrog;
mod linearised;
mod median;
mod motion;
mod one_step;
mod parts;
pub mod random;
pub mod record;
mod redundancy;
mod rest;
#[cfg(feature = "save")]
pub mod save;
pub mod scene;
mod start;
mod step_problem;
mod stiffness;
pub mod summary;
pub mod unphysical;

pub use accuracy::SubstepsSummary;
pub use assembly::Assembly;
pub use balance::EnergyBalance;
#[cfg(feature = "save")]
pub use gradient::{Checkpoints, Run, RunGradient};
pub use infeasible_gap::InfeasibleGap;
pub use motion::Motion;
pub use record::StepRecord;
pub use redundancy::{Constraint, RedundancyFinding};
#[cfg(feature = "save")]
pub use save::Saved;
pub use start::JOINT_AT_THE_START;
pub use stiffness::Stiffness;
pub use unphysical::{EnergyGain, UnphysicalCause};

use crate::contact::certificate::Certifier;
use crate::contact::{Candidates, Certificate, Memory};
use crate::error::Error;
use crate::joint::JointForce;
use crate::mechanics::{Load, State, Wrench};
use crate::step::{StepReport, StepSolution, StepStatus};
use crate::world::{Integrator, World};
use abrupt::AbruptChanges;
use accuracy::Substeps;
use bounce::Bounce;
use leapfrog::Instants;
use one_step::{contact_step, floating_step};
#[cfg(feature = "save")]
use std::cell::OnceCell;
use std::mem::{swap, take};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Largest number of steps. Times k h are computed in one double.
const MOST_STEPS: u64 = 1 << 53;

/// A running simulation.
pub struct Simulation<'a> {
    world: World,
    motion: Motion<'a>,
    /// External wrench and load of each body.
    outside: Vec<ExternalLoads>,
    /// Time-dependent inputs of the joints.
    driving: driving::Driving,
    interrupt: Option<Arc<AtomicBool>>,
    index: u64,
    /// Solution of the last step: X at step k and the forces of that step. The next step starts
    /// from it.
    now: StepSolution,
    /// States with velocities of the instant, with [`Integrator::Leapfrog`].
    instants: Option<Instants>,
    /// Solution at k − 1 if the last step can be taken back; `long_before` is the one at k − 2,
    /// which that step used.
    before: Option<StepSolution>,
    long_before: Option<StepSolution>,
    /// Substeps of the last step, if the run [takes them](Self::takes_substeps).
    substeps: Option<Box<Substeps>>,
    /// True if the last step cannot be taken back.
    taken_back: bool,
    /// True for the substeps of a failed step, which are not divided again.
    is_part: bool,
    scratch: StepScratch,
    /// Digest of the world, computed on first use.
    #[cfg(feature = "save")]
    digest: OnceCell<u64>,
}

/// External wrench on a body, without gravity.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
struct ExternalLoads {
    wrench: Wrench,
    load: Load,
}

impl ExternalLoads {
    fn zero() -> Self {
        Self { wrench: Wrench::zero(), load: Load::none() }
    }
}

/// Earlier solutions used by a step from k to k+1.
#[derive(Clone, Copy)]
struct Past<'a> {
    /// States at k with the velocities of the instant, if the run has them.
    instants: Option<&'a [State]>,
    /// Solution that ended at k: [`Step::previous`](crate::step::Step::previous).
    now: &'a StepSolution,
    /// Solution that ended at k − 1: [`Step::earlier`](crate::step::Step::earlier).
    before: Option<&'a StepSolution>,
}

/// Scratch memory of steps.
#[derive(Default)]
struct StepScratch {
    /// Sum of external wrench and load of each body.
    wrenches: Vec<Wrench>,
    /// States at k+1 after free flight.
    free: Vec<State>,
    candidates: Candidates,
    /// Memory of the contact search before a step that can be interrupted.
    rewind: Memory,
    bounce: Bounce,
    /// Solution of the step being computed.
    solution: StepSolution,
    certifier: Certifier,
    energy_check: unphysical::EnergyCheck,
    stiffness: Stiffness,
    abrupt: AbruptChanges,
    /// True if velocities of the instant were converted for the step.
    started: bool,
    added_error: leapfrog::AddedError,
    /// Conversions of velocities before a substep.
    converted: Vec<leapfrog::Converted>,
    /// Substeps of the last step, if they are recorded for a gradient.
    #[cfg(feature = "save")]
    tape: Option<Vec<gradient::TakenSubstep>>,
    /// Infeasible gap found in a failed step.
    infeasible_gap: Option<InfeasibleGap>,
    /// Cause of an unphysical step.
    unphysical: Option<UnphysicalCause>,
    /// Largest energy that an island makes in the step.
    gain: Option<EnergyGain>,
    /// True if an island makes more than a valid step allows.
    makes_energy: bool,
    rest: rest::RestingBodies,
}

impl<'a> Simulation<'a> {
    /// Creates a simulation of `world` from `states`, one per body.
    ///
    /// # Errors
    /// - If the number of states is not the number of bodies, or [`State::checked`] rejects a
    ///   state.
    /// - If pieces overlap by more than [allowed initially](Candidates::overlap_at_start).
    /// - With [`Motion::Contact`], if a contact point is deeper below the ground than the [contact
    ///   band](crate::contact::detection::CONTACT_BAND), or if joints or gears are violated.
    ///
    /// Both depths are 5 mm for a reach of 1 m. A step lifts every point out of a penetration
    /// within one step, at a speed of 1000 m/s for three metres of depth. States of recorded runs
    /// lie within the band, so that a run can start from them.
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
                allowed: "one per body",
            });
        }
        let mut candidates = Candidates::new();
        let touches = matches!(motion, Motion::Contact { .. });
        start::check(&world, &states, &[], touches, &mut candidates, |_| true)?;
        Self::at(world, &states, motion, candidates)
    }

    /// Creates a simulation at `states`, one per body, without checks of the initial state.
    fn at(
        world: World,
        states: &[State],
        motion: Motion<'a>,
        candidates: Candidates,
    ) -> Result<Self, Error> {
        if matches!(motion, Motion::Floating) && !world.joints().is_empty() {
            return Err(Error::Unsupported {
                what: "joints of a floating body",
                why: "the Runge-Kutta method does not support joints; use the contact step",
            });
        }
        let angles = world.angles_near(states, &[]).into_iter();
        let joints = angles.map(JointForce::none).collect();
        let gears = vec![0.0; world.gears().len()];
        let now = StepSolution { joints, gears, ..StepSolution::free(states) };
        let is_leapfrog =
            world.integrator() == Integrator::Leapfrog && matches!(motion, Motion::Contact { .. });
        Ok(Self {
            instants: is_leapfrog.then(|| Instants::at(states)),
            outside: vec![ExternalLoads::zero(); world.bodies().len()],
            world,
            motion,
            driving: driving::Driving::default(),
            interrupt: None,
            index: 0,
            now,
            before: None,
            long_before: None,
            substeps: None,
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

    /// States X at the current step, one per body, with the velocities of the instant.
    #[must_use]
    pub fn states(&self) -> &[State] {
        self.instants.as_ref().map_or(&self.now.states, |instants| &instants.states)
    }

    /// States from which the next step starts. With [`Integrator::Leapfrog`] their velocities are
    /// those of the middle of the last step, except in bodies that [start](Simulation::set_state).
    #[must_use]
    pub fn step_states(&self) -> &[State] {
        &self.now.states
    }

    /// Estimated errors of the bodies' positions by the time step since the start (m), with
    /// rotations at their reach (eq. 40). Empty unless the integrator is [`Integrator::Leapfrog`].
    #[must_use]
    pub fn time_errors(&self) -> &[f64] {
        self.instants.as_ref().map_or(&[], |instants| &instants.errors)
    }

    /// Leaves out the velocities of the instant: all states have those of the middle of the last
    /// step, and nothing is converted. Friction then opposes the slip of the step. A step is a
    /// function of its states, as derivatives need it. Without effect if the integrator is not
    /// [`Integrator::Leapfrog`].
    pub fn use_middle_velocities(&mut self) {
        self.instants = None;
    }

    /// State X of the first body at the current step.
    #[must_use]
    pub fn state(&self) -> &State {
        &self.states()[0]
    }

    /// Index k of the current step.
    #[must_use]
    pub fn index(&self) -> u64 {
        self.index
    }

    /// Sets the index of the current step, and with it the time index · h. Loads follow this time.
    /// The last step cannot be taken back afterwards.
    ///
    /// # Errors
    /// [`Error::Count`] from 2⁵³ on, where times k h are not distinct.
    pub fn set_index(&mut self, index: u64) -> Result<(), Error> {
        if index >= MOST_STEPS {
            let count = usize::try_from(index).unwrap_or(usize::MAX);
            return Err(Error::Count { field: "index of the step", count, allowed: "below 2^53" });
        }
        self.index = index;
        self.taken_back = true;
        Ok(())
    }

    /// Sets the current state of body `index`. The forces of the last step remain the initial point
    /// of the next one where their contacts persist. The last step cannot be taken back afterwards.
    ///
    /// # Errors
    /// If the body does not exist, or if [`Simulation::new`] would reject its state. The present
    /// state then stays.
    pub fn set_state(&mut self, index: usize, state: State) -> Result<(), Error> {
        self.outside_mut(index)?;
        let state = state.checked()?;
        self.exchange_states(&[(index, state)])
    }

    /// Sets the current states of all bodies; see [`Simulation::set_state`]. Bodies connected by a
    /// joint can only be moved together.
    ///
    /// # Errors
    /// If the number of states is not the number of bodies; otherwise same as
    /// [`Simulation::set_state`].
    pub fn set_states(&mut self, states: &[State]) -> Result<(), Error> {
        let count = states.len();
        if count != self.now.states.len() {
            return Err(Error::Count { field: "states", count, allowed: "one per body" });
        }
        let checked = states.iter().enumerate().map(|(body, state)| Ok((body, state.checked()?)));
        let checked = checked.collect::<Result<Vec<_>, Error>>()?;
        self.exchange_states(&checked)
    }

    /// Sets these states if all moved bodies pass the checks of an initial state.
    fn exchange_states(&mut self, states: &[(usize, State)]) -> Result<(), Error> {
        let Self { world, motion, now, instants, scratch, .. } = self;
        let before = now.states.clone();
        // A body that keeps its state keeps the velocity of the middle too.
        let is_kept = |body: usize, state: &State| {
            instants.as_ref().is_some_and(|instants| instants.states[body] == *state)
        };
        let states: Vec<_> = states.iter().filter(|(body, state)| !is_kept(*body, state)).collect();
        for (body, state) in &states {
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
        if let Some(instants) = instants {
            states.into_iter().for_each(|(body, state)| instants.start(*body, *state));
        }
        self.taken_back = true;
        Ok(())
    }

    /// Exchanges the stepping method with `motion`, which must be made for this simulation's world.
    /// It allows repeating a step with another solver after [`Simulation::take_back`].
    pub fn swap_motion(&mut self, motion: &mut Motion<'a>) {
        self.scratch.rest.end();
        swap(&mut self.motion, motion);
    }

    /// Sets the external wrench on body `index` for the next steps: force (N, world frame) and
    /// torque (N m, body frame). It adds to gravity and the load. Controllers call it every step.
    ///
    /// # Errors
    /// If the body does not exist or [`Wrench::validate`] rejects the wrench. The present wrench
    /// then stays.
    pub fn set_wrench(&mut self, index: usize, wrench: Wrench) -> Result<(), Error> {
        wrench.validate()?;
        self.outside_mut(index)?.wrench = wrench;
        Ok(())
    }

    /// Sets the external load on body `index` as a function of the time since step 0.
    ///
    /// # Errors
    /// [`Error::Count`] if the body does not exist.
    pub fn set_load(&mut self, index: usize, load: Load) -> Result<(), Error> {
        self.outside_mut(index)?.load = load;
        Ok(())
    }

    fn outside_mut(&mut self, index: usize) -> Result<&mut ExternalLoads, Error> {
        let missing = Error::Count { field: "body", count: index, allowed: "an index of a body" };
        self.outside.get_mut(index).ok_or(missing)
    }

    /// Sets the flag that interrupts the simulation. Once it is raised, the current step ends soon
    /// with [`Error::Interrupted`], and no further step is taken.
    pub fn interrupt_by(&mut self, flag: Arc<AtomicBool>) {
        self.interrupt = Some(flag);
    }

    /// Advances by one step and describes it in `record`. A step that did not converge is taken
    /// too, with its status in the report.
    ///
    /// The order is: loads, a copy of the last step if everything rests, motions of joint frames,
    /// the step itself, shorter steps if it failed or makes energy, the record, and the new solution.
    ///
    /// # Errors
    /// If a step cannot be posed or was interrupted; the simulation is then unchanged.
    pub fn step(&mut self, record: &mut StepRecord) -> Result<(), Error> {
        if self.takes_substeps() { self.step_in_substeps(record) } else { self.single_step(record) }
    }

    /// Advances by one step, or by the substep that is set in the world.
    fn single_step(&mut self, record: &mut StepRecord) -> Result<(), Error> {
        if self.interrupt.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            return Err(Error::Interrupted);
        }
        self.set_wrenches();
        record.wrenches.clone_from(&self.scratch.wrenches);
        record.unsolved.clear();
        (self.scratch.infeasible_gap, self.scratch.unphysical) = (None, None);
        (self.scratch.gain, self.scratch.makes_energy) = (None, false);
        if self.scratch.rest.is_known() && self.rest(record) {
            return Ok(());
        }
        let interval = self.world.load_interval(self.index);
        let end = self.world.time_after(self.index);
        self.driving.set(&mut self.world, &self.now.states, interval, end);
        self.start_leapfrog(None)?;
        let (mut report, mut certificate, share) = self.attempt()?;
        if (report.status == StepStatus::Failed || self.scratch.makes_energy)
            && !self.is_part
            && !self.takes_substeps()
            && let Some(rescued) = self.rescued((report, certificate), &mut record.unsolved)
        {
            (report, certificate) = rescued;
        }
        record.substeps = SubstepsSummary::default();
        record.index = self.index;
        record.report = report;
        record.certificate = certificate;
        record.restitution_share = share;
        record.infeasible_gap = self.scratch.infeasible_gap;
        record.unphysical = self.scratch.unphysical;
        record.gain = self.scratch.gain;
        let StepScratch { stiffness, solution, .. } = &mut self.scratch;
        record.stiffness = stiffness.largest_in_step(
            &self.world,
            &self.now.states,
            &solution.joints,
            &solution.gears,
        );
        let overlap =
            self.scratch.candidates.deepest_overlap(&self.world, &self.scratch.solution.states);
        record.overlap = overlap.map_or(0.0, |(depth, ..)| depth);
        let StepScratch { candidates, solution, .. } = &mut self.scratch;
        let (states, next) = (&self.now.states, &solution.states);
        record.placement = candidates.placement_error(&self.world, states, next, solution.forces());
        record.states.clear();
        record.states.extend_from_slice(&self.now.states);
        record.solution.copy_from(&self.scratch.solution);
        record.instants.clear();
        if let Some(instants) = &self.instants {
            record.instants.extend_from_slice(&instants.states);
            self.end_leapfrog(report.status);
        }
        record.extrapolated.clear();
        if let Some(instants) = &self.instants {
            record.extrapolated.extend(instants.was_abrupt.iter().map(|was_abrupt| !was_abrupt));
        }
        self.scratch.candidates.hand_over(&mut record.contacts);

        // Rotates solution → now → before → long before, and reuses the memory of the oldest.
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
        // A single body is covered by `note_rest`.
        if self.now.states.len() > 1 {
            self.note_islands(record);
        }
        Ok(())
    }

    /// The step itself: free flight, or detection, solver and certificate. The solution is left in
    /// the scratch memory.
    fn attempt(&mut self) -> Result<(StepReport, Certificate, f64), Error> {
        let Self { world, motion, interrupt, now, before, instants, scratch, .. } = &mut *self;
        let Motion::Contact { detection, solver } = motion else {
            let (report, certificate) = floating_step(world, &now.states, scratch);
            return Ok((report, certificate, 1.0));
        };
        let instants = instants.as_ref().map(|instants| &instants.states[..]);
        let past = Past { instants, now, before: before.as_ref() };
        let (interrupt, solver) = (interrupt.as_deref(), solver.as_mut());
        let StepScratch { rest, candidates, wrenches, .. } = &mut *scratch;
        rest.begin(now, before.as_ref(), candidates.memory(), solver, wrenches);
        // Without pairs of pieces there is nothing to restore.
        let rewinds = interrupt.is_some() && !candidates.memory().is_empty();
        if rewinds {
            scratch.rewind.copy_from(scratch.candidates.memory());
        }
        let taken = contact_step(world, past, *detection, solver, interrupt, scratch);
        if taken.is_err() {
            scratch.rest.end();
        }
        if taken.is_err() && rewinds {
            // Restores the search memory of the incomplete step.
            scratch.candidates.recall(world, &scratch.rewind);
        }
        taken
    }

    /// True if the last step left everything unchanged to the last bit. The next step then ends the
    /// same, unless an input changes.
    #[must_use]
    pub fn rests(&self) -> bool {
        self.scratch.rest.is_known()
    }

    /// Sets the wrenches of the next step.
    fn set_wrenches(&mut self) {
        let [from, to] = self.world.load_interval(self.index);
        let now = self.outside.iter().zip(&self.now.states).map(|(outside, state)| {
            if outside.load.is_none() {
                return outside.wrench;
            }
            outside.wrench.plus(&outside.load.mean(from, to, &state.attitude))
        });
        self.scratch.wrenches.clear();
        self.scratch.wrenches.extend(now);
    }

    /// Returns to the state before the step described by `record`, which must be the last one
    /// taken. It allows ending a run there, or repeating the step. Other records and a second call
    /// have no effect.
    pub fn take_back(&mut self, record: &StepRecord) {
        if self.taken_back || record.index + 1 != self.index {
            return;
        }
        if record.substeps.count > 0 {
            self.take_substeps_back();
            (self.taken_back, self.index) = (true, record.index);
            return;
        }
        if let Some(before) = self.before.take() {
            self.scratch.rest.end();
            self.now = before;
            if let Some(instants) = &mut self.instants {
                instants.take_back(&record.instants);
            }
            self.before = self.long_before.take();
            self.taken_back = true;
            self.index = record.index;
        }
    }

    /// Describes the current state as the last row of a trajectory, without a following step.
    /// Joints have their counted angles and no forces.
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
            instants: self.instants.as_ref().map_or(Vec::new(), |of| of.states.clone()),
            substeps: self
                .substeps
                .as_ref()
                .map_or(SubstepsSummary::default(), |substeps| substeps.at_the_end()),
            solution,
            ..StepRecord::new()
        };
    }
}
