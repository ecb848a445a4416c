//! What doubles can tell, in one place for solvers, loop, verification and tests.
//!
//! A gap is computed from stored numbers, φ = n·(r + A(q) c) − d. With ε = 2⁻⁵², each stored
//! coordinate is known to ½ε of itself; an entry of A(q) is a sum of products of two stored
//! numbers each and is known to 4ε; the products with c, with n and the sums add 3ε each. Of
//! every length that enters, |n_k r_k|, |c| and |d|, no more than
//!
//! ```text
//! δφ ≤ 16 ε (|n·r| + |n·A c| + |d|)                                       (eq. 21)
//! ```
//!
//! is lost. Divided by h it is a speed, and the velocities' own last digits come to it, and those of the
//! gyroscopic torque: it is known to ε ‖I‖ |ω|², of which h I⁻¹ makes a spin, and of slender bodies that is
//! much,
//!
//! ```text
//! δu ≤ min(16 ε (L/h + V + h ‖I⁻¹‖ ‖I‖ |ω|² ℓ), 10⁻⁷ m/s)                (eq. 22)
//! ```
//!
//! with L the largest coordinate plus the reach ℓ, V the largest speed. The cap keeps a step that
//! is far away or very short from excusing what is no rounding any more: beyond it, doubles do
//! not hold the scene, and its steps are called failed.

use crate::mechanics::State;
use crate::world::World;
use nalgebra::Vector3;

/// How many roundings of a length a gap is a sum of.
const ROUNDINGS: f64 = 16.0;

/// No residual above this is ever called rounding, m/s.
pub const LARGEST: f64 = 1e-7;

/// What is lost of a gap (eq. 21), m, whose plane has the `normal` and the `offset` and whose
/// point is `arm` from a centre of mass at `position` (m).
#[must_use]
#[inline]
pub fn gap(normal: &Vector3<f64>, position: &Vector3<f64>, offset: f64, arm: &Vector3<f64>) -> f64 {
    let position: f64 = normal.component_mul(position).iter().map(|term| term.abs()).sum();
    ROUNDINGS * f64::EPSILON * (position + offset.abs() + normal.dot(arm).abs())
}

/// What rounding alone may make of the residual of an exact step from `states` to `next` (eq.
/// 22), m/s.
#[must_use]
pub fn residual(world: &World, states: &[State], next: &[State]) -> f64 {
    let (h, mut length, mut speed) = (world.time_step(), 0.0_f64, 0.0_f64);
    for ((body, state), next) in world.bodies().iter().zip(states).zip(next) {
        let reach = body.reach();
        length = length.max(state.position.amax().max(next.position.amax()) + reach);
        let slender = body.inertia_inverse().norm() * body.inertia().norm();
        let turning = h * slender * next.spin.norm_squared() * reach;
        speed = speed.max(next.velocity.amax() + next.spin.amax() * reach + turning);
    }
    let length = length + world.ground().map_or(0.0, |ground| ground.offset().abs());
    let lost = ROUNDINGS * f64::EPSILON * (length / h + speed);
    // In this order a NaN is capped as well.
    if lost < LARGEST { lost } else { LARGEST }
}
