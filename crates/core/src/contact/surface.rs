//! Surfaces that move over their owners: belts, rollers, turntables.
//!
//! A surface has a velocity v, and a spin ω about a centre c, both fixed in its owner, with the rotation R and the
//! position r. At the point x its material moves with
//!
//! ```text
//! s = R v + R ω × (x − r − R c)                                            (eq. 10d)
//! ```
//!
//! The law takes x in the middle of the step, ½ h w beyond the touching point of its start, with the velocity w of this
//! point relative to the owner. It moves with A and the part of A's spin along the normal: rolling does not move it.
//!
//! Equation numbers refer to `docs/formulation.md`.

use super::Contact;
use crate::mechanics::State;
use crate::mechanics::quaternion::rotation;
use crate::partner::Partner;
use crate::world::World;
use nalgebra::Vector3;

impl Contact {
    /// Owners of A's and of B's surface.
    pub(crate) fn owners(&self) -> [Partner; 2] {
        [Partner::Body(self.key.body), self.key.partner]
    }

    /// Velocities of both surfaces at the place of the touching point, `time` (s) after `states` (m/s, world).
    pub(crate) fn surface_velocities(
        &self,
        world: &World,
        states: &[State],
        time: f64,
    ) -> [Vector3<f64>; 2] {
        self.owners().map(|owner| {
            let surface = world.surface_of(owner);
            let state = owner.body().and_then(|body| states.get(body));
            let turned = |v: Vector3<f64>| state.map_or(v, |of| rotation(&of.attitude) * v);
            if surface.spin == Vector3::zeros() {
                return turned(surface.velocity);
            }
            let Some(own) = states.get(self.key.body) else { return Vector3::repeat(f64::NAN) };
            let origin = state.map_or(Vector3::zeros(), |of| of.position);
            let way = self.touching_velocity(states, owner) * time;
            let arm = own.position + self.arm - origin - turned(surface.centre) + way;
            turned(surface.velocity) + turned(surface.spin).cross(&arm)
        })
    }

    /// w: velocity of the touching point relative to `owner` (m/s, world).
    pub(crate) fn touching_velocity(&self, states: &[State], owner: Partner) -> Vector3<f64> {
        let normal = self.normal();
        let spin = |of: &State| rotation(&of.attitude) * of.spin;
        let own = &states[self.key.body];
        let about = normal * normal.dot(&spin(own));
        let velocity = own.velocity + about.cross(&self.arm);
        let Some(of) = owner.body().and_then(|body| states.get(body)) else { return velocity };
        velocity - of.velocity - spin(of).cross(&(own.position + self.arm - of.position))
    }

    /// Tangential velocity of A's [surface](World::with_surface) relative to B's, in a step from
    /// `states` (m/s, world). It is added to the slip of the law, so that a body that moves with a
    /// conveyor does not slip.
    pub fn carried(&self, world: &World, states: &[State]) -> Vector3<f64> {
        self.carried_after(world, states, 0.5 * world.time_step())
    }

    /// Tangential velocity of A's surface relative to B's, `time` (s) after `states` (m/s, world).
    pub(crate) fn carried_after(&self, world: &World, states: &[State], time: f64) -> Vector3<f64> {
        let [a, b] = self.surface_velocities(world, states, time);
        let apart = a - b;
        let normal = self.normal();
        apart - normal * normal.dot(&apart)
    }

    /// Slip of a body of this reach ℓ that turns with a surface, (h ω)² ω ℓ (m/s): what (10d) leaves of the chords of
    /// its points.
    pub(crate) fn slip_on_turning_surfaces(&self, world: &World) -> f64 {
        if !world.has_surfaces() {
            return 0.0;
        }
        let reach = world.bodies()[self.key.body].reach();
        let slip = |owner: Partner| {
            let rate = world.surface_of(owner).spin.norm();
            (world.time_step() * rate).powi(2) * rate * reach
        };
        self.owners().into_iter().map(slip).sum()
    }

    /// h Σ |(ω × (ω × y))_t| of surfaces that turn (m/s): their points move along arcs.
    pub(crate) fn arc_of_surfaces(&self, world: &World, states: &[State]) -> f64 {
        let h = world.time_step();
        let velocities = self.surface_velocities(world, states, 0.0);
        let arcs = self.owners().into_iter().zip(velocities).map(|(owner, velocity)| {
            let surface = world.surface_of(owner);
            let state = owner.body().and_then(|body| states.get(body));
            let turned = |v: Vector3<f64>| state.map_or(v, |of| rotation(&of.attitude) * v);
            let inward = turned(surface.spin).cross(&(velocity - turned(surface.velocity)));
            (inward - self.normal() * self.normal().dot(&inward)).norm()
        });
        h * arcs.sum::<f64>()
    }
}
