//! Steps that obey every law and are no physics all the same: the time step is too long for them.
//!
//! A step turns a body about one axis by 2 atan(½ h|ω⁺|). The laws of contact speak of the mean
//! motion of a point over the step, its impulse does work on the motion at the end; the two differ
//! with the turn, and the energy of a solved step may grow by up to
//!
//! ```text
//! Σ |p| |ω⁺ × c| θ/√(1 + θ²),   θ = ½ h|ω⁺|                               (eq. 28)
//! ```
//!
//! over all contacts. That vanishes with h, but at turns of a radian it is what the body has, and no
//! residual can see it. (Of a step that bounces, what its impulses gain is counted instead, eq. 31.)
//! So such steps are marked
//! ([`StepStatus::Wild`](crate::step::StepStatus::Wild)).

use crate::mechanics::{RigidBody, State, Wrench};
use crate::world::World;

/// A step that turns a body by more than this is wild, rad.
pub const LARGEST_TURN: f64 = 1.0;

/// A step that makes more energy than this part of the kinetic energy is wild.
pub const LARGEST_GAIN: f64 = 1e-3;

/// A motion slower than this, m/s in the world's [scale](World::speed_scale), has no energy to speak
/// of.
const REST: f64 = 1e-4;

/// Whether a step of `world` that has `gained` (J) turns a body too far or makes energy. Its solver may
/// leave a residual of `accepted` (m/s): a point that an earlier step has left h times that deep may be
/// lifted out again, against the weight, and that is no energy made. A step that does not have a
/// state of every body at both ends is wild.
#[must_use]
pub fn is_wild(
    world: &World,
    states: &[State],
    next: &[State],
    gained: f64,
    accepted: f64,
) -> bool {
    let h = world.time_step();
    let lift = world.gravity().norm() * h * accepted;
    let (mut kinetic, mut rest) = (0.0, 0.0);
    let slow = REST * world.speed_scale();
    for (index, body) in world.bodies().iter().enumerate() {
        let (Some(state), Some(next)) = (states.get(index), next.get(index)) else { return true };
        if h * next.spin.norm() > LARGEST_TURN {
            return true;
        }
        kinetic += kinetic_energy(body, state).max(kinetic_energy(body, next));
        rest += body.mass() * (0.5 * slow * slow + lift);
    }
    gained > LARGEST_GAIN * kinetic + rest
}

/// What a step under `wrenches` (without gravity) adds to the kinetic energy beyond the work of
/// gravity and wrenches, J; NaN where a body has no state at both ends or no wrench.
#[must_use]
pub fn energy_gain(world: &World, states: &[State], next: &[State], wrenches: &[Wrench]) -> f64 {
    let h = world.time_step();
    let of_body = world.bodies().iter().enumerate().map(|(index, body)| {
        let (Some(state), Some(next), Some(wrench)) =
            (states.get(index), next.get(index), wrenches.get(index))
        else {
            return f64::NAN;
        };
        let force = wrench.force + world.gravity() * body.mass();
        let moved = next.position - state.position;
        let change = kinetic_energy(body, next) - kinetic_energy(body, state);
        change - force.dot(&moved) - h * wrench.torque.dot(&next.spin)
    });
    of_body.sum()
}

/// ½ m v² + ½ ωᵀ I ω, J.
fn kinetic_energy(body: &RigidBody, state: &State) -> f64 {
    let spin = &state.spin;
    0.5 * (body.mass() * state.velocity.norm_squared() + spin.dot(&(body.inertia() * spin)))
}
