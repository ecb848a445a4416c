//! Differentials of the velocities of surfaces (eq. 10d).
//!
//! With the arm y = x − r, the spin Ω = R ω and the velocity w of the touching point relative to the owner, which turns
//! by φ,
//!
//! ```text
//! δs = φ × s + Ω × (δy − φ × y + t (δw − φ × w) + δt w)                            (G5b)
//! ```
//!
//! Equation numbers refer to `docs/gradients.md`.

use super::RowChange;
use crate::contact::Contact;
use crate::derivative::SideChangeInput;
use crate::mechanics::State;
use crate::mechanics::quaternion::rotation;
use crate::world::World;
use nalgebra::{Matrix3, Vector3};

/// Surfaces of a contact of which one turns.
#[derive(Debug, Clone, Copy)]
pub(super) struct TurningSurfaces {
    /// Ω of each surface (rad/s, world).
    rates: [Vector3<f64>; 2],
    /// Velocities of the surfaces at the start and in the middle of the step (m/s, world).
    velocities: [[Vector3<f64>; 2]; 2],
    /// True for an owner that is a body.
    moves: [bool; 2],
    /// Rotations of A and B and their angular velocities (rad/s, world).
    rotations: [Matrix3<f64>; 2],
    spins: [Vector3<f64>; 2],
    /// w relative to each owner (m/s, world).
    ways: [Vector3<f64>; 2],
    arms: [Vector3<f64>; 2],
    normal: Vector3<f64>,
    time: f64,
}

impl TurningSurfaces {
    /// `None` if no surface turns.
    pub(super) fn new(world: &World, contact: &Contact, states: &[State]) -> Option<Box<Self>> {
        let owners = contact.owners();
        let zero = Vector3::zeros();
        if owners.iter().all(|owner| world.surface_of(*owner).spin == zero) {
            return None;
        }
        let state = |side: usize| owners[side].body().map(|body| &states[body]);
        let both = |of: &dyn Fn(usize) -> Vector3<f64>| [of(0), of(1)];
        let rotations =
            [0, 1].map(|side| state(side).map_or(Matrix3::identity(), |of| rotation(&of.attitude)));
        let arm = |side: usize| {
            let origin = state(side).map_or(zero, |of| of.position);
            states[contact.key.body].position + contact.arm - origin
        };
        let rate = |side: usize| rotations[side] * world.surface_of(owners[side]).spin;
        let spin = |side: usize| state(side).map_or(zero, |of| rotations[side] * of.spin);
        let time = 0.5 * world.time_step();
        let way = |side: usize| contact.touching_velocity(states, owners[side]);
        Some(Box::new(Self {
            rates: both(&rate),
            velocities: [0.0, time].map(|time| contact.surface_velocities(world, states, time)),
            moves: owners.map(|owner| owner.body().is_some()),
            rotations,
            spins: both(&spin),
            ways: both(&way),
            arms: both(&arm),
            normal: contact.normal(),
            time,
        }))
    }

    /// Differential of the velocity of the surface of `side`, at the start or in the `middle` of the step, whose
    /// length changes by `time_step` (s).
    pub(super) fn change(
        &self,
        side: usize,
        given: [&SideChangeInput; 2],
        rows: &RowChange,
        middle: bool,
        time_step: f64,
    ) -> Vector3<f64> {
        let turn = given[side].turn;
        let velocity = self.velocities[usize::from(middle)][side];
        // The centre of a surface of fixed geometry does not move with the ground.
        let arm =
            if self.moves[side] { rows.arms[side] } else { rows.arms[side] + given[side].position };
        let mut moved = arm - turn.cross(&self.arms[side]);
        if middle {
            let way = self.way_change(side, given, rows) - turn.cross(&self.ways[side]);
            moved += way * self.time + self.ways[side] * (0.5 * time_step);
        }
        turn.cross(&velocity) + self.rates[side].cross(&moved)
    }

    /// δw relative to the owner of `side`.
    fn way_change(
        &self,
        side: usize,
        given: [&SideChangeInput; 2],
        rows: &RowChange,
    ) -> Vector3<f64> {
        let spin_change =
            |k: usize| self.rotations[k] * given[k].spin + given[k].turn.cross(&self.spins[k]);
        let n = self.normal;
        let turned = rows.turn.cross(&n);
        let along = n.dot(&self.spins[0]);
        let along_change = turned.dot(&self.spins[0]) + n.dot(&spin_change(0));
        let about = (turned * along + n * along_change).cross(&self.arms[0]);
        let change = given[0].velocity + about + (n * along).cross(&rows.arms[0]);
        if !self.moves[side] {
            return change;
        }
        let turning = spin_change(side).cross(&self.arms[side]);
        change - given[side].velocity - turning - self.spins[side].cross(&rows.arms[side])
    }
}
