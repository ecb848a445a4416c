//! Rounding errors of gaps and residuals, shared by solvers, step loop, verification and tests.
//!
//! A gap is computed from stored numbers: φ = n·(r + A(q) c) − d. With ε = 2⁻⁵², a stored
//! coordinate has a relative error of ½ε. An entry of A(q) is a sum of products of two stored
//! numbers and has an error of 4ε. The products with c and n and the sums add 3ε each. In terms of
//! the lengths |n_k r_k|,
//! |c| and |d|, the error of a gap is at most
//!
//! ```text
//! δφ ≤ 16 ε (|n·r| + |n·A c| + |d|)                                       (eq. 21)
//! ```
//!
//! Divided by h this is a speed. The velocities add their own last digits. The gyroscopic torque
//! has an error of ε ‖I‖ |ω|², which h I⁻¹ turns into a spin error; it is large for slender bodies.
//! The residual of an exact step is thus
//!
//! ```text
//! δu ≤ min(16 ε (L/h + V + h ‖I⁻¹‖ ‖I‖ |ω|² ℓ), 10⁻⁷ m/s h_s/h)            (eq. 22)
//! ```
//!
//! with L the largest distance from the origin plus the reach ℓ, V the largest speed, and the length h_s of the
//! whole step of an interval. Forces between heavy bodies that act
//! through a light one add the rounding of their sum. A force has a relative error of 4ε from its conversions
//! between impulse and force, so that the sums over all forces of a body, and their torques τ, add
//!
//! ```text
//! δu_f = 4 ε h (Σ|f|/m + ℓ ‖I⁻¹‖ Σ|τ|)                                   (eq. 22a)
//! ```
//!
//! The cap holds for the sum of both. It limits the
//! tolerance for scenes that are far from the origin and for very short steps. Doubles cannot
//! resolve a scene beyond it, and its steps count as not converged. In a short interval of a step, it is the same
//! error of position.

use super::ContactLoad;
use super::certificate::Claim;
use crate::joint::Joint;
use crate::mechanics::State;
use crate::world::World;
use nalgebra::Vector3;

/// Number of roundings of a length that a gap sums up.
const ROUNDINGS: f64 = 16.0;

/// Number of roundings of a force.
pub(crate) const FORCE_ROUNDINGS: f64 = 4.0;

/// Upper limit of the rounding tolerance of a residual of a whole step (m/s).
pub const LARGEST: f64 = 1e-7;

/// Rounding error of a gap (eq. 21) (m). The plane has the `normal` and the `offset`. The point is
/// at `arm` from a centre of mass at `position` (m).
#[inline]
pub fn gap(normal: &Vector3<f64>, position: &Vector3<f64>, offset: f64, arm: &Vector3<f64>) -> f64 {
    let position: f64 = normal.component_mul(position).iter().map(|term| term.abs()).sum();
    ROUNDINGS * f64::EPSILON * (position + offset.abs() + normal.dot(arm).abs())
}

/// Upper limit of the rounding tolerance of a residual in an interval of `world` (m/s).
pub fn largest(world: &World) -> f64 {
    LARGEST * (world.whole_step() / world.time_step()).max(1.0)
}

/// Bound on the residual of an exact step from `states` to `next` by rounding alone (eq. 22) (m/s).
pub fn residual(world: &World, states: &[State], next: &[State]) -> f64 {
    let h = world.time_step();
    let mut length = 0.0_f64;
    let mut speed = 0.0_f64;
    for ((body, state), next) in world.bodies().iter().zip(states).zip(next) {
        let reach = body.reach();
        length = length.max(state.position.norm().max(next.position.norm()) + reach);
        let slender = body.inertia_inverse().norm() * body.inertia().norm();
        let turning = h * slender * next.spin.norm_squared() * reach;
        speed = speed.max(next.velocity.amax() + next.spin.amax() * reach + turning);
    }
    let length = length + world.ground().map_or(0.0, |ground| ground.offset().abs());
    let lost = ROUNDINGS * f64::EPSILON * (length / h + speed);
    // This order caps a NaN as well.
    let largest = largest(world);
    if lost < largest { lost } else { largest }
}

/// Rounding error of a residual by the forces of the step `claim` with these `loads` of its contacts (eq. 22a)
/// (m/s). The claim fits `world`.
pub fn forces(
    world: &World,
    claim: &Claim<'_>,
    loads: impl IntoIterator<Item = impl Into<ContactLoad>>,
) -> f64 {
    let states = claim.states;
    // Σ|f| and Σ|τ| of each body.
    let mut sums = vec![(0.0, 0.0); states.len()];
    let mut add = |body: Option<usize>, force: f64, torque: f64| {
        if let Some((forces, torques)) = body.and_then(|body| sums.get_mut(body)) {
            *forces += force;
            *torques += torque;
        }
    };
    // Forces of contacts act on both bodies.
    for (contact, load) in claim.contacts.iter().zip(loads) {
        let ContactLoad { force, moment } = load.into();
        let place = states[contact.key.body].position + contact.arm;
        for body in contact.key.bodies() {
            let arm = (place - states[body].position).norm();
            add(Some(body), force.norm(), arm * force.norm() + moment.norm());
        }
    }
    // Forces of joints act at their anchors.
    let sides = |joint: &Joint| [Some(joint.body()), joint.other()];
    for (joint, load) in world.joints().iter().zip(claim.joints) {
        for (body, frame) in sides(joint).into_iter().zip(joint.frames()) {
            let force = load.force.norm();
            add(body, force, frame.anchor.norm() * force + load.torque.norm());
        }
    }
    // A gear acts along two axes, p and r p.
    for (gear, load) in world.gears().iter().zip(claim.gears) {
        for (axis, size) in gear.axes().iter().zip([*load, gear.ratio() * load]) {
            let joint = &world.joints()[axis.joint];
            let wrenches = joint.wrenches(states, axis.axis, size).into_iter().flatten();
            for (body, wrench) in sides(joint).into_iter().zip(wrenches) {
                add(body, wrench.force.norm(), wrench.torque.norm());
            }
        }
    }
    // (22a): δu_f = 4ε₀h max(Σ|f|/m + ℓ‖I⁻¹‖Σ|τ|).
    let speeds = world.bodies().iter().zip(&sums).map(|(body, (forces, torques))| {
        forces / body.mass() + body.reach() * body.inertia_inverse().norm() * torques
    });
    FORCE_ROUNDINGS * f64::EPSILON * world.time_step() * speeds.fold(0.0, f64::max)
}
