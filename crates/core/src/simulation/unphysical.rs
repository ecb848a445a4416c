//! Unphysical steps: they satisfy every law, but the time step is too long for the motion.
//!
//! A step rotates a body about one axis by 2 atan(½ h|ω⁺|). The contact laws use the mean motion of
//! a point over the step, and the impulse does work on the motion at its end. The two differ with
//! the rotation, and the energy of a solved step can grow by up to
//!
//! ```text
//! Σ |p| |ω⁺ × c| θ/√(1 + θ²),   θ = ½ h|ω⁺|                               (eq. 28)
//! ```
//!
//! over all contacts. This vanishes with h. At rotations of a radian per step it is as large as the
//! energy of the body, and no residual shows it. Such steps get the status
//! [`StepStatus::Wild`](crate::step::StepStatus::Wild).
//!
//! Energy is counted per island of bodies with contact forces, so that unrelated bodies do not mask
//! a gain. With the kinetic energy T, and the external forces f (with gravity) and torques τ, an
//! island gains
//!
//! ```text
//! Σ T⁺ − T − f·(r⁺ − r) − h τ·ω⁺            without a contact that bounces,
//! Σ T⁺ − T − h f·(v + v⁺)/2 − h τ·(ω + ω⁺)/2     with one                (eq. 32)
//! ```
//!
//! The scheme moves bodies with the new velocities. The first line is the work on resting and
//! sliding bodies, for which (28) holds. A bouncing body moves with two velocities in a step. The
//! second line is the change of the energy at mid-step velocities, ½m|v + ½h f/m|² (eq. 30), minus
//! the work along the path. Its translational part is the work of the impulses (eq. 31), to
//! rounding. An elastic bounce gains nothing by the second line, and the fraction 2 g h/|v| of its
//! energy by the first.
//!
//! Islands with joints use the second line too. With half kicks, the line with the smaller gain counts. Joint
//! reactions do no work on the mean of both velocities, except at higher order. Work of drives is allowed, and so
//! is the work −h f·s of surfaces that move by s ([`Contact::carried`](crate::contact::Contact::carried)). The work
//! of axes that stop and then hold a load is allowed up to
//!
//! ```text
//! Σ ½ h f·(v⁺ − v) + ½ h (τ − ω × Iω)·(ω⁺ − ω) + ½ Σ f ((x⁺ − x_k) − (x_k − x̃))      (eq. J6a)
//! ```
//!
//! with the drives in the last sum. This is the work of the loads on the motion at the end, minus
//! their work on the mean motion. A step whose directions do not rotate gains no more. Without this
//! limit, the work of a stop hides a gain of the step.
//!
//! A touching point that rolls moves over its body. The force at its place at k does work on the velocities before and
//! after k, which nearly cancel. The part of the velocities after it,
//!
//! ```text
//! Σ ½ h f_n |n·s(w⁺) − (φ⁺ − φ)/h| + ½ h |f_t| |o|                       (eq. 32b)
//! ```
//!
//! with the rate n·s of A's point and the offset o (38a), is not a gain of an island without joints, up to 1/200 of
//! its energy.
//!
//! The velocities before k belong to the middle of the last step. In the directions of the joints at k they differ
//! from the mean rates of that step. In smooth motion, the work of joint forces on this difference cancels with
//! that of the next step. At an impact of a stop it does not, for any h:
//!
//! ```text
//! ½ Σ (h (f·v + τ·ω) − f (x_k − x̃))                                        (eq. 32c)
//! ```
//!
//! over all joint axes. Shorter intervals do not reduce such a gain. A step is then kept and marked, up to 1/200 of
//! the energy.
//!
//! A step also removes the depth δ at which contacts begin, and the error ε of joints at its start.
//! Bodies between two planes move by more than δ, here up to 2 δ. At a speed v of the island of mass m
//! this adds up to
//!
//! ```text
//! ½ m (2 δ/h)² + ½ m (2 v + ε/h) ε/h + m |g| (2 δ + ε)                   (eq. 32a)
//! ```
//!
//! Such a gain is marked, but it is not an error of the solution.
//!
//! Steps that missed a contact get the status too. Pieces passed through each other, or overlap
//! deeply without a contact feature, or rotate by more than a radian near each other
//! ([`Candidates::missed_pair`](crate::contact::Candidates::missed_pair)) or near the ground
//! ([`lost_body`]).
//! The direction of a nearly full turn is unknown.

use super::energy;
use super::islands::Islands;
use crate::contact::certificate::Claim;
use crate::joint::{JointMotion, JointWork};
use crate::mechanics::{RigidBody, State, Wrench};
use crate::world::{Partner, World};
use nalgebra::Vector3;

/// Largest rotation of a body in a valid step (rad).
pub use crate::mechanics::trajectory::LARGEST_TURN;

/// Largest energy gain of an island in a valid step, relative to its kinetic energy and work.
pub const LARGEST_GAIN: f64 = 1e-3;

/// Largest share of the energy for the works (32b) and (32c).
const LARGEST_ROLL: f64 = 5e-3;

/// Energy gain due to rounding, relative to the same energy.
pub(super) const ROUNDING: f64 = 1e-9;

/// Speed of negligible kinetic energy (m/s), in the world's [scale](World::speed_scale).
const REST: f64 = 1e-4;

/// Gain for which no step is repeated, in units of that kinetic energy, and at most (J). The steps
/// after a corrected error of a joint have such gains.
const SMALL_GAIN: (f64, f64) = (2e3, 1e-5);

/// Test by which a step is unphysical.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub enum UnphysicalCause {
    /// A body rotates by more than [`LARGEST_TURN`].
    Turn {
        /// The body.
        body: usize,
        /// Rotation (rad).
        angle: f64,
    },
    /// An island gains more than [`LARGEST_GAIN`].
    Gain {
        /// First body of the island.
        body: usize,
        /// Energy gain (J).
        energy: f64,
    },
    /// The contact of two objects is missed.
    Missed {
        /// The two objects.
        between: [Partner; 2],
    },
    /// A contact carries a force and is not where the two objects touch.
    Misplaced {
        /// The two objects.
        between: [Partner; 2],
        /// Error of its placement (18g) (m).
        error: f64,
    },
}

impl UnphysicalCause {
    /// Rotation of `body` in a step of `world` to `next`.
    pub(super) fn turn(world: &World, body: usize, next: &State) -> Self {
        Self::Turn { body, angle: world.time_step() * next.spin.norm() }
    }
}

/// Energy that an island makes in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct EnergyGain {
    /// First body of the island.
    pub body: usize,
    /// Energy beyond the balance (32) (J).
    pub energy: f64,
}

/// Detects unphysical steps. Owns reusable memory.
#[derive(Debug, Clone, Default)]
pub struct EnergyCheck {
    islands: Islands,
    /// Budget of the island whose first body is this one.
    budgets: Vec<Budget>,
}

/// Energy budget of an island in a step (J).
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Budget {
    /// True if the island has a contact force or joint; otherwise it is in free flight.
    touches: bool,
    /// True if a contact bounces, or if the island has a joint.
    bounces: bool,
    pub(super) gained: f64,
    /// Work of moving surfaces at contacts whose A is this body, before the sum over the island.
    carried: f64,
    /// Largest initial depth of contacts whose A is this body (m); then the sum over the island.
    under: f64,
    /// Kinetic energy plus the work of external forces and drives.
    pub(super) size: f64,
    /// Energy of the smallest significant motion.
    rest: f64,
    mass: f64,
    /// Error of joints and gears at the start (m), if the gain exceeds that of a valid step.
    off: f64,
    /// Energy (32a) of the depth and errors that the step removes (J); like `off`.
    lift: f64,
    /// Work (32c) of joint forces (J); like `off`.
    lag: f64,
    /// True if the island has a joint.
    is_joined: bool,
    /// Share of the kinetic energy that a body may gain [at its start](World::bent_share).
    bent: f64,
    /// Work (32b) of forces at points that roll over this body, then the sum over the island (J).
    rolled: f64,
    /// Work along mean velocities beyond that along the path of the step (J).
    mean_work: f64,
    /// Work of joint axes that stop and hold a load (J), and its limit (J6a) from drives (J).
    holding: f64,
    excess: f64,
}

impl Budget {
    /// True if the island gains energy beyond rounding. A NaN is a gain.
    pub(super) fn gains(&self) -> bool {
        let is_small = self.gained <= ROUNDING * self.size;
        !is_small
    }

    /// True if the gain is larger than in a valid step.
    pub(super) fn exceeds(&self) -> bool {
        let is_allowed = self.gained <= LARGEST_GAIN * self.size + self.rest;
        self.touches && !is_allowed
    }

    /// True if the gain is also larger than what the depth at the start explains (32a).
    pub(super) fn is_made(&self) -> bool {
        self.exceeds() && !self.is_explained_with(self.lift)
    }

    /// True if the gain is no larger than in a valid step with an energy of `more` (J).
    fn is_explained_with(&self, more: f64) -> bool {
        let rest = self.rest.max((SMALL_GAIN.0 * self.rest).min(SMALL_GAIN.1));
        self.gained <= LARGEST_GAIN * self.size + rest + more
    }

    /// Adds the next of several shorter steps of the same bodies.
    pub(super) fn add(&mut self, next: &Self) {
        self.touches |= next.touches;
        self.gained += next.gained;
        (self.size, self.rest) = (self.size.max(next.size), self.rest.max(next.rest));
        self.lift = self.lift.max(next.lift);
    }
}

impl EnergyCheck {
    /// Creates an empty judge.
    pub fn new() -> Self {
        Self::default()
    }

    /// True if the step of `world` described by `claim` rotates a body too far, or if an island
    /// gains energy. `forces` holds the contact forces (N), world frame, one per contact.
    ///
    /// The solver may leave a residual of `accepted` (m/s). A point that an earlier step left at
    /// the corresponding depth, or that starts deeper, may be lifted against gravity; this is not
    /// counted as a gain. Claims that do not fit `world` are unphysical.
    pub fn is_unphysical(
        &mut self,
        world: &World,
        claim: &Claim<'_>,
        forces: impl IntoIterator<Item = Vector3<f64>>,
        accepted: f64,
    ) -> bool {
        if !claim.is_of(world) {
            return true;
        }
        let joints = world.joints().iter().zip(claim.joints);
        let ends = (claim.states, claim.next);
        let map = world.step_map();
        let motions = joints.map(|(joint, force)| joint.step_motion(ends.0, ends.1, force, &map));
        let motions: Vec<JointMotion> = motions.flatten().collect();
        self.cause(world, claim, &motions, forces, accepted, &[]).is_some()
    }

    /// Largest energy that an island gains in the last counted step, if it is beyond rounding.
    pub(super) fn largest_gain(&self) -> Option<EnergyGain> {
        let all = self.budgets.iter().enumerate().filter(|(_, of)| of.touches && of.gains());
        let all = all.map(|(body, of)| EnergyGain { body, energy: of.gained });
        all.reduce(|most, of| if of.energy > most.energy { of } else { most })
    }

    /// True if the island of `body` gains energy beyond rounding in the last counted step.
    pub(super) fn gains(&self, body: usize) -> bool {
        self.budgets[self.islands.label(body)].gains()
    }

    /// True if the island of `body` makes energy in the last counted step: it gains more than
    /// [`LARGEST_GAIN`] and the depth at the start explain.
    pub(super) fn makes(&self, body: usize) -> bool {
        self.budgets[self.islands.label(body)].is_made()
    }

    /// True if (32a) and (32c) explain the gain of the island of `body`.
    pub(super) fn lags(&self, body: usize) -> bool {
        let budget = &self.budgets[self.islands.label(body)];
        budget.is_explained_with(budget.lift + budget.lag.min(LARGEST_ROLL * budget.size))
    }

    /// Sum over the islands of these bodies in the last counted step.
    pub(super) fn sum(&self, bodies: &[bool]) -> Budget {
        let mut sum = Budget { touches: true, ..Budget::default() };
        let islands = bodies.iter().enumerate().filter(|(_, is_member)| **is_member);
        let mut islands: Vec<_> = islands.map(|(body, _)| self.islands.label(body)).collect();
        islands.sort_unstable();
        islands.dedup();
        for of in islands.into_iter().map(|island| &self.budgets[island]) {
            sum.gained += of.gained;
            sum.size += of.size;
            sum.rest += of.rest;
            sum.lift += of.lift;
        }
        sum
    }

    /// Why the step is unphysical, if it is. The claim fits the world and has the joint motions `motions`.
    /// The islands of bodies in `rests`, whose contacts are not in the claim, are those of the step before.
    /// The other arguments are like in [`EnergyCheck::is_unphysical`].
    pub(super) fn cause(
        &mut self,
        world: &World,
        claim: &Claim<'_>,
        motions: &[JointMotion],
        forces: impl IntoIterator<Item = Vector3<f64>>,
        accepted: f64,
        rests: &[bool],
    ) -> Option<UnphysicalCause> {
        self.count(world, claim, motions, forces, accepted, rests);
        let h = world.time_step();
        // Comparisons are false for NaN, which is unphysical too.
        let turns_little = |next: &State| h * next.spin.norm() <= LARGEST_TURN;
        if let Some(body) = claim.next.iter().position(|next| !turns_little(next)) {
            return Some(UnphysicalCause::turn(world, body, &claim.next[body]));
        }
        let body = self.budgets.iter().position(Budget::exceeds)?;
        Some(UnphysicalCause::Gain { body, energy: self.budgets[body].gained })
    }

    /// Computes the budgets of all islands but those of the bodies in `rests`.
    pub(super) fn count(
        &mut self,
        world: &World,
        claim: &Claim<'_>,
        motions: &[JointMotion],
        forces: impl IntoIterator<Item = Vector3<f64>>,
        accepted: f64,
        rests: &[bool],
    ) {
        let h = world.time_step();
        self.join(world, claim, forces, rests);
        let counts = |body: usize| rests.get(body) != Some(&true);
        // Adds the surface work of each body to its island.
        if world.has_surfaces() {
            for index in 0..self.budgets.len() {
                let carried = std::mem::take(&mut self.budgets[index].carried);
                self.budgets[self.islands.label(index)].gained -= carried;
            }
        }
        // Parts of a step would sum up what is allowed.
        let is_whole = world.span().is_none();
        let weight = world.gravity().norm();
        let slow = REST * world.speed_scale();
        for (index, body) in world.bodies().iter().enumerate().filter(|(index, _)| counts(*index)) {
            let budget = &mut self.budgets[self.islands.label(index)];
            let (state, next) = (&claim.states[index], &claim.next[index]);
            let [before, after] = [state, next].map(|state| kinetic_energy(world, body, state));
            let wrench = &claim.wrenches[index];
            let [along, mean] =
                [work, work_of_bounce].map(|work| work(world, body, state, next, wrench));
            let work = if budget.bounces { mean } else { along };
            if world.has_half_kicks() {
                budget.mean_work += mean - work;
            }
            budget.gained += after - before - work;
            budget.size += before.max(after) + work.abs();
            let lift = weight * (h * accepted + budget.under);
            budget.rest += body.mass() * (0.5 * slow * slow + lift);
            budget.mass += body.mass();
            budget.bent = budget.bent.max(world.bent_share(index, state));
        }
        // With half kicks, the smaller gain of both lines (32) counts.
        let budgets = self.budgets.iter_mut().enumerate().filter(|(body, _)| counts(*body));
        for (_, budget) in budgets {
            budget.gained -= budget.mean_work.max(0.0);
            let rolled = if is_whole && !budget.is_joined { budget.rolled } else { 0.0 };
            let bent = budget.bent * budget.size + rolled.min(LARGEST_ROLL * budget.size);
            if bent > 0.0 {
                budget.gained -= budget.gained.clamp(0.0, bent);
            }
        }
        let joints = world.joints().iter().zip(claim.joints).zip(motions);
        for ((joint, force), motions) in joints.filter(|((joint, _), _)| counts(joint.body())) {
            let work = motions.work(joint, claim.states, claim.next, force, &world.step_map());
            let work = work.unwrap_or(JointWork::UNKNOWN);
            let body = joint.body();
            let budget = &mut self.budgets[self.islands.label(body)];
            let mut drives = work.drives;
            if joint.moves() {
                // (J6b)
                let state = &claim.states[body];
                let next = &claim.next[body];
                let change = State {
                    velocity: next.velocity - state.velocity,
                    spin: next.spin - state.spin,
                    ..*state
                };
                drives += work.excess + load_excess(world, claim, body)
                    - kinetic_energy(world, &world.bodies()[body], &change);
            }
            budget.gained -= drives;
            budget.size += drives.abs();
            budget.holding += work.holding;
            budget.excess += work.excess;
        }
        for (gear, force) in world.gears().iter().zip(claim.gears) {
            let body = world.joints()[gear.axes()[0].joint].body();
            if !counts(body) {
                continue;
            }
            let work = gear.work(world, claim.states, claim.next, claim.joints, *force);
            let budget = &mut self.budgets[self.islands.label(body)];
            budget.gained -= work.drives;
            budget.size += work.drives.abs();
            budget.excess += work.excess;
        }
        if self.budgets.iter().any(|budget| budget.holding > 0.0) {
            self.allow_holding(world, claim);
        }
        if self.budgets.iter().any(Budget::exceeds) {
            self.explain(world, claim, motions);
        }
    }

    /// Subtracts the work of axes that stop and hold a load from the gains, up to (J6a).
    fn allow_holding(&mut self, world: &World, claim: &Claim<'_>) {
        for body in 0..world.bodies().len() {
            self.budgets[self.islands.label(body)].excess += load_excess(world, claim, body);
        }
        for budget in &mut self.budgets {
            let allowed = std::mem::take(&mut budget.holding).min(budget.excess.max(0.0));
            budget.gained -= allowed;
            budget.size += allowed;
        }
    }

    /// Computes the energies (32a) and (32c) of the islands.
    fn explain(&mut self, world: &World, claim: &Claim<'_>, motions: &[JointMotion]) {
        for ((joint, force), motion) in world.joints().iter().zip(claim.joints).zip(motions) {
            let work = motion.work_of_lag(joint, claim.states, force, world.time_step());
            self.budgets[self.islands.label(joint.body())].lag += work.unwrap_or(0.0);
        }
        let ends: Vec<_> = claim.joints.iter().map(|joint| joint.angles).collect();
        let angles = world.angles_near(claim.states, &ends);
        for (joint, angles) in world.joints().iter().zip(&angles) {
            let errors = [joint.error(claim.states), joint.beyond_limits(claim.states, angles)];
            let reach = world.bodies()[joint.body()].reach();
            let off = errors.into_iter().flatten().map(|(place, turn)| place + turn * reach);
            self.budgets[self.islands.label(joint.body())].off += off.sum::<f64>();
        }
        for gear in world.gears() {
            let body = world.joints()[gear.axes()[0].joint].body();
            let off = gear.error(world.joints(), claim.states, &angles).abs();
            self.budgets[self.islands.label(body)].off +=
                off * world.bodies()[body].reach().max(1.0);
        }
        let (h, weight) = (world.time_step(), world.gravity().norm());
        for budget in &mut self.budgets {
            let Budget { mass, under, off, size, .. } = *budget;
            let (lift, faster) = (2.0 * under, off / h);
            let speed = if mass > 0.0 { (2.0 * size / mass).sqrt() } else { 0.0 };
            let kinetic = (lift / h).powi(2) + (2.0 * speed + faster) * faster;
            budget.lift = mass * (0.5 * kinetic + weight * (lift + off));
        }
    }

    /// Computes the islands and their contact flags.
    fn join(
        &mut self,
        world: &World,
        claim: &Claim<'_>,
        forces: impl IntoIterator<Item = Vector3<f64>>,
        rests: &[bool],
    ) {
        let counts = |body: usize| rests.get(body) != Some(&true);
        let pressing = |force: &Vector3<f64>| *force != Vector3::zeros();
        let bodies = claim.states.len();
        if rests.is_empty() {
            self.budgets.clear();
        }
        self.budgets.resize(bodies, Budget::default());
        let awake = self.budgets.iter_mut().zip(rests).filter(|(_, rests)| !**rests);
        awake.for_each(|(budget, _)| *budget = Budget::default());
        // Marks the bodies of the contacts first, and combines the marks per island below.
        let h = world.time_step();
        let contacts = claim.contacts.iter().zip(forces).filter(|(_, force)| pressing(force));
        let budgets = &mut self.budgets;
        let keys = contacts.map(|(contact, force)| {
            let budget = &mut budgets[contact.key.body];
            budget.touches = true;
            budget.bounces |= contact.bounces();
            budget.under = budget.under.max(-contact.gap);
            if world.has_surfaces() {
                budget.carried -= h * force.dot(&contact.carried(world, claim.states));
            }
            if world.has_half_kicks() && contact.rolls() {
                let normal = contact.normal();
                let along = force.dot(&normal);
                let rate = contact.rate_along(claim.states, claim.next)
                    - (contact.gap_in(claim.next) - contact.gap) / h;
                let across = (force - normal * along).norm();
                budget.rolled +=
                    0.5 * h * (along * rate).abs() + 0.5 * h * across * contact.slip_offset.norm();
            }
            &contact.key
        });
        self.islands.find(bodies, keys, world);
        for joint in world.joints().iter().filter(|joint| counts(joint.body())) {
            let budget = &mut self.budgets[joint.body()];
            (budget.touches, budget.bounces, budget.is_joined) = (true, true, true);
        }
        for body in (0..bodies).filter(|body| counts(*body)) {
            let Budget { touches, bounces, is_joined, .. } = self.budgets[body];
            let under = std::mem::take(&mut self.budgets[body].under);
            let rolled = std::mem::take(&mut self.budgets[body].rolled);
            let budget = &mut self.budgets[self.islands.label(body)];
            budget.touches |= touches;
            budget.bounces |= bounces;
            budget.is_joined |= is_joined;
            budget.under += under;
            budget.rolled += rolled;
        }
    }
}

/// First body of `world` that rotates by more than [`LARGEST_TURN`] near the ground, so that one of
/// its points may have passed through it. The lowest possible point is one reach below the lower
/// end of the path.
#[inline]
pub fn lost_body(world: &World, states: &[State], next: &[State]) -> Option<usize> {
    let ground = world.ground()?;
    let h = world.time_step();
    let height = |state: &State| ground.normal().dot(&state.position) - ground.offset();
    let bodies = world.bodies().iter().zip(states).zip(next);
    bodies.into_iter().position(|((body, state), next)| {
        let turns_far = h * next.spin.norm() > LARGEST_TURN;
        let reach = || {
            let points = body.contact_points().iter();
            points.map(|point| point.position.norm() + point.size()).fold(0.0, f64::max)
        };
        turns_far && height(state).min(height(next)) < reach()
    })
}

/// Work of gravity and `wrench` on a body in a step without bounces (eq. 32) (J).
fn work(world: &World, body: &RigidBody, state: &State, next: &State, wrench: &Wrench) -> f64 {
    let force = wrench.force + world.gravity() * body.mass();
    let moved = next.position - state.position;
    force.dot(&moved) + world.time_step() * wrench.torque.dot(&next.spin)
}

/// Work of gravity and `wrench` on a body in a step with bounces (eq. 32) (J).
fn work_of_bounce(
    world: &World,
    body: &RigidBody,
    state: &State,
    next: &State,
    wrench: &Wrench,
) -> f64 {
    let force = wrench.force + world.gravity() * body.mass();
    let power =
        force.dot(&(state.velocity + next.velocity)) + wrench.torque.dot(&(state.spin + next.spin));
    0.5 * world.time_step() * power
}

/// Work ½ h f·(v⁺ − v) + ½ h (τ − ω × Iω)·(ω⁺ − ω) of the loads of a body on its motion at the end, minus that on its
/// mean motion (J).
fn load_excess(world: &World, claim: &Claim<'_>, index: usize) -> f64 {
    let body = &world.bodies()[index];
    let state = &claim.states[index];
    let next = &claim.next[index];
    let wrench = &claim.wrenches[index];
    let force = wrench.force + world.gravity() * body.mass();
    let torque = wrench.torque - state.spin.cross(&(body.inertia() * state.spin));
    let faster = force.dot(&(next.velocity - state.velocity));
    let turning = torque.dot(&(next.spin - state.spin));
    0.5 * world.time_step() * (faster + turning)
}

/// Translational energy ½ m v² plus the rotational [energy](energy::turning) (J).
pub(super) fn kinetic_energy(world: &World, body: &RigidBody, state: &State) -> f64 {
    let along = 0.5 * body.mass() * state.velocity.norm_squared();
    along + energy::turning(world, body, &state.spin)
}
