//! Simulation loop: a sequence of steps, each with its report and certificate.
//!
//! A step is a list of intervals, mostly one. An interval consists of free flight, contact
//! [detection](crate::contact::detection), the solve for the forces, and the
//! [certificate](crate::contact::certificate) that checks the solution. It leads from one moment of
//! the run to the next. Related modules are initial states ([`scene`], [`random`]), step records
//! ([`record`]) and run summaries ([`summary`]).

mod abrupt;
mod accuracy;
mod assembly;
mod balance;
mod bodies;
pub mod bounce;
mod break_away;
mod driving;
pub mod energy;
#[cfg(feature = "save")]
pub mod gradient;
mod infeasible_gap;
mod inputs;
mod instants;
pub mod interval;
mod islands;
mod leapfrog;
mod linearised;
mod median;
mod moment;
mod motion;
mod one_interval;
mod parting;
pub mod random;
pub mod record;
mod redundancy;
mod replacement;
mod rest;
mod retry;
#[cfg(feature = "save")]
pub mod save;
pub mod scene;
mod start;
mod step_problem;
mod stiffness;
mod still_speeds;
pub mod summary;
mod turning;
pub mod unphysical;
mod workspace;

pub use assembly::Assembly;
pub use balance::EnergyBalance;
pub use driving::{AxisDrive, DrivenAxis};
#[cfg(feature = "save")]
pub use gradient::{Checkpoints, Run, RunGradient};
pub use infeasible_gap::InfeasibleGap;
pub use interval::{Interval, acting_times, kick};
pub use motion::Motion;
pub use parting::Parting;
pub use record::StepRecord;
pub use redundancy::{Constraint, RedundancyFinding};
#[cfg(feature = "save")]
pub use save::Saved;
pub use start::JOINT_AT_THE_START;
pub use stiffness::Stiffness;
pub use unphysical::{EnergyGain, UnphysicalCause};

use crate::error::Error;
use crate::joint::JointForce;
use crate::mechanics::{Load, State, Wrench};
use crate::step::StepSolution;
use crate::world::World;
use inputs::Inputs;
use moment::Moment;
use nalgebra::Vector3;
use std::borrow::Cow;
#[cfg(feature = "save")]
use std::cell::OnceCell;
use std::mem::swap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use workspace::Workspace;

/// Largest number of steps. Times k h are computed in one double.
const MOST_STEPS: u64 = 1 << 53;

/// A running simulation.
pub struct Simulation<'a> {
    /// Joint frames with prescribed motions are at the present moment.
    world: World,
    inputs: Inputs,
    /// All else that the next step depends on.
    moment: Moment,
    undo: Undo,
    /// Displacement by which overlaps of the last states that were set were removed.
    parting: Option<Parting>,
    workspace: Workspace<'a>,
    /// Digest of the world, computed on first use.
    #[cfg(feature = "save")]
    digest: OnceCell<u64>,
}

/// Way to take the last step back.
enum Undo {
    Impossible,
    /// A step of one interval returns by its record.
    Interval,
    /// Return to a copy of the moment before.
    Moment(Box<Moment>),
}

impl<'a> Simulation<'a> {
    /// Creates a simulation of `world` from `states`, one per body.
    ///
    /// # Errors
    /// - If the number of states is not the number of bodies, or [`State::checked`] rejects a
    ///   state.
    /// - If pieces overlap by more than [allowed initially](crate::contact::Candidates::overlap_at_start).
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
        let mut simulation = Self::at(world, &states, motion)?;
        simulation.check_start(&states, &[], |_| true)?;
        simulation.part();
        Ok(simulation)
    }

    /// Creates a simulation at `states`, one per body, without checks of the initial state.
    fn at(world: World, states: &[State], motion: Motion<'a>) -> Result<Self, Error> {
        if matches!(motion, Motion::Floating) && !world.joints().is_empty() {
            return Err(Error::Unsupported {
                what: "joints of a floating body",
                why: "the Runge-Kutta method does not support joints; use the contact step",
            });
        }
        let workspace = Workspace::new(motion);
        Ok(Self {
            inputs: Inputs::none(world.bodies().len()),
            moment: Moment::at(&world, states, workspace.has_contacts()),
            world,
            undo: Undo::Impossible,
            parting: None,
            workspace,
            #[cfg(feature = "save")]
            digest: OnceCell::new(),
        })
    }

    /// Checks `states` of all bodies as initial ones, for the bodies selected by `asked`. `near` has the
    /// last joint angles (rad). After an error, the contact search is as before.
    fn check_start(
        &mut self,
        states: &[State],
        near: &[Vector3<f64>],
        asked: impl Fn(usize) -> bool,
    ) -> Result<(), Error> {
        let Self { world, moment, workspace, .. } = self;
        workspace.rest.end();
        workspace.rewind.copy_from(&moment.search);
        let touches = workspace.has_contacts();
        let checked = workspace.search(world, &mut moment.search, |candidates| {
            start::check(world, states, near, touches, candidates, asked)
        });
        if checked.is_err() {
            moment.search.copy_from(&workspace.rewind);
            workspace.forget();
        }
        checked
    }

    /// Removes overlaps at the present states by a displacement.
    fn part(&mut self) {
        let Self { world, moment, workspace, .. } = self;
        self.parting = parting::part(world, moment, workspace);
    }

    /// Largest displacement by which overlaps of the initial states, or of those that were set last, were
    /// removed. It gives no velocity.
    pub fn parting(&self) -> Option<Parting> {
        self.parting
    }

    /// The world.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// States X at the current step, one per body, with the velocities of the instant.
    pub fn states(&self) -> &[State] {
        self.moment.states()
    }

    /// States from which the next step starts. With [`Integrator::Leapfrog`](crate::world::Integrator::Leapfrog) their velocities are
    /// those of the middle of the last step, except in bodies that [start](Simulation::set_state).
    pub fn step_states(&self) -> &[State] {
        &self.moment.now.states
    }

    /// Energy at the present moment as the rows of a run count it (J): (35), or with located impacts the
    /// [energy of the instant](energy::at_instant).
    pub fn energy(&self) -> f64 {
        if accuracy::divides_steps(&self.world, &self.moment) {
            return energy::at_instant(&self.world, self.states());
        }
        let mut world = Cow::Borrowed(&self.world);
        let lengths = self.moment.arrivals.iter().map(|arrival| arrival.length);
        if lengths.clone().any(|length| length != world.time_step()) {
            world.to_mut().set_before(lengths);
        }
        energy::at_start(&world, self.step_states())
    }

    /// Estimated errors of the bodies' positions by the time step since the start (m), with
    /// rotations at their reach (eq. 40). Empty unless the integrator is [`Integrator::Leapfrog`](crate::world::Integrator::Leapfrog).
    pub fn time_errors(&self) -> &[f64] {
        self.moment.instants.as_ref().map_or(&[], |instants| &instants.errors)
    }

    /// Leaves out the velocities of the instant: all states have those of the middle of the last
    /// step, and nothing is converted. Friction then opposes the slip of the step. A step is a
    /// function of its states, as derivatives need it. Without effect if the integrator is not
    /// [`Integrator::Leapfrog`](crate::world::Integrator::Leapfrog).
    pub fn use_middle_velocities(&mut self) {
        let length = self.world.time_step();
        self.moment.arrivals.iter_mut().for_each(|arrival| arrival.length = length);
        self.moment.instants = None;
    }

    /// State X of the first body at the current step.
    pub fn state(&self) -> &State {
        &self.states()[0]
    }

    /// Index k of the current step.
    pub fn index(&self) -> u64 {
        self.moment.index
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
        self.moment.index = index;
        self.undo = Undo::Impossible;
        Ok(())
    }

    /// Sets the current state of body `index`. The forces of the last step remain the initial point
    /// of the next one where their contacts persist. The last step cannot be taken back afterwards.
    ///
    /// # Errors
    /// If the body does not exist, or if [`Simulation::new`] would reject its state. The present
    /// state then stays.
    pub fn set_state(&mut self, index: usize, state: State) -> Result<(), Error> {
        self.inputs.body_mut(index)?;
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
        if count != self.moment.now.states.len() {
            return Err(Error::Count { field: "states", count, allowed: "one per body" });
        }
        let checked = states.iter().enumerate().map(|(body, state)| Ok((body, state.checked()?)));
        let checked = checked.collect::<Result<Vec<_>, Error>>()?;
        self.exchange_states(&checked)
    }

    /// Sets these states if all moved bodies pass the checks of an initial state.
    fn exchange_states(&mut self, states: &[(usize, State)]) -> Result<(), Error> {
        let mut wanted = self.moment.now.states.clone();
        // A body that keeps its state keeps the velocity of the middle too.
        let is_kept = |(body, state): &&(usize, State)| {
            let instants = self.moment.instants.as_ref();
            instants.is_some_and(|instants| instants.states[*body] == *state)
        };
        let states: Vec<_> = states.iter().filter(|set| !is_kept(set)).copied().collect();
        for (body, state) in &states {
            wanted[*body] = *state;
        }
        let now = &self.moment.now;
        let near: Vec<_> = now.joints.iter().map(|joint| joint.angles).collect();
        let pairs = now.states.iter().zip(&wanted);
        let is_moved: Vec<_> = pairs.map(|(before, now)| before.pose() != now.pose()).collect();
        self.check_start(&wanted, &near, |body| is_moved[body])?;
        let Self { world, moment, .. } = self;
        let angles = world.angles_near(&wanted, &near);
        moment.now.states = wanted;
        let joints = moment.now.joints.iter_mut().zip(angles);
        joints.for_each(|(joint, angles)| joint.angles = angles);
        moment.start(world, &states);
        self.undo = Undo::Impossible;
        if is_moved.contains(&true) {
            self.part();
        }
        Ok(())
    }

    /// Exchanges the stepping method with `motion`, which must be made for this simulation's world.
    /// It allows repeating a step with another solver after [`Simulation::take_back`].
    pub fn swap_motion(&mut self, motion: &mut Motion<'a>) {
        self.workspace.rest.end();
        swap(&mut self.workspace.motion, motion);
    }

    /// Sets the external wrench on body `index` for the next steps: force (N, world frame) and
    /// torque (N m, body frame). It adds to gravity and the load. Controllers call it every step. It is held
    /// during each step, unless wrenches belong [to the instant](Simulation::set_at_instant).
    ///
    /// # Errors
    /// If the body does not exist or [`Wrench::validate`] rejects the wrench. The present wrench
    /// then stays.
    pub fn set_wrench(&mut self, index: usize, wrench: Wrench) -> Result<(), Error> {
        wrench.validate()?;
        self.inputs.body_mut(index)?.wrench = wrench;
        Ok(())
    }

    /// Sets whether wrenches belong to the instant at which a step starts, as forces that a program computes
    /// from the present state: they act in the halves of both steps beside it, as in Verlet's method.
    /// Otherwise they are held during each step. Without effect with
    /// [`Integrator::Euler`](crate::world::Integrator::Euler).
    pub fn set_at_instant(&mut self, at_instant: bool) {
        self.inputs.at_instant = at_instant;
    }

    /// Sets the external load on body `index` as a function of the time since step 0.
    ///
    /// # Errors
    /// [`Error::Count`] if the body does not exist.
    pub fn set_load(&mut self, index: usize, load: Load) -> Result<(), Error> {
        self.inputs.body_mut(index)?.load = load;
        Ok(())
    }

    /// Sets the flag that interrupts the simulation. Once it is raised, the current step ends soon
    /// with [`Error::Interrupted`], and no further step is taken.
    pub fn interrupt_by(&mut self, flag: Arc<AtomicBool>) {
        self.inputs.interrupt = Some(flag);
    }

    /// Advances by one step and describes it in `record`. A step that did not converge is taken
    /// too, with its status in the report.
    ///
    /// A step is one interval, or several: shorter ones if one does not
    /// converge or makes energy, two where friction turns a motion, and those of an accuracy or of located
    /// impacts.
    ///
    /// # Errors
    /// If a step cannot be posed or was interrupted; the simulation is then unchanged, and the record
    /// is empty.
    pub fn step(&mut self, record: &mut StepRecord) -> Result<(), Error> {
        let Self { world, moment, inputs, workspace, undo, .. } = self;
        record.begin(moment.index);
        let before = accuracy::divides_steps(world, moment).then(|| Box::new(moment.clone()));
        let taken = match before {
            Some(before) => {
                accuracy::step(world, moment, inputs, workspace, record).map(|()| Some(before))
            }
            None => retry::step(world, moment, inputs, workspace, record),
        };
        world.set_span(None);
        let before = taken.inspect_err(|_| *record = StepRecord::new())?;
        moment.index += 1;
        moment.count_failure(record.status(), &record.unsolved);
        *undo = before.map_or(Undo::Interval, Undo::Moment);
        Ok(())
    }

    /// True if the last step left everything unchanged to the last bit. The next step then ends the
    /// same, unless an input changes.
    pub fn rests(&self) -> bool {
        self.workspace.rest.is_known()
    }

    /// Returns to the state before the step described by `record`, which must be the last one
    /// taken. It allows ending a run there, or repeating the step. Other records and a second call
    /// have no effect.
    pub fn take_back(&mut self, record: &StepRecord) {
        if record.index + 1 != self.moment.index {
            return;
        }
        match std::mem::replace(&mut self.undo, Undo::Impossible) {
            Undo::Impossible => {}
            Undo::Moment(before) => {
                self.moment = *before;
                self.workspace.forget();
            }
            Undo::Interval => {
                if self.workspace.rest.stays() {
                    self.moment.depart();
                } else if !self.moment.move_back(record.first()) {
                    return;
                }
                self.workspace.rest.end();
                self.moment.index = record.index;
            }
        }
    }

    /// Describes the current state as the last row of a trajectory, without a following step.
    /// Joints have their counted angles and no forces.
    pub fn end(&self, record: &mut StepRecord) {
        let Moment { now, arrivals, instants, index, .. } = &self.moment;
        let joints = now.joints.iter().map(|joint| JointForce::none(joint.angles));
        let solution = StepSolution {
            joints: joints.collect(),
            gears: vec![0.0; self.world.gears().len()],
            ..StepSolution::free(&now.states)
        };
        record.begin(*index);
        *record.next_interval() = Interval {
            states: now.states.clone(),
            before: arrivals.iter().map(|arrival| arrival.length).collect(),
            instants: instants.as_ref().map_or(Vec::new(), |instants| instants.states.clone()),
            solution,
            part: accuracy::divides_steps(&self.world, &self.moment).then(|| {
                Box::new(interval::PartOfStep::at_the_end(&self.world, self.moment.states()))
            }),
            ..Interval::default()
        };
    }
}
