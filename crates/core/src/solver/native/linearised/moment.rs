//! Linearised moment of a contact: change of its impulse with the initial states of the bodies and with
//! the coefficients of turning friction.
//!
//! At fixed V⁺ the rows u = ℓ (Ω_A − Ω_B) turn with the bodies, and the axes of the law with the normal,
//! δn = φ × n:
//!
//! ```text
//! δu = δθ_A × u_A − δθ_B × u_B + ℓ δo,   δp̂ = D (δu − φ × u) + φ × p̂,   δτ = −ℓ Aᵀ (δθ × p̂)      (G6a)
//! ```
//!
//! The offset o (43a) follows from the tangential parts W and s of the relative angular velocities of w and V:
//!
//! ```text
//! δo = (E − ŝ ŝᵀ) δW − δŝ (ŝ·W) − ŝ (δŝ·W),   δŝ = (E − ŝ ŝᵀ) δs/|s|                    (G6c)
//! ```
//!
//! What the normal impulse makes of the moment is in the matrix (N17). Equation numbers refer to
//! `docs/gradients.md`.

use super::constants::{ConstantChanges, ConstantsBase, side_places, unit};
use super::coupling::{LinearAdhesion, LinearCoupling};
use super::slopes::{LinearisedSlopes, RowsChange};
use crate::contact::Contact;
use crate::derivative::SideChangeInput;
use crate::mechanics::State;
use crate::solver::native::law::MapPiece;
use crate::world::{Coefficient, Constant, World};
use nalgebra::{Matrix3, Vector3};

/// Linearised moment of a contact.
#[derive(Debug, Clone)]
pub(super) struct LinearMoment {
    /// Index among the couplings of the island.
    pub(super) index: usize,
    pub(super) slopes: LinearisedSlopes,
    /// Index of the contact among the linearised contacts of the point.
    pub(super) contact: usize,
    /// Rows that the gain acts on, p̂ (m/s, world) and u (m/s, world).
    axes: MomentAxes,
    /// Constants of its limits, with their indices and the derivatives by them.
    by_constants: Vec<(Constant, usize, RowsChange<1>)>,
}

/// Rows, impulse and motion of a moment.
#[derive(Debug, Clone)]
struct MomentAxes {
    from: Matrix3<f64>,
    impulse: Vector3<f64>,
    u: Vector3<f64>,
    /// ℓ (m).
    length: f64,
    offset: Option<TurningOffset>,
}

impl MomentAxes {
    /// Change of the rows if the normal turns by φ = `turn`, and the angular velocities that the offset follows from
    /// change.
    fn turned(&self, turn: &Vector3<f64>, turnings: &[Vector3<f64>; 2]) -> RowsChange<1> {
        let offset = self.offset.as_ref().map(|offset| offset.change(turn, turnings));
        let offset = offset.unwrap_or_default() * self.length;
        RowsChange {
            motion: self.from.tr_mul(&(offset - turn.cross(&self.u))),
            impulse: turn.cross(&self.impulse),
            ..RowsChange::zero()
        }
    }
}

/// Offset (43a) of a moment.
#[derive(Debug, Clone)]
struct TurningOffset {
    normal: Vector3<f64>,
    /// Angular velocities of A and B (rad/s, world) of w and of V.
    turnings: [[Vector3<f64>; 2]; 2],
}

impl TurningOffset {
    /// `None` for a contact without this offset.
    fn new(contact: &Contact, states: &[State], instants: &[State]) -> Option<Self> {
        if contact.turning_offset == Vector3::zeros() || instants.len() != states.len() {
            return None;
        }
        let turning =
            |states: &[State], body: usize| states[body].pose().rotation * states[body].spin;
        let sides = [Some(contact.key.body), contact.key.partner.body()];
        let turnings = [states, instants].map(|states| {
            sides.map(|body| body.map_or(Vector3::zeros(), |body| turning(states, body)))
        });
        Some(Self { normal: contact.normal(), turnings })
    }

    /// δo (G6c), if the normal turns by φ = `turn` and the relative angular velocities of w and V change.
    fn change(&self, turn: &Vector3<f64>, turnings: &[Vector3<f64>; 2]) -> Vector3<f64> {
        let n = self.normal;
        let tilted = turn.cross(&n);
        let across = |v: &Vector3<f64>| v - n * n.dot(v);
        let relative = self.turnings.map(|[a, b]| a - b);
        let [before, now] = relative.map(|turning| across(&turning));
        let [before_change, now_change] = [0, 1].map(|k| {
            let turning = relative[k];
            across(&turnings[k]) - tilted * n.dot(&turning) - n * tilted.dot(&turning)
        });
        let rate = now.norm();
        let along = now / rate;
        let beside = |v: &Vector3<f64>| v - along * along.dot(v);
        let along_change = beside(&now_change) / rate;
        beside(&before_change)
            - along_change * along.dot(&before)
            - along * along_change.dot(&before)
    }
}

pub(super) struct MomentSolution<'a> {
    /// Index among the couplings of the island.
    pub(super) index: usize,
    /// Index of the contact among the linearised contacts of the point.
    pub(super) contact: usize,
    pub(super) piece: MapPiece,
    /// Rows that the gain acts on, an orthonormal frame.
    pub(super) from: &'a Matrix3<f64>,
    /// p̂ (m/s, world).
    pub(super) impulse: Vector3<f64>,
    /// ℓ Ω of A and of B (m/s, world).
    pub(super) turning: [Vector3<f64>; 2],
    /// ℓ (m).
    pub(super) length: f64,
    /// States at k, and those with the velocities of the instant, if known.
    pub(super) states: &'a [State],
    pub(super) instants: &'a [State],
    /// ε whose limit is taken, or 0.
    pub(super) limit: f64,
}

impl LinearMoment {
    /// Linearises the moment of a `contact`, from the linearised `coupling` of the contact.
    pub(super) fn new(
        world: &World,
        contact: &Contact,
        coupling: &LinearCoupling,
        at: &MomentSolution<'_>,
    ) -> Self {
        let MomentSolution { index, contact: place, piece, from, impulse, turning, .. } = at;
        let MomentSolution { length, states, instants, limit, .. } = at;
        let axes = MomentAxes {
            from: **from,
            impulse: *impulse,
            u: turning[0] - turning[1] + contact.turning_offset * *length,
            length: *length,
            offset: TurningOffset::new(contact, states, instants),
        };
        let mut slopes = LinearisedSlopes::new(coupling.slopes.bodies);
        // Columns by the pose of each body (G6a), with the rotation φ of the contact's normal
        for side in (0..2).filter(|&side| slopes.bodies[side].is_some()) {
            for k in 0..6 {
                let unit = Vector3::ith(k % 3, 1.0);
                let nothing = SideChangeInput::nothing();
                let turn = if k < 3 { Vector3::zeros() } else { coupling.rotations[side] * unit };
                let given = match k {
                    0..3 => SideChangeInput { position: unit, ..nothing },
                    _ => SideChangeInput { turn, ..nothing },
                };
                let sides = if side == 0 { [&given, &nothing] } else { [&nothing, &given] };
                let normal = coupling.tangent.change(sides[0], sides[1], 0.0, 0.0).turn;
                let sign = if side == 0 { 1.0 } else { -1.0 };
                let turnings = axes.offset.as_ref().map(|offset| offset.turnings);
                let turned = |turnings: [Vector3<f64>; 2]| turn.cross(&turnings[side]) * sign;
                let mut column = axes.turned(&normal, &turnings.unwrap_or_default().map(turned));
                column.motion += from.tr_mul(&turn.cross(&turning[side])) * sign;
                let torque = coupling.rotations[side].tr_mul(&turn.cross(impulse)) * -*length;
                column.torques.fixed_rows_mut::<3>(3 * side).copy_from(&torque);
                slopes.by_pose.set(6 * side + k, &column);
            }
        }
        // Offset (43a), by the spins of w and of V
        if axes.offset.is_some() {
            let [by_velocity, by_instant] = [0, 1].map(|which| {
                let mut columns = Box::new(RowsChange::zero());
                for (side, sign) in [(0, 1.0), (1, -1.0)] {
                    for k in (0..3).filter(|_| slopes.bodies[side].is_some()) {
                        let mut turnings = [Vector3::zeros(); 2];
                        turnings[which] = coupling.rotations[side].column(k) * sign;
                        let column = axes.turned(&Vector3::zeros(), &turnings);
                        columns.set(6 * side + 3 + k, &column);
                    }
                }
                Some(columns)
            });
            (slopes.by_velocity, slopes.by_instant) = (by_velocity, by_instant);
        }
        let normal = contact.normal();
        let pressed = coupling.pressed / length;
        let along = |v: Vector3<f64>| v.try_normalize(0.0).unwrap_or_default();
        let across = |v: &Vector3<f64>| v - normal * normal.dot(v);
        use Coefficient::{RollingFriction, TorsionalFriction};
        // γ t/ℓ of (G6a) for each coefficient: along the moment, or against the turning
        let by_friction = [RollingFriction, TorsionalFriction].into_iter().filter_map(|of| {
            let (place, friction) =
                world.larger_between(of, contact.key.body, contact.key.partner)?;
            let direction = match (of, piece) {
                (RollingFriction, MapPiece::Moment { rolls: true, .. }) if friction > 0.0 => {
                    along(across(impulse))
                }
                (RollingFriction, MapPiece::Moment { rolls: true, .. }) => -along(across(&axes.u)),
                (TorsionalFriction, MapPiece::Moment { spins, .. }) => normal * f64::from(*spins),
                _ => Vector3::zeros(),
            };
            let impulse = direction * pressed;
            let motion = from.tr_mul(&impulse) * -*limit;
            Some((of, place, friction, RowsChange { motion, impulse, ..RowsChange::zero() }))
        });
        // Adhesion raises the limits of the moment: μ_r δâ/ℓ.
        let mut by_pressing = RowsChange::zero();
        let mut by_constants = Vec::new();
        for (of, place, friction, by) in by_friction {
            if coupling.pressed > 0.0 {
                by_pressing = by_pressing.plus(friction / coupling.pressed, &by);
            }
            by_constants.push((Constant::Coefficient(of), place, by));
        }
        if let Some(LinearAdhesion { place, slope, slope_by_time_step, .. }) =
            coupling.adhesion.as_deref()
        {
            let adhesion = Constant::Coefficient(Coefficient::Adhesion);
            let scaled = |slope: f64| RowsChange::zero().plus(slope, &by_pressing);
            by_constants.push((adhesion, *place, scaled(*slope)));
            by_constants.push((Constant::TimeStep, 0, scaled(*slope_by_time_step)));
        }
        Self { index: *index, contact: *place, slopes, axes, by_constants }
    }

    /// Change of the rows for changes of constants. `contact` is the linearised contact.
    pub(super) fn jvp_wrt_constants<F: Fn(Constant, usize) -> f64>(
        &self,
        contact: &LinearCoupling,
        constants: &ConstantChanges<'_, F>,
    ) -> RowsChange<1> {
        let turn = contact.turn_wrt_constants(constants);
        let turned = self.axes.turned(&turn, &[Vector3::zeros(); 2]);
        self.by_constants.iter().fold(turned, |change, (constant, place, by)| {
            change.plus((constants.numbers)(*constant, *place), by)
        })
    }

    /// Adds the transposed product: derivatives with respect to `constants`.
    pub(super) fn pull_constants(
        &self,
        contact: &LinearCoupling,
        by: &RowsChange<1>,
        shapes: &[ConstantsBase],
        constants: &[Constant],
        sums: &mut [Vec<f64>],
    ) {
        for (&constant, sums) in constants.iter().zip(sums) {
            for (of, place, slope) in &self.by_constants {
                if *of == constant {
                    sums[*place] += by.dot(slope);
                }
            }
            for body in self.slopes.bodies.into_iter().flatten() {
                for place in side_places(constant, body, contact.bounces()) {
                    let numbers = unit(constant, place);
                    let given = ConstantChanges { shapes, numbers: &numbers };
                    let turn = contact.turn_wrt_constants(&given);
                    sums[place] += by.dot(&self.axes.turned(&turn, &[Vector3::zeros(); 2]));
                }
            }
        }
    }
}
