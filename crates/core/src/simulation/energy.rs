//! The energy of a state: that which the steps of its world keep.
//!
//! A step moves its body with the velocities of its end, so that stored velocities are those of the
//! step before and half a step behind. What free motion keeps is the energy at the state's time,
//! between the impulses of two steps: with v + ½ h g of the motion along, and with the momentum
//! P⁻(ω) ([`Rotation::momentum`]) of the turning. But for ⅛ m h² |g|², which is constant and left out,
//! so that rest has no kinetic energy, it is
//!
//! ```text
//! T = ½ m (v·v + h g·v) + ½ P⁻·I⁻¹ P⁻,   V = −m g·r                       (eq. 35)
//! ```
//!
//! with T + V of a flight constant to rounding along (eq. 30) and without a trend in turning. A body
//! that only begins to fall may have a T below zero, by up to the constant.
//!
//! In worlds of [`Rotation::Tutorial`] it is the energy of the numbers as they stand,
//! T = ½ m v·v + ½ ω·I ω, which falls to first order in h.

use crate::mechanics::{RigidBody, Rotation, State};
use crate::world::World;
use nalgebra::Vector3;

/// The kinetic energy T of a body of `world`, J (eq. 35).
#[must_use]
pub fn kinetic(world: &World, body: &RigidBody, state: &State) -> f64 {
    let velocity = &state.velocity;
    let along = match world.rotation() {
        Rotation::Tutorial => velocity.norm_squared(),
        Rotation::Momentum => velocity.dot(&(velocity + world.gravity() * world.time_step())),
    };
    0.5 * body.mass() * along + turning(world, body, &state.spin)
}

/// The part of the kinetic energy that is in turning with the spin ω (rad/s, body), J.
#[must_use]
#[inline]
pub fn turning(world: &World, body: &RigidBody, spin: &Vector3<f64>) -> f64 {
    match world.rotation() {
        Rotation::Tutorial => 0.5 * spin.dot(&(body.inertia() * spin)),
        rotation => {
            let momentum = rotation.momentum(body.inertia(), spin, world.time_step());
            0.5 * momentum.dot(&(body.inertia_inverse() * momentum))
        }
    }
}

/// The energy V of a body in gravity, counted from the world's origin, J (eq. 35).
#[must_use]
pub fn potential(world: &World, body: &RigidBody, state: &State) -> f64 {
    -body.mass() * world.gravity().dot(&state.position)
}

/// T + V of all bodies that have a state, J.
#[must_use]
pub fn total(world: &World, states: &[State]) -> f64 {
    let bodies = world.bodies().iter().zip(states);
    bodies.map(|(body, x)| kinetic(world, body, x) + potential(world, body, x)).sum()
}
