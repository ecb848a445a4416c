//! What a coupling's impulse and the torques of it change by with the states at the start of the step.

use crate::derivative::StateChange;
use nalgebra::{SMatrix, SVector, Vector3};

/// Of the impulse (m/s, world), and of its torques on A and on B, nine numbers.
#[derive(Debug, Clone)]
pub(super) struct Slopes {
    /// A and B, bodies of the world.
    pub(super) bodies: [Option<usize>; 2],
    /// By δr (world) and δθ (body) of A and of B.
    pub(super) by_pose: SMatrix<f64, 9, 12>,
    /// By δv (world) and δω (body) at k of A and of B, where these have a part in it.
    pub(super) by_velocity: Option<Box<SMatrix<f64, 9, 12>>>,
}

impl Slopes {
    pub(super) fn of(bodies: [Option<usize>; 2]) -> Self {
        Self { bodies, by_pose: SMatrix::zeros(), by_velocity: None }
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

    /// By the state of one of its bodies, twelve columns: nothing of others.
    pub(super) fn by_state(&self, body: usize) -> Option<SMatrix<f64, 9, 12>> {
        let of = |side: usize| self.bodies[side] == Some(body);
        let side = (0..2).find(|side| of(*side))?;
        let mut columns = SMatrix::<f64, 9, 12>::zeros();
        let six = |slopes: &SMatrix<f64, 9, 12>| slopes.fixed_columns::<6>(6 * side).into_owned();
        columns.fixed_columns_mut::<6>(0).copy_from(&six(&self.by_pose));
        if let Some(slopes) = &self.by_velocity {
            columns.fixed_columns_mut::<6>(6).copy_from(&six(slopes));
        }
        Some(columns)
    }

    /// The transpose.
    pub(super) fn pull(&self, by: &SVector<f64, 9>, states: &mut [StateChange]) {
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
}
