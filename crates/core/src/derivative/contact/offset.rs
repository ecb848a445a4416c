//! Derivative of the offset of a slip (eq. 38).
//!
//! The offset o = −(E − ŝ ŝᵀ) u_t(2V − w) is a function of the poses, of the velocities w of the
//! middle before the step and of the velocities V of its start. With the slip s of V,
//!
//! ```text
//! δo = δŝ (ŝ·u_t) + ŝ (δŝ·u_t + ŝ·δu_t) − δu_t,   δŝ = (E − ŝ ŝᵀ) δs/|s|             (G22)
//! ```
//!
//! δu_t is the differential of a step that ends with 2V − w. The equation is that of
//! `docs/gradients.md`.

use super::{ContactTangent, across};
use crate::contact::Contact;
use crate::derivative::side::SideChangeInput;
use crate::derivative::{EndMap, PlacedFeatures};
use crate::mechanics::State;
use crate::step::Step;
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

/// States from which a step starts, with the velocities V of the instant, and those after a step with
/// the velocities 2V − w.
#[derive(Debug, Clone, Default)]
pub(crate) struct PredictedStep {
    pub(crate) instants: Vec<State>,
    ends: Vec<State>,
    /// States after free flight.
    free: Vec<State>,
}

impl PredictedStep {
    /// Predicts the step from `states`, whose velocities are w. Without `instants` there is no offset.
    pub(crate) fn set(&mut self, step: &Step<'_>, instants: &[State]) {
        let Step { world, states, free, .. } = *step;
        self.free.clear();
        self.free.extend_from_slice(free);
        let map = world.step_map();
        self.instants.clear();
        self.instants.extend_from_slice(instants);
        self.ends.clear();
        self.ends.extend(instants.iter().zip(states).map(|(instant, state)| {
            let velocity = 2.0 * instant.velocity - state.velocity;
            let spin = 2.0 * instant.spin - state.spin;
            map.coasted(&State { velocity, spin, ..*instant })
        }));
    }
}

/// Offset of a slip, prepared for differentiation.
#[derive(Debug, Clone)]
pub(super) struct OffsetTangent {
    /// The contact in the predicted step.
    predicted: ContactTangent,
    /// Rotation at the end of that step (rad, world) by the spins of A and B (rad/s, body).
    turnings: [Matrix3<f64>; 2],
    /// Spins Ω of A and B at the instant (rad/s, world).
    spins: [Vector3<f64>; 2],
    /// Relative velocity of the touching points at the instant (m/s, world), and its slip s.
    velocity: Vector3<f64>,
    slip: Vector3<f64>,
}

impl OffsetTangent {
    /// `None` if the contact has no offset.
    pub(super) fn new(
        world: &World,
        contact: &Contact,
        placed: &PlacedFeatures,
        states: &[State],
        step: &PredictedStep,
    ) -> Option<Box<Self>> {
        let PredictedStep { instants, ends, free } = step;
        if contact.slip_offset == Vector3::zeros() || ends.len() != states.len() {
            return None;
        }
        let zero = Vector3::zeros();
        let plain = Contact { slip_offset: zero, rebound: 0.0, struck: false, ..*contact };
        let predicted =
            ContactTangent::new(world, &plain, placed, states, ends, &PredictedStep::default());
        let bodies = [Some(contact.key.body), contact.key.partner.body()];
        let turnings = bodies.map(|body| {
            body.map_or(Matrix3::zeros(), |body| {
                let end = &ends[body];
                let map = EndMap::new(&end.velocity, &end.spin, &world.step_map());
                end.pose().rotation * map.turning()
            })
        });
        let spins = bodies.map(|body| {
            body.map_or(zero, |body| instants[body].pose().rotation * instants[body].spin)
        });
        let velocity = contact.point_velocity(world, instants);
        let normal = contact.normal();
        let slip = velocity - normal * normal.dot(&velocity);
        if contact.is_slow(&slip, world, states, free) {
            return None;
        }
        Some(Box::new(Self { predicted, turnings, spins, velocity, slip }))
    }

    /// Differential δo for the differentials of both sides and of h (s).
    pub(super) fn change(&self, sides: [&SideChangeInput; 2], time_step: f64) -> Vector3<f64> {
        let Self { predicted, spins, velocity, slip, .. } = self;
        let rows = predicted.change(sides[0], sides[1], time_step, 0.0);
        let n = predicted.contact.normal();
        let turned = rows.turn.cross(&n);
        // Differential of the part of a vector across the normal.
        let projected = |vector: &Vector3<f64>, change: &Vector3<f64>| {
            across(&n, change) - turned * n.dot(vector) - n * turned.dot(vector)
        };
        let motion = rows.motion + self.by_velocities(sides);
        let u = across(&n, &predicted.motion);
        let u_change = projected(&predicted.motion, &motion);
        let mut faster = Vector3::zeros();
        let arms = predicted.arms();
        let signed = [(&predicted.a, 1.0), (&predicted.b, -1.0)];
        for (k, (side, sign)) in signed.into_iter().enumerate() {
            let given = sides[k];
            let spin = side.rotation * given.instant_spin + given.turn.cross(&spins[k]);
            let turning = spin.cross(&arms[k]) + spins[k].cross(&rows.arms[k]);
            let carried = given.turn.cross(&side.surface);
            faster += (given.instant_velocity + turning + carried) * sign;
        }
        let slip_change = projected(velocity, &faster);
        let speed = slip.norm();
        let along = slip / speed;
        let along_change = (slip_change - along * along.dot(&slip_change)) / speed;
        along_change * along.dot(&u) + along * (along_change.dot(&u) + along.dot(&u_change))
            - u_change
    }

    /// Part of δu by the velocities 2V − w of the predicted step (m/s), up to its part along the normal.
    fn by_velocities(&self, sides: [&SideChangeInput; 2]) -> Vector3<f64> {
        let Self { predicted, turnings, .. } = self;
        let spins = sides.map(|given| 2.0 * given.instant_spin - given.spin);
        let linear = sides.map(|given| 2.0 * given.instant_velocity - given.velocity);
        let turns = [turnings[0] * spins[0], turnings[1] * spins[1]];
        let rolling = [predicted.a.rotation * spins[0], predicted.b.rotation * spins[1]];
        predicted.end_change(linear, turns, rolling)
    }
}
