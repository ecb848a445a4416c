//! Input and output of one time step, and the trait of its solvers.
//!
//! A [`Step`] holds the input: the world, the states at k, the free flight and the previous
//! solution. A [`StepSolver`] computes a [`StepSolution`]: the states at k+1 and one force per
//! contact. The solvers are in [`crate::solver`]. Model, certificate, loop and writers depend on
//! this trait only.

use crate::contact::{Candidates, Contact, ContactKey, ContactLoad, Partner};
use crate::error::Error;
use crate::joint::JointForce;
use crate::mechanics::{RigidBody, State, Wrench};
use crate::world::{World, without};
use nalgebra::Vector3;
use std::fmt;
use std::sync::atomic::AtomicBool;

/// Input of one contact step. Every list has one entry per body of the world.
#[derive(Debug, Clone, Copy)]
pub struct Step<'a> {
    /// Constants of the world.
    pub world: &'a World,
    /// States X at step k.
    pub states: &'a [State],
    /// External wrenches during the step, without gravity.
    pub wrenches: &'a [Wrench],
    /// States X at step k+1 if no contact or joint acted.
    pub free: &'a [State],
    /// Solution of the previous step, the initial point of solvers.
    pub previous: &'a StepSolution,
    /// Solution of the step before the previous one, if known. Parts that are equal in both have
    /// settled.
    pub earlier: Option<&'a StepSolution>,
    /// Flag that ends the step with [`Error::Interrupted`] when raised.
    pub interrupt: Option<&'a AtomicBool>,
}

impl Step<'_> {
    /// Largest distance of a point of the body `index` from the origin at the start (m).
    pub(crate) fn distance(&self, index: usize) -> f64 {
        self.states[index].position.norm() + self.world.bodies()[index].reach()
    }

    /// Checks the step and its candidates `contacts` against the world, so that solvers can index
    /// without further checks.
    ///
    /// # Errors
    /// [`Error::Count`] if a list does not have one entry per body, or if a contact names a body, a
    /// contact point or a fixed piece that does not exist. The previous solutions are not checked.
    pub fn check(&self, contacts: &[Contact]) -> Result<(), Error> {
        let bodies = self.world.bodies();
        let each = [
            ("states of the step", self.states.len()),
            ("wrenches of the step", self.wrenches.len()),
            ("states of the step's free flight", self.free.len()),
        ];
        for (field, count) in each {
            if count != bodies.len() {
                return Err(Error::Count { field, count, allowed: "one per body" });
            }
        }
        let is_known = |key: &ContactKey| {
            let point = |body: &RigidBody| key.point < body.contact_points().len();
            let partner = match key.partner {
                Partner::Ground => true,
                Partner::Body(other) => other < bodies.len(),
                Partner::Fixed(index) => index < self.world.fixed_count(),
            };
            partner && bodies.get(key.body).is_some_and(point)
        };
        match contacts.iter().find(|contact| !is_known(&contact.key)) {
            Some(contact) => Err(self.unknown(&contact.key)),
            None => Ok(()),
        }
    }

    /// Error for a contact that is not part of the world.
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
            && count >= self.world.fixed_count()
        {
            let allowed = "an index of a fixed piece of the world";
            return Error::Count { field: "fixed piece of a contact", count, allowed };
        }
        let allowed = "an index of a contact point of its body";
        Error::Count { field: "point of a contact", count: key.point, allowed }
    }
}

/// Force of one contact over a step.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct ContactForce {
    /// Features in contact.
    pub key: ContactKey,
    /// Force f on body A (N), world frame. Body B receives the opposite force.
    pub force: Vector3<f64>,
    /// Component of the force along the contact normal (N); negative if [adhesion](crate::contact::adhesion)
    /// holds the bodies together.
    pub normal_force: f64,
    /// Share a of the adhesion (eq. 48) (N).
    pub adhesion: f64,
    /// Mean slip velocity of the contact point over the step (m/s), world frame, orthogonal to the
    /// normal.
    pub slip: Vector3<f64>,
}

impl ContactForce {
    /// Force on body `index` (N), world frame.
    pub fn force_on(&self, index: usize) -> Vector3<f64> {
        match self.key {
            key if key.body == index => self.force,
            key if key.partner.body() == Some(index) => -self.force,
            _ => Vector3::zeros(),
        }
    }

    /// Zero force at the contact `key`.
    pub fn none(key: ContactKey) -> Self {
        let zero = Vector3::zeros();
        Self { key, force: zero, normal_force: 0.0, adhesion: 0.0, slip: zero }
    }

    /// f̃_n (eq. 48): normal force beyond the adhesion (N).
    pub fn pressing_force(&self) -> f64 {
        self.normal_force + self.adhesion
    }

    /// True if the pressing force is positive, beyond the rounding of the adhesion.
    pub fn carries_force(&self) -> bool {
        self.pressing_force() > 1e-9 * self.adhesion
    }
}

impl AsRef<ContactKey> for ContactForce {
    fn as_ref(&self) -> &ContactKey {
        &self.key
    }
}

/// Result of a step.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct StepSolution {
    /// States X at step k+1, one per body.
    pub states: Vec<State>,
    /// Contact forces, one per candidate in the candidates' order. A
    /// [`KeyIndex`](crate::contact::KeyIndex) finds a force by its key.
    pub contacts: Vec<ContactForce>,
    /// Moment of each contact on body A about the contact point (N m), world frame; body B receives the
    /// opposite. Empty without [turning friction](World::with_coefficient).
    pub moments: Vec<Vector3<f64>>,
    /// Joint forces, one per joint of the world.
    pub joints: Vec<JointForce>,
    /// Force of each gear along its first coordinate (N or N m).
    pub gears: Vec<f64>,
    /// Variables of the nonlinear program of this step, in its own order and units, if the solver
    /// reports them. Otherwise empty.
    pub variables: Vec<f64>,
}

impl StepSolution {
    /// Solution without contacts and joints that ends at `states`.
    pub fn free(states: &[State]) -> Self {
        Self { states: states.to_vec(), ..Self::default() }
    }

    /// Turns this solution into free flight that ends at `states`.
    pub fn set_free(&mut self, states: &[State]) {
        states.clone_into(&mut self.states);
        self.contacts.clear();
        self.moments.clear();
        self.joints.clear();
        self.gears.clear();
        self.variables.clear();
    }

    /// Copies `other` and reuses the allocated memory.
    pub fn copy_from(&mut self, other: &Self) {
        self.states.clone_from(&other.states);
        self.contacts.clone_from(&other.contacts);
        self.moments.clone_from(&other.moments);
        self.joints.clone_from(&other.joints);
        self.gears.clone_from(&other.gears);
        self.variables.clone_from(&other.variables);
    }

    /// Forces of all candidates (N), world frame.
    pub fn forces(&self) -> impl Iterator<Item = Vector3<f64>> + Clone + '_ {
        self.contacts.iter().map(|contact| contact.force)
    }

    /// Forces and moments of all candidates.
    pub fn loads(&self) -> impl Iterator<Item = ContactLoad> + Clone + '_ {
        let load = |(place, contact): (usize, &ContactForce)| ContactLoad {
            force: contact.force,
            moment: self.moment(place),
        };
        self.contacts.iter().enumerate().map(load)
    }

    /// Moment of a contact on body A (N m), world frame.
    pub fn moment(&self, place: usize) -> Vector3<f64> {
        self.moments.get(place).copied().unwrap_or_default()
    }

    /// Removes the body `index` and the forces of its contacts. Bodies after it move up by one.
    /// Joints and gears stay where their flag in `joints` and `gears` is true.
    pub(crate) fn leave_out(&mut self, index: usize, joints: &[bool], gears: &[bool]) {
        if index < self.states.len() {
            self.states.remove(index);
        }
        let renumbered = |force: &ContactForce| {
            let key = force.key.renumbered(|body| without(body, index))?;
            Some(ContactForce { key, ..*force })
        };
        let stay = |force: &ContactForce| renumbered(force).is_some();
        let moments = self.contacts.iter().zip(&self.moments).filter(|(force, _)| stay(force));
        self.moments = moments.map(|(_, moment)| *moment).collect();
        self.contacts = self.contacts.iter().filter_map(renumbered).collect();
        let mut stay = joints.iter();
        self.joints.retain(|_| stay.next().copied().unwrap_or(true));
        let mut stay = gears.iter();
        self.gears.retain(|_| stay.next().copied().unwrap_or(true));
    }

    /// Sum of all contact forces on body `index` (N), world frame.
    pub fn total_force(&self, index: usize) -> Vector3<f64> {
        self.contacts.iter().map(|contact| contact.force_on(index)).sum()
    }
}

/// Status of a finished step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub enum StepStatus {
    /// Nothing can touch: the result is free flight and no problem was solved.
    Free,
    /// The solver met its tolerance from its first initial point.
    Converged,
    /// The solver met its tolerance from a later initial point.
    Retried,
    /// The result comes from another solver.
    Fallback,
    /// The step did not converge in one interval, and a sequence of shorter ones replaced it.
    Substepped,
    /// Converged but unphysical: a body turns by more than a radian, energy grows or a body passes
    /// through another. The time step is too long for the motion
    /// ([`wild`](crate::simulation::unphysical)).
    Wild,
    /// Not converged, neither in one step nor in shorter ones. The result is a solution that keeps the
    /// overlaps of the start, the best point found, or a motion that does not add energy.
    Failed,
    /// Last row of a trajectory: a state without a step.
    End,
}

impl StepStatus {
    /// All statuses.
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

    /// Name of the status in the CSV column.
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

    /// True if the states at the end of the step satisfy the laws: neither failed nor unphysical.
    pub fn is_solved(self) -> bool {
        !matches!(self, Self::Failed | Self::Wild)
    }

    /// True if the step is [solved](Self::is_solved) as one problem. A substepped one is not.
    pub fn is_one_problem(self) -> bool {
        self.is_solved() && self != Self::Substepped
    }

    /// Status of a row that stands for a step with this status and a `later` one.
    #[must_use]
    pub fn with_later(self, later: Self) -> Self {
        let rank = |status| {
            [Self::Substepped, Self::Wild, Self::Failed].iter().position(|mark| *mark == status)
        };
        if rank(later) > rank(self) { later } else { self }
    }

    /// Status with the CSV name `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|status| status.name() == name)
    }
}

impl fmt::Display for StepStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Diagnostics of a solver for one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepReport {
    /// Status of the step.
    pub status: StepStatus,
    /// Number of solver iterations.
    pub iterations: u32,
    /// Name of the initial point that led to the solution; `None` if no problem was solved.
    pub start: Option<&'static str>,
    /// Return status of an external solver at its last attempt, such as Ipopt's.
    pub message: Option<&'static str>,
}

impl StepReport {
    /// Report of a step or row without a problem to solve.
    pub fn without_problem(status: StepStatus) -> Self {
        Self { status, iterations: 0, start: None, message: None }
    }
}

/// Solver of the contact step. It owns its scratch memory and is made for one world. Two methods
/// are required; the others have defaults.
pub trait StepSolver: Send {
    /// Largest residual of a converged step (m/s). The simulation checks it with its
    /// [certificate](crate::contact::certificate), whatever the solver reports.
    fn accepted_residual(&self) -> f64;

    /// Solves `step` and writes the point found to `solution`: one state per body and one force per
    /// contact. A step that did not converge writes a point too. All numbers written are finite.
    ///
    /// On input, `candidates` holds the contacts to consider. A solver may [add missed
    /// ones](Candidates::admit_missed) but never removes any.
    ///
    /// # Errors
    /// If the step cannot be posed ([`Step::check`]) or was interrupted; the content of `solution`
    /// is then unspecified. A step that does not converge is a status, not an error.
    fn solve(
        &mut self,
        step: &Step<'_>,
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error>;

    /// This solver as an [`IslandSolver`], if it is one.
    fn islands(&mut self) -> Option<&mut dyn IslandSolver> {
        None
    }

    /// Continues with the steps of `world`, to which bodies were added or from which they were
    /// removed. Stored solutions with other bodies are dropped.
    ///
    /// # Errors
    /// If the solver does not support `world`; it is then unchanged. The default supports no other
    /// world.
    fn change_world(&mut self, world: &World) -> Result<(), Error> {
        let _ = world;
        Err(Error::Unsupported {
            what: "change of the number of bodies",
            why: "this solver supports one world; create a new simulation",
        })
    }

    /// Serialised state that influences the next solutions, in the solver's own format, for a saved
    /// simulation. Empty by default.
    fn memory(&self) -> Vec<u8> {
        Vec::new()
    }

    /// Continues in `world` from the [memory](StepSolver::memory) of a solver of the same kind.
    /// Empty bytes clear the memory. The default does nothing.
    ///
    /// # Errors
    /// If the bytes have another format; the memory is then unchanged.
    fn recall(&mut self, world: &World, memory: &[u8]) -> Result<(), Error> {
        let _ = (world, memory);
        Ok(())
    }
}

/// Solver that solves each island of a step separately. An island is a set of bodies connected by
/// contacts and joints, directly or through other bodies.
///
/// If the contact laws leave forces or motion undetermined, it applies the selection rule: the
/// limit of equal vanishing compliances. Its solutions depend bit for bit on the step and its
/// candidates only.
pub trait IslandSolver {
    /// Solves the same step again after contacts of the `marked` bodies got another
    /// [rebound](Contact::rebound). On input, `solution` is the last solution of this solver.
    /// Islands without a marked body keep their solution bit for bit. The report covers the whole
    /// step, but counts only the iterations of this call. A body without a flag counts as marked.
    ///
    /// # Errors
    /// Same as [`StepSolver::solve`].
    fn solve_again(
        &mut self,
        step: &Step<'_>,
        marked: &[bool],
        candidates: &mut Candidates,
        solution: &mut StepSolution,
    ) -> Result<StepReport, Error>;

    /// True if the island of `body` was solved in the last step.
    fn is_solved(&self, body: usize) -> bool;

    /// Announces the bodies whose next step repeats the last one. For their whole islands, the
    /// states, the loads, the initial contacts and the preceding solutions are bitwise equal to the
    /// last step's. The solver may leave these bodies unchanged as long as nothing else touches
    /// them, and must do so for those whose contacts are [set aside](Candidates::aside).
    fn expect_rest(&mut self, bodies: &[bool]);

    /// Announces the bodies without a solution, or that failed in several steps, for all calls until another
    /// announcement. Their islands get less effort.
    fn expect_failure(&mut self, bodies: &[bool]);

    /// True if the last step left `body` unchanged without a solve, after
    /// [`expect_rest`](Self::expect_rest).
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
