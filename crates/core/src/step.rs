//! One step as a problem and its solution, and what a solver of it is.
//!
//! A [`Step`] says what is given: the world, the states at k, the free flight, the previous
//! solution. A [`StepSolver`] finds the new states and a force for every contact, a
//! [`StepSolution`]. Which solvers there are is the business of [`crate::solver`]; model,
//! certificate, loop and writers know this trait alone.

use crate::contact::{Candidates, Contact, ContactKey, Partner};
use crate::error::Error;
use crate::joint::JointForce;
use crate::mechanics::{RigidBody, State, Wrench};
use crate::world::{World, without};
use nalgebra::Vector3;
use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};

/// One contact step to be solved; lists go over the bodies of the world.
#[derive(Debug, Clone, Copy)]
pub struct Step<'a> {
    /// The constants.
    pub world: &'a World,
    /// X at step k.
    pub states: &'a [State],
    /// External wrenches during the step, without gravity.
    pub wrenches: &'a [Wrench],
    /// X at step k+1 if nothing touched anything.
    pub free: &'a [State],
    /// The solution of the previous step, where solvers start.
    pub previous: &'a StepSolution,
    /// The solution of the step before that, where it is known: what it shares with the
    /// previous one has settled.
    pub earlier: Option<&'a StepSolution>,
    /// Ends the step with [`Error::Interrupted`] when it is raised.
    pub interrupt: Option<&'a AtomicBool>,
}

impl Step<'_> {
    /// Whether the step is to be given up; solvers ask between iterations.
    ///
    /// # Errors
    /// [`Error::Interrupted`] if it is.
    pub fn check_interrupt(&self) -> Result<(), Error> {
        match self.interrupt {
            Some(flag) if flag.load(Ordering::Relaxed) => Err(Error::Interrupted),
            _ => Ok(()),
        }
    }

    /// Whether the step is one of its world, with the candidates `contacts`: solvers ask before
    /// they look anything up.
    ///
    /// # Errors
    /// Lists that do not go over the bodies of the world; a contact of a body, a contact point or a fixed piece
    /// that is not there. The previous solutions may be of anything.
    pub fn check(&self, contacts: &[Contact]) -> Result<(), Error> {
        let bodies = self.world.bodies();
        let each = [
            ("states of the step", self.states.len()),
            ("wrenches of the step", self.wrenches.len()),
            ("states of the step's free flight", self.free.len()),
        ];
        for (field, count) in each {
            if count != bodies.len() {
                return Err(Error::Count { field, count, allowed: "one a body" });
            }
        }
        let is_known = |key: &ContactKey| {
            let point = |body: &RigidBody| key.point < body.contact_points().len();
            let partner = match key.partner {
                Partner::Ground => true,
                Partner::Body(other) => other < bodies.len(),
                Partner::Fixed(index) => index < self.world.fixed().len(),
            };
            partner && bodies.get(key.body).is_some_and(point)
        };
        match contacts.iter().find(|contact| !is_known(&contact.key)) {
            Some(contact) => Err(self.unknown(&contact.key)),
            None => Ok(()),
        }
    }

    /// What is wrong with a contact that is not one of the world.
    #[cold]
    fn unknown(&self, key: &ContactKey) -> Error {
        let bodies = self.world.bodies().len();
        if let Some(count) = key.bodies().find(|body| *body >= bodies) {
            return Error::Count {
                field: "body of a contact",
                count,
                allowed: "an index of a body",
            };
        }
        if let Partner::Fixed(count) = key.partner
            && count >= self.world.fixed().len()
        {
            let allowed = "an index of a fixed piece of the world";
            return Error::Count { field: "fixed piece of a contact", count, allowed };
        }
        let allowed = "an index of a contact point of its body";
        Error::Count { field: "point of a contact", count: key.point, allowed }
    }
}

/// The force of one contact over a step.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct ContactForce {
    /// Which features touch.
    pub key: ContactKey,
    /// f, N, world, on body A; the opposite one acts on B.
    pub force: Vector3<f64>,
    /// The part of the force along the contact's normal, N.
    pub normal_force: f64,
    /// The mean slip of the touching point over the step, m/s, world, across the normal.
    pub slip: Vector3<f64>,
}

impl ContactForce {
    /// No force at the contact `key`.
    #[must_use]
    pub fn none(key: ContactKey) -> Self {
        Self { key, force: Vector3::zeros(), normal_force: 0.0, slip: Vector3::zeros() }
    }

    /// Whether the contact presses: a candidate that touches without a force does not.
    #[must_use]
    pub fn carries_force(&self) -> bool {
        self.normal_force > 0.0
    }
}

impl AsRef<ContactKey> for ContactForce {
    fn as_ref(&self) -> &ContactKey {
        &self.key
    }
}

/// What a step came to.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct StepSolution {
    /// X at step k+1, one a body.
    pub states: Vec<State>,
    /// One a candidate contact, in the candidates' order; a [`KeyIndex`](crate::contact::KeyIndex) finds one
    /// by its key.
    pub contacts: Vec<ContactForce>,
    /// One a joint of the world, in their order.
    pub joints: Vec<JointForce>,
    /// The force of each gear along the first of its coordinates, N or N m.
    pub gears: Vec<f64>,
}

impl StepSolution {
    /// Free flight to `states`, no contact.
    #[must_use]
    pub fn free(states: &[State]) -> Self {
        Self { states: states.to_vec(), ..Self::default() }
    }

    /// Makes this free flight to `states`: no contact.
    pub fn set_free(&mut self, states: &[State]) {
        self.states.clear();
        self.states.extend_from_slice(states);
        self.contacts.clear();
        self.joints.clear();
        self.gears.clear();
    }

    /// Makes this the same as `other`, in the memory that it has.
    pub fn copy_from(&mut self, other: &Self) {
        self.states.clear();
        self.states.extend_from_slice(&other.states);
        self.contacts.clear();
        self.contacts.extend_from_slice(&other.contacts);
        self.joints.clone_from(&other.joints);
        self.gears.clear();
        self.gears.extend_from_slice(&other.gears);
    }

    /// The forces of all candidates, N, world.
    pub fn forces(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        self.contacts.iter().map(|contact| contact.force)
    }

    /// Takes out the body `index` with the forces of its contacts, and the joints and gears that do not stay; bodies
    /// after it move up by one.
    pub(crate) fn leave_out(&mut self, index: usize, joints: &[bool], gears: &[bool]) {
        if index < self.states.len() {
            self.states.remove(index);
        }
        let renumbered = |force: &ContactForce| {
            let key = force.key.renumbered(|body| without(body, index))?;
            Some(ContactForce { key, ..*force })
        };
        self.contacts = self.contacts.iter().filter_map(renumbered).collect();
        let mut stay = joints.iter();
        self.joints.retain(|_| stay.next().copied().unwrap_or(true));
        let mut stay = gears.iter();
        self.gears.retain(|_| stay.next().copied().unwrap_or(true));
    }

    /// The sum of all contact forces on body `index`, N, world.
    #[must_use]
    pub fn total_force(&self, index: usize) -> Vector3<f64> {
        use crate::contact::Partner;
        let share = |contact: &ContactForce| match contact.key {
            key if key.body == index => contact.force,
            key if key.partner == Partner::Body(index) => -contact.force,
            _ => Vector3::zeros(),
        };
        self.contacts.iter().map(share).sum()
    }
}

/// How a step ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum StepStatus {
    /// Nothing can touch: the answer is free flight, no problem was solved.
    Free,
    /// The solver met its tolerance from its first start.
    Converged,
    /// The solver met its tolerance from a later start.
    Retried,
    /// Another solver's answer stands in.
    Fallback,
    /// The step as one was not solved; shorter steps in its place were. Its forces are their mean, and its residual
    /// is that of one step.
    Substepped,
    /// Solved, but no physics: it turns a body by more than a radian, makes energy or lets something
    /// pass, because the time step is too long for the motion ([`wild`](crate::simulation::wild)).
    Wild,
    /// No solver met its tolerance, nor in shorter steps; the best point found is reported, or a motion that makes no energy.
    Failed,
    /// The last row of a trajectory: a state without a step.
    End,
}

impl StepStatus {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Free,
        Self::Converged,
        Self::Retried,
        Self::Fallback,
        Self::Substepped,
        Self::Wild,
        Self::Failed,
        Self::End,
    ];

    /// The word of the CSV column.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Free => "free",
            Self::Converged => "converged",
            Self::Retried => "retried",
            Self::Fallback => "fallback",
            Self::Substepped => "substepped",
            Self::Wild => "wild",
            Self::Failed => "failed",
            Self::End => "end",
        }
    }

    /// The status of a CSV word.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|status| status.name() == name)
    }
}

impl fmt::Display for StepStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// What a solver reports of a step, beside the solution.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepReport {
    /// How it ended.
    pub status: StepStatus,
    /// Iterations of the solver.
    pub iterations: u32,
    /// The start that the solution came from, in the solver's words; `None` where no problem
    /// was solved.
    pub start: Option<&'static str>,
    /// What a solver behind the interface said of its last try: Ipopt's return status.
    pub message: Option<&'static str>,
}

impl StepReport {
    /// The report of a step or row for which no problem was solved.
    #[must_use]
    pub fn without_problem(status: StepStatus) -> Self {
        Self { status, iterations: 0, start: None, message: None }
    }
}

/// A solver of the contact step. It owns its scratch memory and is made for one world. Two methods are needed; the others
/// have defaults.
pub trait StepSolver: Send {
    /// A step counts as solved only with a residual of at most this, m/s, whatever the solver
    /// itself says; the simulation checks it with its
    /// [certificate](crate::contact::certificate).
    fn accepted_residual(&self) -> f64;

    /// Solves `step` and writes the point found to `solution`, also where the report says that
    /// it failed: one state a body, one force a contact. Every number in it is finite.
    ///
    /// `candidates` comes in with the contacts to consider. A solver may have
    /// [more of them found](Candidates::admit_missed); none is ever taken away.
    ///
    /// # Errors
    /// Only where the step could not be posed at all ([`Step::check`]), or was interrupted; what
    /// `solution` then holds means nothing. Non-convergence is a status.
    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error>;

    /// The same solver as one of islands, if it is one.
    fn islands(&mut self) -> Option<&mut dyn IslandSolver> {
        None
    }

    /// Goes on with the steps of `world`, in which bodies were added or taken out. What it
    /// knows of solutions with other bodies is forgotten.
    ///
    /// # Errors
    /// A world that the solver is not for; a solver without a method of its own is for one world.
    /// It then stays what it was.
    fn change_world(&mut self, world: &World) -> Result<(), Error> {
        let _ = world;
        Err(Error::Unsupported {
            what: "another number of bodies",
            why: "the solver is made for one world; exchange the motion of a new simulation",
        })
    }

    /// What its next answers depend on besides the step itself, in a form of its own, for a
    /// simulation that is saved: nothing, unless the solver has a method of its own.
    fn memory(&self) -> Vec<u8> {
        Vec::new()
    }

    /// Goes on in `world` from what a solver of its kind [remembered](StepSolver::memory); forgets
    /// everything where that is nothing. A solver without a method of its own remembers nothing.
    ///
    /// # Errors
    /// Bytes of another form. The memory is then as before.
    fn recall(&mut self, world: &World, memory: &[u8]) -> Result<(), Error> {
        let _ = (world, memory);
        Ok(())
    }
}

/// A solver that solves each island of a step by itself: bodies that touch or are joined, directly or through others.
///
/// It takes the selection rule, the limit of equal vanishing compliances, where the laws leave forces or motion open. Its
/// answers depend on the step and its candidates alone, to the last bit.
pub trait IslandSolver {
    /// Solves the same step again, of which `solution` is what this solver found last, where contacts
    /// of the bodies that are `marked` have another [rebound](Contact::rebound) since. What is not joined
    /// to a marked body keeps its solution, bit for bit. The report speaks for the whole step, but its iterations are
    /// those of this call. A body without a mark counts as marked.
    ///
    /// # Errors
    /// As [`StepSolver::solve`].
    fn solve_again(
        &mut self,
        step: &Step<'_>,
        marked: &[bool],
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error>;

    /// Whether the island of `body` was solved in the last step.
    fn is_solved(&self, body: usize) -> bool;

    /// Tells which bodies the next step is the last one again for: states, loads, contacts at its start and the solutions before it are
    /// those of the last step for all that hangs together with them, to the last bit. They may be left as they are, as long
    /// as nothing else comes to them.
    fn expect_rest(&mut self, bodies: &[bool]);

    /// Whether the last step left `body` as it was without solving anything, because it was [told](Self::expect_rest) to rest.
    fn rested(&self, body: usize) -> bool;
}

impl<S: StepSolver + ?Sized> StepSolver for Box<S> {
    fn accepted_residual(&self) -> f64 {
        (**self).accepted_residual()
    }

    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error> {
        (**self).solve(step, candidates, solution)
    }

    fn islands(&mut self) -> Option<&mut dyn IslandSolver> {
        (**self).islands()
    }

    fn change_world(&mut self, world: &World) -> Result<(), Error> {
        (**self).change_world(world)
    }

    fn memory(&self) -> Vec<u8> {
        (**self).memory()
    }

    fn recall(&mut self, world: &World, memory: &[u8]) -> Result<(), Error> {
        (**self).recall(world, memory)
    }
}
