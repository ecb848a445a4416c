//! Direction of friction with [`Integrator::Leapfrog`](crate::world::Integrator::Leapfrog).
//!
//! The law opposes friction to the slip of the step, which belongs to its middle, half a step after
//! its forces. Where the direction of the slip turns, this is an error of first order in h. The
//! velocities V of the instant and w of the middle before it predict the slip of the step. With the
//! slip s of the instant and the mean slip u_t of a step with the velocities 2V − w,
//!
//! ```text
//! o = −(E − ŝ ŝᵀ) u_t(2V − w)                                            (eq. 38)
//! ```
//!
//! The law takes the slip u_t + o, whose direction is that of the instant to second order. The
//! offset o is perpendicular to s, so that it does not change when a body stops. It is left out of
//! slips that may stop or start within a few steps, and out of contacts that hold.

use super::Contact;
use crate::mechanics::State;
use crate::mechanics::quaternion::{advance, rotation};
use crate::world::World;
use nalgebra::Vector3;

/// Smallest slip with an offset, in units of the change of velocity that smooth accelerations
/// explain in a step.
const FAST: f64 = 1.0;

impl Contact {
    /// Relative velocity of the touching points at `states` (m/s, world), with the motion of
    /// surfaces.
    pub(crate) fn point_velocity(&self, world: &World, states: &[State]) -> Vector3<f64> {
        let point = states[self.key.body].position + self.arm;
        let velocity = |state: &State| {
            let spin = rotation(&state.attitude) * state.spin;
            state.velocity + spin.cross(&(point - state.position))
        };
        let own = velocity(&states[self.key.body]);
        let other = self.key.partner.body().map(|body| velocity(&states[body]));
        let relative = own - other.unwrap_or_default();
        if world.has_surfaces() { relative + self.carried(world, states) } else { relative }
    }

    /// Largest change of [`Contact::point_velocity`] in a step that smooth accelerations explain
    /// (m/s): those of loads and gyroscopic terms from `states` to the `free` flight, and centripetal
    /// ones.
    pub(crate) fn smooth_change(&self, world: &World, states: &[State], free: &[State]) -> f64 {
        let of_body = |body: usize| {
            let (state, free) = (&states[body], &free[body]);
            let reach = world.bodies()[body].reach();
            (free.velocity - state.velocity).norm()
                + (free.spin - state.spin).norm() * reach
                + world.time_step() * state.spin.norm_squared() * reach
        };
        self.key.bodies().map(of_body).sum()
    }

    /// Sets the offset o of the slip (eq. 38) in a step from `states`, whose velocities are those of
    /// the middle of the step before. `instants` has the velocities of the instant, and `free` the
    /// states after free flight. No effect if a list lacks a body of the contact.
    pub fn set_slip_offset(
        &mut self,
        world: &World,
        states: &[State],
        instants: &[State],
        free: &[State],
    ) {
        self.slip_offset = Vector3::zeros();
        let known = states.len().min(instants.len()).min(free.len());
        if self.key.bodies().any(|body| body >= known) {
            return;
        }
        let (normal, h) = (self.normal(), world.time_step());
        let velocity = self.point_velocity(world, instants);
        let slip = velocity - normal * normal.dot(&velocity);
        let speed = slip.norm();
        if speed <= FAST * self.smooth_change(world, states, free) {
            return;
        }
        let predicted = |body: usize| {
            let (State { velocity, spin, .. }, instant) = (&states[body], &instants[body]);
            let attitude = advance(&instant.attitude, &(2.0 * instant.spin - spin), h);
            let position = instant.position + h * (2.0 * instant.velocity - velocity);
            [instant.pose(), State { position, attitude, ..*instant }.pose()]
        };
        let a = predicted(self.key.body);
        let b = self.key.partner.body().map(predicted);
        let mut u = self.motion([&a[0], &a[1]], b.as_ref().map(|[from, to]| [from, to]), h);
        if world.has_surfaces() {
            u += self.carried(world, states);
        }
        u -= normal * normal.dot(&u);
        let along = slip / speed;
        self.slip_offset = along * along.dot(&u) - u;
    }

    /// Offset of the slip in the law: the motion of surfaces, and the [offset](Self::slip_offset) of
    /// its direction (m/s, world).
    pub(crate) fn law_offset(&self, world: &World, states: &[State]) -> Vector3<f64> {
        if world.has_surfaces() {
            self.carried(world, states) + self.slip_offset
        } else {
            self.slip_offset
        }
    }

    /// True if the law takes another slip than that of the touching points.
    #[inline]
    pub(crate) fn has_law_offset(&self, world: &World) -> bool {
        world.has_surfaces() || self.slip_offset != Vector3::zeros()
    }
}
