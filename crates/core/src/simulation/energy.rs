//! Energy of a state: the quantity that steps conserve.
//!
//! A step moves its body with the velocities at its end. Stored velocities therefore lag half a
//! step behind. Free motion conserves the energy at the state's time, between the impulses of two
//! steps. That energy has v + ½ h g for translation and the momentum P⁻(ω) ([`Rotation::momentum`])
//! for rotation. The constant ⅛ m h² |g|² is dropped, so that a body at rest has no kinetic energy:
//!
//! ```text
//! T = ½ m (v·v + h g·v) + ½ P⁻·I⁻¹ P⁻,   V = −m g·r                       (eq. 35)
//! ```
//!
//! In free flight, T + V is constant to rounding for translation (eq. 30) and free of drift for
//! rotation. T of a body that starts to fall can be negative, by up to the dropped constant.
//!
//! With [`Rotation::Tutorial`], T = ½ m v·v + ½ ω·I ω in the stored velocities. It decreases at
//! first order in h.

use crate::mechanics::{RigidBody, Rotation, State};
use crate::world::World;
use nalgebra::Vector3;

/// Kinetic energy T of a body of `world` (J) (eq. 35).
pub fn kinetic(world: &World, body: &RigidBody, state: &State) -> f64 {
    let velocity = &state.velocity;
    let along = match world.rotation() {
        Rotation::Tutorial => velocity.norm_squared(),
        Rotation::Momentum => velocity.dot(&(velocity + world.gravity() * world.time_step())),
    };
    0.5 * body.mass() * along + turning(world, body, &state.spin)
}

/// Rotational kinetic energy at the spin ω (rad/s, body frame) (J).
#[inline]
pub fn turning(world: &World, body: &RigidBody, spin: &Vector3<f64>) -> f64 {
    turning_after(world, body, spin, world.time_step())
}

/// Rotational kinetic energy at the spin ω of an interval of this `length` (s) (J).
#[inline]
fn turning_after(world: &World, body: &RigidBody, spin: &Vector3<f64>, length: f64) -> f64 {
    match world.rotation() {
        Rotation::Tutorial => 0.5 * spin.dot(&(body.inertia() * spin)),
        rotation => {
            let momentum = rotation.momentum(body.inertia(), spin, length);
            0.5 * momentum.dot(&(body.inertia_inverse() * momentum))
        }
    }
}

/// Potential energy V of a body, zero at the world origin (J) (eq. 35).
pub fn potential(world: &World, body: &RigidBody, state: &State) -> f64 {
    -body.mass() * world.gravity().dot(&state.position)
}

/// Total energy T + V of all bodies in `states` (J).
pub fn total(world: &World, states: &[State]) -> f64 {
    let bodies = world.bodies().iter().zip(states);
    bodies.map(|(body, x)| kinetic(world, body, x) + potential(world, body, x)).sum()
}

/// Total energy of all bodies in `states` at the start of the problem set in `world` (J): (35) with the
/// length h₁ of the interval [before](World::before) of each body.
pub fn at_start(world: &World, states: &[State]) -> f64 {
    if world.before().is_empty() {
        return total(world, states);
    }
    let bodies = world.bodies().iter().zip(states).zip(world.before());
    let of_body = |((body, state), before): ((&RigidBody, &State), &f64)| {
        let shorter = before - world.time_step();
        let (falls, spins) = match world.rotation() {
            Rotation::Tutorial => (0.0, 0.0),
            Rotation::Momentum => (
                0.5 * body.mass() * shorter * world.gravity().dot(&state.velocity),
                turning_after(world, body, &state.spin, *before)
                    - turning(world, body, &state.spin),
            ),
        };
        kinetic(world, body, state) + falls + spins + potential(world, body, state)
    };
    bodies.map(of_body).sum()
}

/// Total energy of all bodies at one time (J), with the velocities and spins of this time:
///
/// ```text
/// Σ ½ m v·v + ½ ω·I ω − m g·r
/// ```
pub fn at_instant(world: &World, states: &[State]) -> f64 {
    let bodies = world.bodies().iter().zip(states);
    bodies.map(|(body, state)| body_at_instant(world, body, state)).sum()
}

/// Term of a body in [`at_instant`] (J).
pub(super) fn body_at_instant(world: &World, body: &RigidBody, state: &State) -> f64 {
    let turning = state.spin.dot(&(body.inertia() * state.spin));
    0.5 * (body.mass() * state.velocity.norm_squared() + turning) + potential(world, body, state)
}
