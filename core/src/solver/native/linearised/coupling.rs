//! A contact, linearised: what the bodies at the start of the step, and constants, make of its impulse.
//!
//! Equation numbers are those of `docs/gradients.md`.

use super::super::law::Piece;
use super::constants::Constants;
use crate::contact::{Contact, Partner};
use crate::derivative::{ContactTangent, Given, StateChange};
use crate::mechanics::State;
use crate::step::Step;
use crate::world::Constant;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// A contact, linearised.
#[derive(Debug, Clone)]
pub(super) struct LinearCoupling {
    /// A and B, bodies of the world.
    pub(super) bodies: [Option<usize>; 2],
    pub(super) rotations: [Matrix3<f64>; 2],
    pub(super) tangent: ContactTangent,
    /// D of (N5).
    pub(super) gain: Matrix3<f64>,
    /// p̂.
    pub(super) impulse: Vector3<f64>,
    /// δp̂ by δμ at fixed u.
    pub(super) by_friction: Vector3<f64>,
    /// δμ by that of the world, and the same of e.
    pub(super) of_world: (f64, f64),
    pub(super) is_ground: bool,
    /// By δr (world) and δθ (body) of A and of B.
    pub(super) by_pose: SMatrix<f64, 9, 12>,
    /// By δv (world) and δω (body) at k of A and of B, where it bounces.
    pub(super) by_velocity: Option<Box<SMatrix<f64, 9, 12>>>,
}

impl LinearCoupling {
    pub(super) fn new(
        step: &Step<'_>,
        contact: &Contact,
        next: &[State],
        (piece, gain, impulse): (Piece, Matrix3<f64>, Vector3<f64>),
    ) -> Self {
        let (world, key) = (step.world, &contact.key);
        let bodies = [Some(key.body), key.partner.body()];
        let tangent = ContactTangent::new(world, contact, step.states, next);
        let n = contact.normal();
        let pressed = n.dot(&impulse);
        let across = |v: &Vector3<f64>| v - n * n.dot(v);
        // Along the friction, or against the slip where there is none.
        let by_friction = match piece {
            Piece::Slip => {
                let along = match contact.law.friction > 0.0 {
                    true => across(&impulse),
                    false => -across(tangent.motion()),
                };
                along.try_normalize(0.0).unwrap_or_default() * pressed
            }
            _ => Vector3::zeros(),
        };
        let rotation = |body: Option<usize>| {
            body.map_or(Matrix3::identity(), |body| step.states[body].pose().rotation)
        };
        let mut coupling = Self {
            bodies,
            rotations: bodies.map(rotation),
            tangent,
            gain,
            impulse,
            by_friction,
            of_world: world.law_by_world(key.body, key.partner),
            is_ground: key.partner == Partner::Ground,
            by_pose: SMatrix::zeros(),
            by_velocity: None,
        };
        coupling.set_slopes(contact);
        coupling
    }

    /// Whether it has an impulse.
    pub(super) fn presses(&self) -> bool {
        self.impulse != Vector3::zeros()
    }

    /// Fills the derivatives by poses and velocities, column by column.
    pub(super) fn set_slopes(&mut self, contact: &Contact) {
        if !self.presses() && self.gain == Matrix3::zeros() {
            return;
        }
        let mut by_velocity = contact.bounces().then(|| Box::new(SMatrix::<f64, 9, 12>::zeros()));
        for side in (0..2).filter(|&side| self.bodies[side].is_some()) {
            for k in 0..6 {
                let (unit, nothing) = (Vector3::ith(k % 3, 1.0), Given::nothing());
                let column = match (k, side) {
                    // Where both move alike, nothing changes.
                    (0..3, 1) => -self.by_pose.column(k),
                    (0..3, _) => self.changed(side, &Given { position: unit, ..nothing }),
                    _ => {
                        let turn = self.rotations[side] * unit;
                        self.changed(side, &Given { turn, ..nothing })
                    }
                };
                self.by_pose.set_column(6 * side + k, &column);
                if let Some(slopes) = &mut by_velocity {
                    let faster = match k {
                        0..3 => Given { velocity: unit, ..nothing },
                        _ => Given { spin: unit, ..nothing },
                    };
                    slopes.set_column(6 * side + k, &self.changed(side, &faster));
                }
            }
        }
        self.by_velocity = by_velocity;
    }

    /// What a change of one side makes.
    pub(super) fn changed(&self, side: usize, given: &Given) -> SVector<f64, 9> {
        let nothing = Given::nothing();
        let sides = if side == 0 { (given, &nothing) } else { (&nothing, given) };
        self.change(sides, 0.0, 0.0)
    }

    /// What a change of both sides, of h and of e makes of the impulse at fixed V⁺, and of the torques of what
    /// it is: in the frame that turns with the normal, δn = φ × n,
    ///
    /// ```text
    /// δp̂ = D (δu − φ × u) + φ × p̂,   δτ = A_Bᵀ (δarm × p̂ − δθ × (arm × p̂))           (G6)
    /// ```
    pub(super) fn change(
        &self,
        sides: (&Given, &Given),
        time_step: f64,
        restitution: f64,
    ) -> SVector<f64, 9> {
        let rows = self.tangent.change(sides, time_step, restitution);
        let (p, u) = (&self.impulse, self.tangent.motion());
        let impulse = self.gain * (rows.motion - rows.turn.cross(u)) + rows.turn.cross(p);
        let mut change = SVector::<f64, 9>::zeros();
        change.fixed_rows_mut::<3>(0).copy_from(&impulse);
        let arms = self.tangent.arms();
        for (side, given) in [sides.0, sides.1].into_iter().enumerate() {
            let torque = rows.arms[side].cross(p) - given.turn.cross(&arms[side].cross(p));
            let torque = self.rotations[side].tr_mul(&torque);
            change.fixed_rows_mut::<3>(3 + 3 * side).copy_from(&torque);
        }
        change
    }

    /// By changes of states.
    pub(super) fn pushed(&self, states: &[StateChange]) -> SVector<f64, 9> {
        let mut change = SVector::<f64, 9>::zeros();
        for (side, body) in self.bodies.into_iter().enumerate() {
            let Some(state) = body.map(|body| &states[body]) else { continue };
            let columns = |slopes: &SMatrix<f64, 9, 12>, first, second| {
                slopes.fixed_columns::<3>(6 * side) * first
                    + slopes.fixed_columns::<3>(6 * side + 3) * second
            };
            change += columns(&self.by_pose, state.position, state.turn);
            if let Some(slopes) = &self.by_velocity {
                change += columns(slopes, state.velocity, state.spin);
            }
        }
        change
    }

    /// The transpose.
    pub(super) fn pull_states(&self, by: &SVector<f64, 9>, states: &mut [StateChange]) {
        for (side, body) in self.bodies.into_iter().enumerate() {
            let Some(state) = body.map(|body| &mut states[body]) else { continue };
            let of = |slopes: &SMatrix<f64, 9, 12>, k: usize| -> Vector3<f64> {
                slopes.fixed_columns::<3>(6 * side + k).tr_mul(by)
            };
            state.position += of(&self.by_pose, 0);
            state.turn += of(&self.by_pose, 3);
            if let Some(slopes) = &self.by_velocity {
                state.velocity += of(slopes, 0);
                state.spin += of(slopes, 3);
            }
        }
    }

    /// By changes of constants.
    pub(super) fn by_constants<F: Fn(Constant, usize) -> f64>(
        &self,
        constants: &Constants<'_, F>,
    ) -> SVector<f64, 9> {
        let of = constants.numbers;
        let side = |body: Option<usize>| body.map_or(Given::nothing(), |body| constants.side(body));
        let (a, mut b) = (side(self.bodies[0]), side(self.bodies[1]));
        if self.is_ground {
            b.position = self.tangent.normal() * of(Constant::Ground, 0);
        }
        let restitution = of(Constant::Restitution, 0) * self.of_world.1;
        let mut change = self.change((&a, &b), of(Constant::TimeStep, 0), restitution);
        let friction = self.by_friction * (of(Constant::Friction, 0) * self.of_world.0);
        let mut part = change.fixed_rows_mut::<3>(0);
        part += friction;
        change
    }
}
