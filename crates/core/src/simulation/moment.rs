//! Time of a run from which it can continue.

use super::driving::AxisDrive;
use super::inputs::Inputs;
use super::instants::Instants;
use super::interval::Interval;
use super::islands::Islands;
use crate::contact::Memory;
use crate::joint::JointForce;
use crate::mechanics::{State, Wrench};
use crate::step::{StepSolution, StepStatus};
use crate::world::{Integrator, World};
use std::mem::{swap, take};

/// Lengths of intervals.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Pace {
    /// Length of the last interval, to whose middle the velocities of the simulation belong (s); 0 before the
    /// first.
    pub length: f64,
    /// Length wanted for the next interval of smooth motion (s); 0 if none is known.
    pub wanted: f64,
    /// Length of the last usual interval (s); 0 without any.
    pub usual: f64,
}

/// Number of failed steps in a row after which an island gets less effort.
const PATIENCE: u32 = 3;

/// Arrival of a body at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Arrival {
    /// Length of the interval to whose middle its velocity belongs (s); 0 for a body that starts.
    pub length: f64,
    /// External wrench in it.
    pub wrench: Wrench,
}

impl Arrival {
    /// Arrival after an interval of this `length` (s) without loads.
    pub fn after(length: f64) -> Self {
        Self { length, wrench: Wrench::zero() }
    }
}

/// A time of a run, from which it can continue. Two runs of one world that continue from equal
/// moments with equal inputs are equal to the last bit. Solutions and the search are boxed, because each
/// interval exchanges them.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Moment {
    /// Index k of the next step.
    pub index: u64,
    /// Solution that ended here: the states from which the next interval starts, and the forces
    /// before. [`Step::previous`](crate::step::Step::previous) of the next problem.
    pub now: Box<StepSolution>,
    /// Solutions that ended one and two intervals before; `None` after a start or a step that was not solved
    /// at once.
    pub before: Option<Box<StepSolution>>,
    pub long_before: Option<Box<StepSolution>>,
    /// Arrival of each body, and that at the moment before.
    pub arrivals: Vec<Arrival>,
    pub arrivals_before: Vec<Arrival>,
    /// Drives of the interval before at axes whose drives changed, and those of the moment before.
    pub drives: Vec<AxisDrive>,
    pub drives_before: Vec<AxisDrive>,
    /// States with velocities of the instant, with [`Integrator::Leapfrog`](crate::world::Integrator::Leapfrog).
    pub instants: Option<Instants>,
    /// Lengths of intervals, with an accuracy or located impacts.
    pub pace: Pace,
    /// True if the interval before had no solution, by its [certificate](super::infeasible_gap).
    pub is_infeasible: bool,
    /// Number of failed steps in a row in which the island of each body was not solved. Empty after another step.
    pub failures: Vec<u32>,
    /// State of the contact search.
    pub search: Box<Memory>,
}

impl Moment {
    /// Start of a run of `world` at `states`. Only contact steps have velocities of the instant.
    pub fn at(world: &World, states: &[State], has_contacts: bool) -> Self {
        let angles = world.angles_near(states, &[]).into_iter();
        let joints = angles.map(JointForce::none).collect();
        let gears = vec![0.0; world.gears().len()];
        let is_leapfrog = has_contacts && world.integrator() == Integrator::Leapfrog;
        let length = if is_leapfrog { 0.0 } else { world.time_step() };
        Self {
            arrivals: vec![Arrival::after(length); states.len()],
            arrivals_before: vec![Arrival::after(length); states.len()],
            now: Box::new(StepSolution { joints, gears, ..StepSolution::free(states) }),
            instants: is_leapfrog.then(|| Instants::at(states)),
            ..Self::default()
        }
    }

    /// States X, one per body, with the velocities of the instant.
    pub fn states(&self) -> &[State] {
        self.instants.as_ref().map_or(&self.now.states, |instants| &instants.states)
    }

    /// Counts a step with this `status`, in which the islands of the bodies in `unsolved` were not solved.
    pub fn count_failure(&mut self, status: StepStatus, unsolved: &[usize]) {
        if status != StepStatus::Failed {
            self.failures.clear();
            return;
        }
        self.failures.resize(self.arrivals.len(), 0);
        for (body, count) in self.failures.iter_mut().enumerate() {
            *count = if unsolved.contains(&body) { count.saturating_add(1) } else { 0 };
        }
    }

    /// True if the island of `body` failed in so many steps that it gets less effort.
    pub fn keeps_failing(&self, body: usize) -> bool {
        self.failures.get(body).is_some_and(|count| *count >= PATIENCE)
    }

    /// Notes the drive of an axis before it changes, with velocities of the instant.
    pub fn note_drive(&mut self, before: AxisDrive) {
        let is_same = |of: &AxisDrive| of.axis == before.axis;
        if self.instants.is_some() && !self.drives.iter().any(is_same) {
            self.drives.push(before);
        }
    }

    /// True if bodies start.
    pub fn has_starts(&self) -> bool {
        self.arrivals.iter().any(|arrival| arrival.length == 0.0)
    }

    /// Starts the bodies at these `states`, and the bodies of their islands at the velocities of the instant.
    /// Velocities of one time conserve momentum.
    pub fn start(&mut self, world: &World, states: &[(usize, State)]) {
        let Self { now, instants: Some(instants), arrivals, .. } = self else { return };
        let bodies = arrivals.len();
        let mut islands = Islands::default();
        let carrying = now.contacts.iter().filter(|force| force.carries_force());
        islands.find(bodies, carrying.map(|force| &force.key), world);
        let mut starts = vec![false; bodies];
        for (body, state) in states {
            starts[islands.label(*body)] = true;
            instants.start(*body, *state);
        }
        for body in (0..bodies).filter(|body| starts[islands.label(*body)]) {
            let state = instants.restart(body);
            instants.start(body, state);
            now.states[body] = state;
            arrivals[body].length = 0.0;
        }
    }

    /// Starts bodies with a flag at the velocities of the instant.
    pub fn start_where(&mut self, starts: &[bool]) {
        let Some(instants) = &self.instants else { return };
        for (body, _) in starts.iter().enumerate().filter(|(_, starts)| **starts) {
            self.now.states[body] = instants.restart(body);
            self.arrivals[body].length = 0.0;
        }
    }

    /// Sets the arrival of each body after an interval of this `length` (s) with these inputs.
    pub fn arrive(&mut self, length: f64, inputs: &Inputs) {
        swap(&mut self.arrivals, &mut self.arrivals_before);
        swap(&mut self.drives, &mut self.drives_before);
        self.drives.clear();
        self.arrivals.clear();
        let all = inputs.outside.iter().map(|outside| Arrival { length, wrench: outside.wrench });
        self.arrivals.extend(all);
    }

    /// Moves on to the end of an interval with this solution. `solution` receives the oldest one,
    /// whose memory can be used again.
    pub fn move_on(&mut self, solution: &mut Box<StepSolution>) {
        swap(&mut self.now, solution);
        let Some(before) = &mut self.before else {
            self.before = Some(take(solution));
            return;
        };
        swap(before, solution);
        match &mut self.long_before {
            Some(long_before) => swap(long_before, solution),
            none => *none = Some(take(solution)),
        }
    }

    /// Returns to the start of `taken`, the last interval. The contact search stays. Without the
    /// solution before, nothing changes, and the result is false.
    pub fn move_back(&mut self, taken: &Interval) -> bool {
        let Some(before) = self.before.take() else { return false };
        self.now = before;
        self.before = self.long_before.take();
        self.depart();
        if let Some(instants) = &mut self.instants {
            instants.take_back(&taken.instants);
        }
        true
    }

    /// Takes back [`Moment::arrive`]: returns to the start of a step at rest, which left all else as it was.
    pub fn depart(&mut self) {
        swap(&mut self.arrivals, &mut self.arrivals_before);
        swap(&mut self.drives, &mut self.drives_before);
    }

    /// All solutions that the next interval uses.
    pub fn solutions_mut(&mut self) -> impl Iterator<Item = &mut Box<StepSolution>> {
        let before = self.before.iter_mut().chain(&mut self.long_before);
        std::iter::once(&mut self.now).chain(before)
    }

    /// Forgets the solutions before, after an interval of another length.
    pub fn forget_past(&mut self) {
        (self.before, self.long_before) = (None, None);
    }
}
