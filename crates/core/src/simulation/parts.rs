//! Fallbacks for a step that the native solver did not solve, or whose solution makes energy (eq. 32):
//! shorter steps, or a motion that adds no energy.
//!
//! The world takes 2, 4, … 64 steps of h/n until each of them is solved and they make no energy
//! together, unless a body is [squeezed](super::infeasible_gap): no step has a solution then. Bodies of these
//! islands take the end state of these steps; others keep their solution. Shorter steps keep the depth
//! at which their contacts begin: they would remove it with n times the speed. Velocities that depend
//! on the time step are converted before and after. The spin keeps its momentum P⁻ (eq. 34), and the
//! velocity of flying bodies changes by ½ (h − h/n) g. Contacts and joints get the mean force of
//! the shorter steps. The residual is the one of these forces in a single step, and is not small.
//!
//! A point near the solution that adds no energy is kept, and the step is failed. If the shorter
//! steps are not solved either, islands that add no energy keep the best point of the solver. Other
//! islands that touch the ground or a fixed piece stand still. The rest move on as one rigid body
//! with their momentum P and angular momentum L:
//!
//! ```text
//! v = P/m + h g,   ω = I⁻¹ L
//! ```
//!
//! A rigid motion has the least kinetic energy for given P and L.

use super::islands::Islands;
use super::unphysical::{Budget, EnergyGain, UnphysicalCause};
use super::{Motion, Simulation, StepRecord, StepScratch, unphysical};
use crate::contact::certificate::Claim;
use crate::contact::{Candidates, Certificate, ContactKey};
use crate::joint::JointForce;
use crate::mechanics::quaternion::{product, rotation};
use crate::mechanics::{RigidBody, Rotation, State};
use crate::step::{ContactForce, StepReport, StepSolution, StepStatus};
use crate::world::{Integrator, World};
use nalgebra::{Matrix3, Vector3, Vector4};

/// Residual, as a multiple of the accepted one, below which the best point is kept. Shorter steps
/// are less accurate, because they fall by a further ½ h² g.
const NEAR: f64 = 1e3;

/// Largest number of shorter steps.
const MOST_PARTS: u64 = 64;

/// Largest number of Newton steps for the spin. The map is nearly linear.
const MOST_NEWTON: u32 = 20;

/// Report and certificate of a step.
type Rescued = (StepReport, Certificate);

impl Simulation<'_> {
    /// Replaces a step that failed or makes energy by shorter ones or by a motion without added
    /// energy. Bodies whose motion is replaced are appended to `unsolved_bodies`. Returns `None` if
    /// the step is kept: for other solvers, and near the solution. The interrupt flag is not checked
    /// here, because an external solver could not repeat its part with the same bits.
    pub(super) fn rescued(
        &mut self,
        (report, certificate): Rescued,
        unsolved_bodies: &mut Vec<usize>,
    ) -> Option<Rescued> {
        let bodies = self.now.states.len();
        let has_failed = report.status == StepStatus::Failed;
        let Motion::Contact { solver, .. } = &mut self.motion else { return None };
        let is_near = certificate.residual() <= NEAR * solver.accepted_residual();
        // Steps of other solvers are kept.
        let solver = solver.islands()?;
        // The certificate can reject a step that the solver considers solved.
        let all_are = (0..bodies).all(|body| solver.is_solved(body));
        let mut unsolved: Vec<bool> =
            (0..bodies).map(|body| has_failed && (all_are || !solver.is_solved(body))).collect();
        if has_failed {
            self.count_energy();
        }
        let energy_check = &self.scratch.energy_check;
        for (body, unsolved) in unsolved.iter_mut().enumerate() {
            *unsolved |= energy_check.makes(body);
        }
        unsolved_bodies.extend((0..bodies).filter(|body| unsolved[*body]));
        if is_near && !(0..bodies).any(|body| unsolved[body] && energy_check.gains(body)) {
            return None;
        }
        self.scratch.gain = None;
        let mut report = report;
        // Where a body is squeezed, no shorter steps lead to the end of the step either.
        let mut parts = if self.scratch.infeasible_gap.is_some() { MOST_PARTS + 1 } else { 2 };
        let mut is_taken = false;
        while parts <= MOST_PARTS && !is_taken {
            is_taken = self.in_parts(parts, &unsolved).is_some();
            parts *= 2;
        }
        if is_taken {
            report.status = StepStatus::Substepped;
            (self.scratch.infeasible_gap, self.scratch.unphysical) = (None, None);
        } else {
            report.status = StepStatus::Failed;
            let makes = |gain: &EnergyGain| self.scratch.energy_check.makes(gain.body);
            let cause = self.scratch.energy_check.largest_gain().filter(makes);
            self.scratch.unphysical =
                cause.map(|EnergyGain { body, energy }| UnphysicalCause::Gain { body, energy });
            self.hold_energy(&unsolved);
        }
        self.scratch.rest.end();
        Some((report, self.certify()))
    }

    /// Takes the step in `parts` shorter ones. The states and forces of the `unsolved` bodies are
    /// left in the solution of the scratch memory. Returns `None` if a shorter step is not solved, or
    /// if they make energy together.
    fn in_parts(&mut self, parts: u64, unsolved: &[bool]) -> Option<()> {
        let mut parameters = self.world.parameters().clone();
        parameters.time_step /= parts as f64;
        // The shorter steps begin and end with velocities of the middle.
        let world = self.world.with_parameters(parameters).ok()?.with_integrator(Integrator::Euler);
        let flies: Vec<bool> = self.standing().into_iter().map(|stands| !stands).collect();
        let exchanged = |states: &[State], from: &World, to: &World| -> Option<Vec<State>> {
            let bodies = from.bodies().iter().zip(states).zip(&flies);
            let of = |((body, state), flies): ((&RigidBody, &State), &bool)| {
                same_momentum(body, state, *flies, from, to)
            };
            bodies.map(of).collect()
        };
        let states = exchanged(&self.now.states, &self.world, &world)?;
        let motion = Motion::native(&world);
        let mut short = Simulation::at(world, &states, motion, Candidates::keeping_depth()).ok()?;
        short.index = self.index.saturating_mul(parts);
        short.outside.clone_from(&self.outside);
        short.driving.clone_from(&self.driving);
        short.now.joints.clone_from(&self.now.joints);
        short.is_part = true;
        let mut record = StepRecord::new();
        let mut mean = MeanForces::new(&self.world);
        let mut energy = Budget::default();
        for _ in 0..parts {
            short.step(&mut record).ok()?;
            if !record.report.status.is_solved() {
                return None;
            }
            mean.add(&record.solution, 1.0 / parts as f64);
            if record.report.status != StepStatus::Free {
                energy.add(&short.scratch.energy_check.sum(unsolved));
            }
        }
        if energy.is_made() {
            return None;
        }
        let mut ends = exchanged(&short.now.states, &short.world, &self.world)?;
        let stands = |body: &usize| unsolved[*body] && !flies[*body] && !self.world.is_held(*body);
        let standing: Vec<_> = (0..unsolved.len()).filter(stands).collect();
        energy.gained = self.slow_standing(&mut ends, &standing, parts, energy.gained.max(0.0));
        let body = unsolved.iter().position(|unsolved| *unsolved).unwrap_or(0);
        self.scratch.gain = energy.gains().then_some(EnergyGain { body, energy: energy.gained });
        let StepScratch { solution, .. } = &mut self.scratch;
        for (body, end) in ends.into_iter().enumerate().filter(|(body, _)| unsolved[*body]) {
            solution.states[body] = end;
        }
        for force in solution.contacts.iter_mut().filter(|force| unsolved[force.key.body]) {
            force.force = mean.force(force);
        }
        for (moment, force) in solution.moments.iter_mut().zip(&solution.contacts) {
            if unsolved[force.key.body] {
                *moment = mean.moment(force);
            }
        }
        for (index, joint) in self.world.joints().iter().enumerate() {
            if unsolved[joint.body()] {
                let JointForce { force, torque, .. } = mean.joints[index];
                let angles = short.now.joints[index].angles;
                solution.joints[index] = JointForce { force, torque, angles };
            }
        }
        for (index, gear) in self.world.gears().iter().enumerate() {
            if unsolved[self.world.joints()[gear.axes()[0].joint].body()] {
                solution.gears[index] = mean.gears[index];
            }
        }
        Some(())
    }

    /// Slows the standing `bodies` down at the `ends` of the `parts`, alike, so that they gain no
    /// energy. Besides the `made` energy of the parts (J) they gain, because they keep their
    /// velocities in spite of the other time step (35),
    ///
    /// ```text
    /// Σ ½ m (h − h/n) g·(v⁺ − v)
    /// ```
    ///
    /// Returns the energy that is left: bodies that are at rest at the end may be higher (J).
    fn slow_standing(&self, ends: &mut [State], bodies: &[usize], parts: u64, made: f64) -> f64 {
        let (world, h) = (&self.world, self.world.time_step());
        let (mut gained, mut kinetic, mut lag) = (made, 0.0, 0.0);
        for &index in bodies {
            let (body, end) = (&world.bodies()[index], &ends[index]);
            let fall = world.gravity() * (0.5 * h * body.mass());
            let faster = end.velocity - self.now.states[index].velocity;
            gained += fall.dot(&faster) * (1.0 - 1.0 / parts as f64);
            kinetic += unphysical::kinetic_energy(world, body, end);
            lag += fall.dot(&end.velocity);
        }
        if gained > 0.0 && kinetic > 0.0 {
            // Energy (35) at s times the velocities: s² T + s Σ ½ m h g·v.
            let root = (lag * lag + 4.0 * kinetic * (kinetic + lag - gained)).max(0.0).sqrt();
            let slower = ((root - lag) / (2.0 * kinetic)).clamp(0.0, 1.0);
            for &index in bodies {
                ends[index].velocity *= slower;
                ends[index].spin *= slower;
            }
            gained -= (1.0 - slower) * ((1.0 + slower) * kinetic + lag);
        }
        gained.max(0.0)
    }

    /// True per body if its island touches the ground or a fixed piece, or has a held body.
    fn standing(&self) -> Vec<bool> {
        let Self { world, now, scratch, .. } = self;
        let (contacts, bodies) = (scratch.candidates.contacts(), now.states.len());
        let islands = self.islands();
        let mut stands = vec![false; bodies];
        for body in (0..bodies).filter(|body| world.is_held(*body)) {
            stands[islands.label(body)] = true;
        }
        for contact in contacts {
            stands[islands.label(contact.key.body)] |= contact.key.partner.body().is_none();
        }
        for joint in world.joints() {
            stands[islands.label(joint.body())] |= joint.other().is_none();
        }
        (0..bodies).map(|body| stands[islands.label(body)]).collect()
    }

    fn islands(&self) -> Islands {
        let mut islands = Islands::default();
        let keys = self.scratch.candidates.contacts().iter().map(|contact| &contact.key);
        islands.find(self.now.states.len(), keys, &self.world);
        islands
    }

    /// Counts the energy that the islands make in the solution of the scratch memory.
    fn count_energy(&mut self) {
        let Self { world, now, scratch, .. } = self;
        let StepScratch { candidates, solution, wrenches, energy_check, certifier, .. } = scratch;
        let claim = Claim {
            states: &now.states,
            next: &solution.states,
            wrenches,
            contacts: candidates.contacts(),
            joints: &solution.joints,
            gears: &solution.gears,
        };
        certifier.contact_step(world, &claim, solution.loads());
        energy_check.count(world, &claim, certifier.joint_motions(), solution.forces(), 0.0);
    }

    /// Replaces the motion of islands with `unsolved` bodies that add energy by one that does not.
    fn hold_energy(&mut self, unsolved: &[bool]) {
        let (islands, standing) = (self.islands(), self.standing());
        let Self { world, now, scratch, .. } = self;
        let StepScratch { energy_check, solution, .. } = scratch;
        let bodies = now.states.len();
        for (label, &stands) in standing.iter().enumerate() {
            let members: Vec<_> =
                (0..bodies).filter(|body| islands.label(*body) == label).collect();
            if !members.iter().any(|body| unsolved[*body] && energy_check.gains(*body)) {
                continue;
            }
            let motion = if stands {
                None
            } else {
                Some(RigidMotion::from_members(world, &now.states, &members))
            };
            for &body in &members {
                let state = &now.states[body];
                solution.states[body] = match &motion {
                    Some(motion) => motion.moved(world, state),
                    None => State { velocity: Vector3::zeros(), spin: Vector3::zeros(), ..*state },
                };
            }
            let is_member = |body: usize| islands.label(body) == label;
            for (place, force) in solution.contacts.iter_mut().enumerate() {
                if is_member(force.key.body) {
                    *force = ContactForce::none(force.key);
                    solution
                        .moments
                        .get_mut(place)
                        .into_iter()
                        .for_each(|of| *of = Vector3::zeros());
                }
            }
            for (index, joint) in world.joints().iter().enumerate() {
                if is_member(joint.body()) {
                    solution.joints[index] = JointForce::none(now.joints[index].angles);
                }
            }
            for (index, gear) in world.gears().iter().enumerate() {
                if is_member(world.joints()[gear.axes()[0].joint].body()) {
                    solution.gears[index] = 0.0;
                }
            }
        }
    }

    /// Computes the slips and the certificate of the solution in the scratch memory.
    fn certify(&mut self) -> Certificate {
        let Self { world, now, scratch, .. } = self;
        let StepScratch { candidates, solution, wrenches, certifier, .. } = scratch;
        let contacts = candidates.contacts();
        for (force, contact) in solution.contacts.iter_mut().zip(contacts) {
            force.normal_force = contact.normal().dot(&force.force);
            force.slip = contact.slip(world, &now.states, &solution.states);
        }
        let (joints, gears) = (&solution.joints, &solution.gears);
        let (states, next) = (&now.states, &solution.states);
        let claim = Claim { states, next, wrenches, contacts, joints, gears };
        certifier.contact_step(world, &claim, solution.loads())
    }
}

/// Mean forces of the shorter steps.
struct MeanForces {
    contacts: Vec<ContactForce>,
    moments: Vec<(ContactKey, Vector3<f64>)>,
    joints: Vec<JointForce>,
    gears: Vec<f64>,
}

impl MeanForces {
    fn new(world: &World) -> Self {
        let joints = vec![JointForce::none(Vector3::zeros()); world.joints().len()];
        Self {
            contacts: Vec::new(),
            moments: Vec::new(),
            joints,
            gears: vec![0.0; world.gears().len()],
        }
    }

    fn add(&mut self, part: &StepSolution, share: f64) {
        let pressing = part.contacts.iter().filter(|contact| contact.carries_force());
        self.contacts.extend(pressing.map(|contact| {
            let force = share * contact.force;
            ContactForce { force, ..*contact }
        }));
        let moments = part.contacts.iter().zip(&part.moments);
        self.moments.extend(moments.map(|(contact, moment)| (contact.key, share * moment)));
        for (mean, joint) in self.joints.iter_mut().zip(&part.joints) {
            mean.force += share * joint.force;
            mean.torque += share * joint.torque;
        }
        for (mean, gear) in self.gears.iter_mut().zip(&part.gears) {
            *mean += share * gear;
        }
    }

    fn force(&self, of: &ContactForce) -> Vector3<f64> {
        self.contacts.iter().filter(|part| part.key == of.key).map(|part| part.force).sum()
    }

    fn moment(&self, of: &ContactForce) -> Vector3<f64> {
        let parts = self.moments.iter().filter(|(key, _)| *key == of.key);
        parts.map(|(_, moment)| *moment).sum()
    }
}

/// Converts `state` from the time step of `from` to the one of `to`. The spin keeps its momentum. A
/// body that `flies` gets the velocity of the same fall per step, since velocities lag half a step
/// (eq. 35). Returns `None` if no spin has this momentum, as for many radians per step.
fn same_momentum(
    body: &RigidBody,
    state: &State,
    flies: bool,
    from: &World,
    to: &World,
) -> Option<State> {
    let (form, inertia, h) = (from.rotation(), body.inertia(), to.time_step());
    let mut velocity = state.velocity;
    if flies && form == Rotation::Momentum {
        velocity += 0.5 * (from.time_step() - h) * from.gravity();
    }
    let wanted = form.momentum(inertia, &state.spin, from.time_step());
    let mut spin = state.spin;
    for _ in 0..MOST_NEWTON {
        let off = form.momentum(inertia, &spin, h) - wanted;
        if off.norm() <= 8.0 * f64::EPSILON * wanted.norm() {
            return Some(State { velocity, spin, ..*state });
        }
        spin -= form.momentum_slope(inertia, &spin, h).try_inverse()? * off;
    }
    None
}

/// Rigid motion of a group of bodies.
struct RigidMotion {
    centre: Vector3<f64>,
    velocity: Vector3<f64>,
    /// Angular velocity, world frame.
    spin: Vector3<f64>,
}

impl RigidMotion {
    /// Rigid motion with the linear and angular momentum of the group.
    fn from_members(world: &World, states: &[State], members: &[usize]) -> Self {
        let of = |body: usize| (&world.bodies()[body], &states[body]);
        let mass: f64 = members.iter().map(|body| of(*body).0.mass()).sum();
        let weighted = |vector: fn(&State) -> Vector3<f64>| -> Vector3<f64> {
            let parts = members.iter().map(|body| of(*body));
            parts.map(|(body, state)| body.mass() * vector(state)).sum::<Vector3<f64>>() / mass
        };
        let (centre, velocity) =
            (weighted(|state| state.position), weighted(|state| state.velocity));
        let (mut inertia, mut momentum) = (Matrix3::zeros(), Vector3::zeros());
        for (body, state) in members.iter().map(|body| of(*body)) {
            let turn = rotation(&state.attitude);
            let arm = state.position - centre;
            let own = turn * body.inertia() * turn.transpose();
            inertia += own
                + body.mass() * (arm.norm_squared() * Matrix3::identity() - arm * arm.transpose());
            let about = world.rotation().momentum(body.inertia(), &state.spin, world.time_step());
            momentum += turn * about + body.mass() * arm.cross(&(state.velocity - velocity));
        }
        let spin = inertia.try_inverse().map_or(Vector3::zeros(), |inverse| inverse * momentum);
        Self { centre, velocity: velocity + world.gravity() * world.time_step(), spin }
    }

    /// State of a body of the group after the step.
    fn moved(&self, world: &World, state: &State) -> State {
        let h = world.time_step();
        let angle = h * self.spin.norm();
        let arm = state.position - self.centre;
        let (sine, cosine) = libm::sincos(0.5 * angle);
        let axis = if angle > 0.0 { self.spin / self.spin.norm() } else { Vector3::zeros() };
        let turn = Vector4::new(cosine, sine * axis[0], sine * axis[1], sine * axis[2]);
        let attitude = product(&turn, &state.attitude).normalize();
        let arm = rotation(&turn) * arm;
        State {
            position: self.centre + h * self.velocity + arm,
            attitude,
            velocity: self.velocity + self.spin.cross(&arm),
            spin: rotation(&attitude).transpose() * self.spin,
        }
    }
}
