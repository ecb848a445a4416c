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
//! δu ≤ min(16 ε (L/h + V + h ‖I⁻¹‖ ‖I‖ |ω|² ℓ), 10⁻⁷ m/s)                (eq. 22)
//! ```
//!
//! with L the largest coordinate plus the reach ℓ, and V the largest speed. The cap limits the
//! tolerance for scenes that are far from the origin and for very short steps. Doubles cannot
//! resolve a scene beyond it, and its steps count as not converged.

use crate::mechanics::State;
use crate::world::World;
use nalgebra::Vector3;

/// Number of roundings of a length that a gap sums up.
const ROUNDINGS: f64 = 16.0;

/// Upper limit of the rounding tolerance of a residual (m/s).
pub const LARGEST: f64 = 1e-7;

/// Rounding error of a gap (eq. 21) (m). The plane has the `normal` and the `offset`. The point is
/// at `arm` from a centre of mass at `position` (m).
#[inline]
pub fn gap(normal: &Vector3<f64>, position: &Vector3<f64>, offset: f64, arm: &Vector3<f64>) -> f64 {
    let position: f64 = normal.component_mul(position).iter().map(|term| term.abs()).sum();
    ROUNDINGS * f64::EPSILON * (position + offset.abs() + normal.dot(arm).abs())
}

/// Bound on the residual of an exact step from `states` to `next` by rounding alone (eq. 22) (m/s).
pub fn residual(world: &World, states: &[State], next: &[State]) -> f64 {
    let h = world.time_step();
    let mut length = 0.0_f64;
    let mut speed = 0.0_f64;
    for ((body, state), next) in world.bodies().iter().zip(states).zip(next) {
        let reach = body.reach();
        length = length.max(state.position.amax().max(next.position.amax()) + reach);
        let slender = body.inertia_inverse().norm() * body.inertia().norm();
        let turning = h * slender * next.spin.norm_squared() * reach;
        speed = speed.max(next.velocity.amax() + next.spin.amax() * reach + turning);
    }
    let length = length + world.ground().map_or(0.0, |ground| ground.offset().abs());
    let lost = ROUNDINGS * f64::EPSILON * (length / h + speed);
    // This order caps a NaN as well.
    if lost < LARGEST { lost } else { LARGEST }
}
