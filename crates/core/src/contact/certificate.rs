//! Certificate of a step: the residual of its states and contact forces in the equations of an
//! exact step, independent of their solver.
//!
//! Its value is a **residual** in m/s, with each contact in its own scale (eq. 18). It is zero
//! exactly at the solutions of the hard-contact step with Coulomb's cone and maximum dissipation.
//! It is *not* a distance to a solution: in an ill-conditioned problem a small residual can belong
//! to a state much farther from the solution. If the laws leave the motion open, it does not
//! identify the solution. Unlike a product such as f_n φ⁺, two small errors cannot make it small.
//!
//! This module is independent of the solvers. [`Simulation`](crate::simulation::Simulation)
//! certifies every step.

use super::{Contact, ContactLoad, Partner};
use crate::joint::{JointForce, JointMotion};
use crate::mechanics::dynamics::rk4_step;
use crate::mechanics::{Pose, RigidBody, State, Wrench, largest};
use crate::world::World;
use nalgebra::Vector3;

/// Parts of a step's residual (m/s): maxima over bodies, contacts and joints.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[non_exhaustive]
pub struct Certificate {
    /// Residual of the equations of motion (eq. 18a). Angles become lengths by the body's
    /// [reach](RigidBody::reach).
    pub dynamics: f64,
    /// max(0, −φ⁺/h): speed of the deepest penetration (eq. 18b).
    pub penetration: f64,
    /// Violation of complementarity: force without touch, or touch with a tensile force beyond the
    /// [adhesion](super::adhesion) (eq. 18c).
    pub normal_law: f64,
    /// Violation of maximum dissipation: sliding friction that does not fully oppose the slip, or
    /// static friction with slip (eq. 18d); the same of moments, with their limits (eq. 45).
    pub friction_law: f64,
    /// Friction outside the cone (eq. 18e).
    pub cone: f64,
    /// Velocity residual of the locked directions of joints (J7).
    pub joint: f64,
    /// Residual of the drives in the free directions of joints (J7).
    pub joint_law: f64,
}

/// Data of a step to be certified.
#[derive(Debug, Clone, Copy)]
pub struct Claim<'a> {
    /// X at step k, one entry per body.
    pub states: &'a [State],
    /// X at step k+1, one entry per body.
    pub next: &'a [State],
    /// External wrenches without gravity, one per body.
    pub wrenches: &'a [Wrench],
    /// Contacts between the bodies at step k.
    pub contacts: &'a [Contact],
    /// Forces of the joints, one per joint of the world.
    pub joints: &'a [JointForce],
    /// Forces of the gears (N or N m), one per gear of the world.
    pub gears: &'a [f64],
}

impl Claim<'_> {
    /// True if the lists match `world`: one state and wrench per body, only contacts of its bodies,
    /// and one force per joint and gear.
    pub(crate) fn is_of(&self, world: &World) -> bool {
        let bodies = world.bodies().len();
        let lengths = [self.states.len(), self.next.len(), self.wrenches.len()];
        let mut named = self.contacts.iter().flat_map(|contact| contact.key.bodies());
        lengths == [bodies; 3]
            && named.all(|body| body < bodies)
            && self.joints.len() == world.joints().len()
            && self.gears.len() == world.gears().len()
    }
}

impl Certificate {
    /// Certificate of an invalid claim: every part is NaN, which no tolerance accepts.
    const UNKNOWN: Self = Self {
        dynamics: f64::NAN,
        penetration: f64::NAN,
        normal_law: f64::NAN,
        friction_law: f64::NAN,
        cone: f64::NAN,
        joint: f64::NAN,
        joint_law: f64::NAN,
    };

    /// Elementwise maximum of two certificates; NaN if either part is.
    pub(crate) fn joined(&self, other: &Self) -> Self {
        Self {
            dynamics: largest(self.dynamics, other.dynamics),
            penetration: largest(self.penetration, other.penetration),
            normal_law: largest(self.normal_law, other.normal_law),
            friction_law: largest(self.friction_law, other.friction_law),
            cone: largest(self.cone, other.cone),
            joint: largest(self.joint, other.joint),
            joint_law: largest(self.joint_law, other.joint_law),
        }
    }

    /// Residual of the step: the largest part (m/s). NaN if any part is.
    pub fn residual(&self) -> f64 {
        self.parts().into_iter().map(|(_, value)| value).fold(0.0, largest)
    }

    /// Name of the largest part.
    pub fn worst_part(&self) -> &'static str {
        let residual = self.residual();
        self.parts()
            .into_iter()
            .find(|(_, value)| *value == residual || value.is_nan())
            .map_or("dynamics", |(name, _)| name)
    }

    /// Parts of motion and contacts, by name. These are all parts of a world without joints.
    pub fn contact_parts(&self) -> [(&'static str, f64); 5] {
        let [dynamics, penetration, normal, friction, cone, ..] = self.parts();
        [dynamics, penetration, normal, friction, cone]
    }

    /// Parts by name.
    pub fn parts(&self) -> [(&'static str, f64); 7] {
        [
            ("dynamics", self.dynamics),
            ("penetration", self.penetration),
            ("normal law", self.normal_law),
            ("friction law", self.friction_law),
            ("cone", self.cone),
            ("joint", self.joint),
            ("joint law", self.joint_law),
        ]
    }
}

/// Certifies steps of one world. It owns its workspace, so that certifying does not allocate. The
/// workspace changes no certificate.
#[derive(Debug, Clone, Default)]
pub struct Certifier {
    /// Poses of the bodies at both ends of the step.
    poses: Vec<(Pose, Pose)>,
    /// Sum of contact and external forces (world) and torques (body frame) on each body.
    loads: Vec<Wrench>,
    joint_motions: Vec<JointMotion>,
}

impl Certifier {
    /// A certifier for any world.
    pub fn new() -> Self {
        Self::default()
    }

    /// Certifies a contact step with the `loads` of the contacts (on body A), one per contact of the
    /// claim: forces (N, world), or forces and moments.
    ///
    /// Contacts without a load are skipped. Contact points without a contact must not end below
    /// the ground either. Every part is NaN if a list does not have one entry per body, or if a
    /// contact names a body that does not exist.
    pub fn contact_step(
        &mut self,
        world: &World,
        claim: &Claim<'_>,
        loads: impl IntoIterator<Item: Into<ContactLoad>>,
    ) -> Certificate {
        self.bodies_of_step(world, claim, loads, |_| true)
    }

    /// Same as [`Self::contact_step`] for the `asked` bodies, their contacts, and all joints. An asked body
    /// touches asked bodies only.
    pub(crate) fn bodies_of_step(
        &mut self,
        world: &World,
        claim: &Claim<'_>,
        loads: impl IntoIterator<Item: Into<ContactLoad>>,
        asked: impl Fn(usize) -> bool,
    ) -> Certificate {
        if !claim.is_of(world) {
            return Certificate::UNKNOWN;
        }
        self.begin(claim, &asked);
        let mut certificate = Certificate::default();
        for (contact, load) in claim.contacts.iter().zip(loads) {
            if asked(contact.key.body) {
                self.add_contact(world, claim, contact, &load.into(), &mut certificate);
            }
        }
        self.add_joints(world, claim, &mut certificate);
        let h = world.time_step();
        // (18a) under all loads. A held body keeps its state. Points without a contact count in (18b).
        for (index, (body, poses)) in world.bodies().iter().zip(&self.poses).enumerate() {
            if !asked(index) {
                continue;
            }
            let (state, next) = (&claim.states[index], &claim.next[index]);
            let motion = if world.is_held(index) {
                difference(body, state, next, h)
            } else {
                momentum_residual(world, body, state, next, &self.loads[index])
            };
            certificate.dynamics = largest(certificate.dynamics, motion);
            let depth = deepest_below(world, index, poses);
            certificate.penetration = largest(certificate.penetration, depth / h);
        }
        certificate
    }

    /// Joint motion in the last certified step.
    pub(crate) fn joint_motions(&self) -> &[JointMotion] {
        &self.joint_motions
    }

    /// Sets the poses of the `asked` bodies, and all loads.
    fn begin(&mut self, claim: &Claim<'_>, asked: impl Fn(usize) -> bool) {
        let pairs = claim.states.iter().zip(claim.next);
        if self.poses.len() == claim.states.len() {
            for (body, (poses, (state, next))) in self.poses.iter_mut().zip(pairs).enumerate() {
                if asked(body) {
                    *poses = (state.pose(), next.pose());
                }
            }
        } else {
            self.poses.clear();
            self.poses.extend(pairs.map(|(state, next)| (state.pose(), next.pose())));
        }
        claim.wrenches.clone_into(&mut self.loads);
    }

    /// Adds the load of a contact, and the parts of its law: (18b) to (18e), with moments (45).
    #[inline(always)]
    fn add_contact(
        &mut self,
        world: &World,
        claim: &Claim<'_>,
        contact: &Contact,
        load: &ContactLoad,
        certificate: &mut Certificate,
    ) {
        let ContactLoad { force, moment } = *load;
        self.add_force(contact, &force);
        // Motion u of the touching point: slip, and gap over h or rebound (29).
        let a = &self.poses[contact.key.body];
        let b = contact.key.partner.body().map(|index| &self.poses[index]);
        let u = contact.motion([&a.0, &a.1], b.map(|b| [&b.0, &b.1]), &world.step_map());
        let u = contact.law_motion(u, world, claim.states, claim.next);
        // Impulse per unit mass of A, the unit of the response. A friction axis scales both (46).
        let mut p = force * (world.time_step() / world.bodies()[contact.key.body].mass());
        let mut w = u;
        if let Some(tensor) = contact.friction_tensor(world, claim.states) {
            (p, w) = (tensor.scaled_impulse(&p), tensor.scaled_motion(&u));
        }
        let parts = contact.law.residual(&contact.response, &contact.normal(), &p, &w);
        certificate.normal_law = largest(certificate.normal_law, parts.normal);
        certificate.friction_law = largest(certificate.friction_law, parts.friction);
        certificate.cone = largest(certificate.cone, parts.cone);
        if world.has_turning_friction() || moment != Vector3::zeros() {
            let missed = self.add_moment(world, contact, load);
            certificate.friction_law = largest(certificate.friction_law, missed);
        }
        // (18b): the speed −u_n of the penetration.
        let through = -contact.normal().dot(&u);
        certificate.penetration = largest(certificate.penetration, through);
    }

    /// Adds the loads and the parts of joints (J7) and gears (J15).
    #[inline(always)]
    fn add_joints(&mut self, world: &World, claim: &Claim<'_>, certificate: &mut Certificate) {
        let map = world.step_map();
        self.joint_motions.clear();
        for (joint, force) in world.joints().iter().zip(claim.joints) {
            let joint_motion = joint.step_motion(claim.states, claim.next, force, &map);
            let parts = joint_motion.as_ref().and_then(|joint_motion| {
                joint_motion.add_loads(joint, claim.states, force, &mut self.loads);
                joint_motion.residual(joint, world.bodies(), claim.states, force, &map)
            });
            self.joint_motions.extend(joint_motion);
            let (locked, drive) = parts.map_or((f64::NAN, f64::NAN), |of| (of.locked, of.drive));
            certificate.joint = largest(certificate.joint, locked);
            certificate.joint_law = largest(certificate.joint_law, drive);
        }
        // A drive of a sum has the law of an axis.
        for (gear, force) in world.gears().iter().zip(claim.gears) {
            let joints = world.joints();
            for (joint, load) in gear.loads(*force, claim.joints) {
                joints[joint].add_loads(claim.states, &load, &map, &mut self.loads);
            }
            let missed = gear.residual(world, claim.states, claim.next, claim.joints, *force);
            let part = match gear.drive() {
                None => &mut certificate.joint,
                Some(_) => &mut certificate.joint_law,
            };
            *part = largest(*part, missed);
        }
    }

    /// Adds a contact force to A at the touching point, and its opposite to B at the same world
    /// point. The momentum of the pair is conserved.
    fn add_force(&mut self, contact: &Contact, force: &Vector3<f64>) {
        let load = &mut self.loads[contact.key.body];
        load.force += force;
        load.torque += contact.torque_map * force;
        if let Partner::Body(other) = contact.key.partner {
            let a = &self.poses[contact.key.body].0;
            let b = &self.poses[other].0;
            let arm = a.position + contact.arm - b.position;
            let load = &mut self.loads[other];
            load.force -= force;
            load.torque -= b.rotation.tr_mul(&arm.cross(force));
        }
    }

    /// Adds a contact's moment to both bodies. Returns its residual (m/s).
    fn add_moment(&mut self, world: &World, contact: &Contact, load: &ContactLoad) -> f64 {
        let own = contact.key.body;
        let other = contact.key.partner.body();
        let a = &self.poses[own];
        let b = other.map(|other| &self.poses[other]);
        let map = world.step_map();
        let turned = contact.relative_turning([&a.0, &a.1], b.map(|b| [&b.0, &b.1]), &map);
        let b = b.map(|b| &b.0);
        let (on_a, on_b) = Contact::moment_torques(&load.moment, &a.0, b);
        let missed = contact.moment_residual(world, &a.0, b, load, &turned);
        self.loads[own].torque += on_a;
        other.into_iter().for_each(|other| self.loads[other].torque += on_b);
        missed
    }
}

/// Certifies a step of the fourth-order Runge–Kutta method, which has no contacts.
///
/// The residual is the difference between the next states and the method's own step under the
/// wrenches of the claim and gravity, scaled like the dynamics part of a contact step. It checks
/// that a file holds the result of the method. The accuracy of the method is tested with
/// [`rk4_step`]. Every part is NaN if a list does not have one entry per body.
pub fn certify_rk4_step(world: &World, claim: &Claim<'_>) -> Certificate {
    let h = world.time_step();
    let mut certificate = Certificate::default();
    if !claim.is_of(world) {
        return Certificate::UNKNOWN;
    }
    for (index, body) in world.bodies().iter().enumerate() {
        let (state, next) = (&claim.states[index], &claim.next[index]);
        let mut wrench = claim.wrenches[index];
        wrench.force += world.gravity() * body.mass();
        let motion = if world.is_held(index) {
            difference(body, state, next, h)
        } else {
            difference(body, &rk4_step(body, state, &wrench, h), next, h)
        };
        certificate.dynamics = largest(certificate.dynamics, motion);
    }
    certificate
}

/// Depth of the deepest contact point of a body below the ground at the end of a problem, beyond what it
/// [leaves](World::removed_share) of a depth (m).
#[inline]
fn deepest_below(world: &World, index: usize, (start, end): &(Pose, Pose)) -> f64 {
    let left = 1.0 - world.removed_share();
    if left == 0.0 {
        return world.heights(index, end).map(|height| -height).fold(0.0, largest);
    }
    let pairs = world.heights(index, start).zip(world.heights(index, end));
    pairs.map(|(before, after)| left * before.min(0.0) - after).fold(0.0, largest)
}

/// Difference of two states of a body (m/s). Lengths are divided by the time step.
fn difference(body: &RigidBody, exact: &State, next: &State, h: f64) -> f64 {
    let reach = body.reach();
    let parts = [
        norm_inf(&(exact.position - next.position)) / h,
        norm_inf(&(exact.attitude - next.attitude)) * reach / h,
        norm_inf(&(exact.velocity - next.velocity)),
        norm_inf(&(exact.spin - next.spin)) * reach,
    ];
    parts.into_iter().fold(0.0, largest)
}

/// Largest residual of the four equations of motion of a body (eq. 8) (m/s). `load` is the total
/// load without gravity.
fn momentum_residual(
    world: &World,
    body: &RigidBody,
    state: &State,
    next: &State,
    load: &Wrench,
) -> f64 {
    let h = world.time_step();
    let gyroscopic = world.rotation().gyroscopic(body.inertia(), &state.spin, &next.spin, h);
    let position = next.position - state.position - h * next.velocity;
    let attitude = next.attitude - world.step_map().advance(&state.attitude, &next.spin);
    let acceleration = load.force / body.mass() + world.gravity();
    let velocity = next.velocity - state.velocity - h * acceleration;
    let spin = next.spin - state.spin - h * (body.inertia_inverse() * (load.torque - gyroscopic));
    [
        norm_inf(&position) / h,
        norm_inf(&attitude) * body.reach() / h,
        norm_inf(&velocity),
        norm_inf(&spin) * body.reach(),
    ]
    .into_iter()
    .fold(0.0, largest)
}

/// ‖a‖∞, NaN if any entry is.
fn norm_inf<'a>(entries: impl IntoIterator<Item = &'a f64>) -> f64 {
    entries.into_iter().map(|entry| entry.abs()).fold(0.0, largest)
}
