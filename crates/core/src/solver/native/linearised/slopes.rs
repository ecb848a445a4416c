//! Derivatives of a coupling's rows and loads with respect to the initial states.
//!
//! The motion of the rows is kept apart from the impulse that a stiff gain makes of it. The factor
//! 1/ε then multiplies a nearly vanishing sum, not its terms.

use super::StepGradient;
use crate::derivative::StateChange;
use nalgebra::{SMatrix, Vector3, Vector6};

/// Changes of a coupling at fixed V⁺, C columns.
///
/// - `motion`: motion along the rows (m/s).
/// - `impulse`: impulse beyond the gain's response to the motion (m/s, world).
/// - `torques`: torques of the impulse on A and on B, each in its body's frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct RowsChange<const C: usize> {
    pub(super) motion: SMatrix<f64, 3, C>,
    pub(super) impulse: SMatrix<f64, 3, C>,
    pub(super) torques: SMatrix<f64, 6, C>,
}

impl<const C: usize> RowsChange<C> {
    pub(super) fn zero() -> Self {
        let three = SMatrix::zeros();
        Self { motion: three, impulse: three, torques: SMatrix::zeros() }
    }

    /// Change with the opposite sign.
    pub(super) fn negated(&self) -> Self {
        Self { motion: -self.motion, impulse: -self.impulse, torques: -self.torques }
    }
}

impl RowsChange<1> {
    /// This plus `factor` times `other`.
    pub(super) fn plus(&self, factor: f64, other: &Self) -> Self {
        Self {
            motion: self.motion + other.motion * factor,
            impulse: self.impulse + other.impulse * factor,
            torques: self.torques + other.torques * factor,
        }
    }

    /// Adds the product of six columns of `slopes`, from index `first` on, and a vector.
    fn add(&mut self, slopes: &RowsChange<12>, first: usize, by: &Vector6<f64>) {
        self.motion += slopes.motion.fixed_columns::<6>(first) * by;
        self.impulse += slopes.impulse.fixed_columns::<6>(first) * by;
        self.torques += slopes.torques.fixed_columns::<6>(first) * by;
    }

    /// Inner product of all numbers.
    pub(super) fn dot(&self, other: &Self) -> f64 {
        self.motion.dot(&other.motion)
            + self.impulse.dot(&other.impulse)
            + self.torques.dot(&other.torques)
    }
}

impl RowsChange<12> {
    /// Columns from index `column` on.
    pub(super) fn columns<const C: usize>(&self, column: usize) -> RowsChange<C> {
        RowsChange {
            motion: self.motion.fixed_columns::<C>(column).into(),
            impulse: self.impulse.fixed_columns::<C>(column).into(),
            torques: self.torques.fixed_columns::<C>(column).into(),
        }
    }

    /// Transposed product of six columns, from index `first` on, and a change of the rows.
    fn rows_vjp(&self, first: usize, by: &RowsChange<1>) -> Vector6<f64> {
        self.motion.fixed_columns::<6>(first).tr_mul(&by.motion)
            + self.impulse.fixed_columns::<6>(first).tr_mul(&by.impulse)
            + self.torques.fixed_columns::<6>(first).tr_mul(&by.torques)
    }

    /// Sets the columns from index `column` on.
    pub(super) fn set<const C: usize>(&mut self, column: usize, part: &RowsChange<C>) {
        self.motion.fixed_columns_mut::<C>(column).copy_from(&part.motion);
        self.impulse.fixed_columns_mut::<C>(column).copy_from(&part.impulse);
        self.torques.fixed_columns_mut::<C>(column).copy_from(&part.torques);
    }
}

/// Derivatives of a coupling with respect to the states of A and B.
#[derive(Debug, Clone)]
pub(super) struct LinearisedSlopes {
    /// A and B, bodies of the world.
    pub(super) bodies: [Option<usize>; 2],
    /// Derivative with respect to δr (world) and δθ (body) of A and of B.
    pub(super) by_pose: RowsChange<12>,
    /// Derivative with respect to δv (world) and δω (body) at k of A and of B. `None` if independent.
    pub(super) by_velocity: Option<Box<RowsChange<12>>>,
    /// Derivative with respect to δV (world) and δΩ (body) of the instant at k of A and B. `None` if
    /// independent.
    pub(super) by_instant: Option<Box<RowsChange<12>>>,
    /// A third body of the island, with the derivative with respect to its δθ (body).
    pub(super) by_third: Option<Box<(usize, RowsChange<3>)>>,
}

/// Stacks position and rotation, or velocity and spin.
fn six(position: &Vector3<f64>, turn: &Vector3<f64>) -> Vector6<f64> {
    let (r, t) = (position, turn);
    Vector6::new(r[0], r[1], r[2], t[0], t[1], t[2])
}

impl LinearisedSlopes {
    pub(super) fn new(bodies: [Option<usize>; 2]) -> Self {
        Self {
            bodies,
            by_pose: RowsChange::zero(),
            by_velocity: None,
            by_instant: None,
            by_third: None,
        }
    }

    pub(super) fn pushed(&self, states: &[StateChange]) -> RowsChange<1> {
        let mut change = RowsChange::zero();
        for (side, body) in self.bodies.into_iter().enumerate() {
            let Some(state) = body.map(|body| &states[body]) else { continue };
            change.add(&self.by_pose, 6 * side, &six(&state.position, &state.turn));
            if let Some(slopes) = &self.by_velocity {
                change.add(slopes, 6 * side, &six(&state.velocity, &state.spin));
            }
        }
        if let Some((body, slopes)) = self.by_third.as_deref() {
            let turn = &states[*body].turn;
            change.motion += slopes.motion * turn;
            change.impulse += slopes.impulse * turn;
        }
        change
    }

    /// Derivatives with respect to the pose of `body`, and to its velocities if they matter. `None`
    /// for other bodies.
    pub(super) fn jacobian_wrt_state(
        &self,
        body: usize,
    ) -> Option<(RowsChange<6>, Option<RowsChange<6>>)> {
        let third = self.by_third.as_deref().filter(|(third, _)| *third == body);
        if let Some((_, slopes)) = third {
            let mut by_pose = RowsChange::<6>::zero();
            by_pose.motion.fixed_columns_mut::<3>(3).copy_from(&slopes.motion);
            by_pose.impulse.fixed_columns_mut::<3>(3).copy_from(&slopes.impulse);
            return Some((by_pose, None));
        }
        let first = 6 * (0..2).find(|side| self.bodies[*side] == Some(body))?;
        let by_velocity = self.by_velocity.as_ref().map(|slopes| slopes.columns(first));
        Some((self.by_pose.columns(first), by_velocity))
    }

    /// Adds the transposed product: derivatives with respect to states and to the velocities of the
    /// instant.
    pub(super) fn vjp(&self, by: &RowsChange<1>, gradient: &mut StepGradient) {
        if let Some((body, slopes)) = self.by_third.as_deref() {
            gradient.states[*body].turn +=
                slopes.motion.tr_mul(&by.motion) + slopes.impulse.tr_mul(&by.impulse);
        }
        for (side, body) in self.bodies.into_iter().enumerate() {
            let Some(body) = body else { continue };
            if let Some(slopes) = &self.by_instant {
                let faster = slopes.rows_vjp(6 * side, by);
                let instant = &mut gradient.instants[body];
                instant.velocity += faster.fixed_rows::<3>(0);
                instant.spin += faster.fixed_rows::<3>(3);
            }
            let state = &mut gradient.states[body];
            let pose = self.by_pose.rows_vjp(6 * side, by);
            state.position += pose.fixed_rows::<3>(0);
            state.turn += pose.fixed_rows::<3>(3);
            if let Some(slopes) = &self.by_velocity {
                let faster = slopes.rows_vjp(6 * side, by);
                state.velocity += faster.fixed_rows::<3>(0);
                state.spin += faster.fixed_rows::<3>(3);
            }
        }
    }
}
