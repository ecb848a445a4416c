//! A slope, and how states are described relative to it.

use crate::error::Error;
use crate::mechanics::State;
use crate::mechanics::quaternion::left;
use crate::step::StepSolution;
use crate::world::Fixed;
use nalgebra::{Matrix3, Vector3, Vector4};

/// A plane through the origin that falls towards +x by an angle θ. Relative to it x points
/// downhill, y is the world's, and z is its normal n = (sin θ, 0, cos θ):
///
/// ```text
/// R = [cos θ  0  −sin θ]
///     [  0    1     0  ]      t = (cos θ/2, 0, −sin θ/2, 0)
///     [sin θ  0   cos θ]
/// ```
///
/// R turns vectors of the world, t is its quaternion; a spin is the body's in both.
pub(super) struct Incline {
    turn: Matrix3<f64>,
    quaternion: Vector4<f64>,
}

impl Incline {
    /// By `slope`, degrees.
    pub fn new(slope: f64) -> Self {
        let (sin, cos) = slope.to_radians().sin_cos();
        let (half_sin, half_cos) = (0.5 * slope.to_radians()).sin_cos();
        Self {
            turn: Matrix3::new(cos, 0.0, -sin, 0.0, 1.0, 0.0, sin, 0.0, cos),
            quaternion: Vector4::new(half_cos, 0.0, -half_sin, 0.0),
        }
    }

    pub fn state_from_world(&self, state: &State) -> State {
        State {
            position: self.turn * state.position,
            attitude: left(&self.quaternion) * state.attitude,
            velocity: self.turn * state.velocity,
            spin: state.spin,
        }
    }

    pub fn state_to_world(&self, state: &State) -> State {
        State {
            position: self.turn.tr_mul(&state.position),
            attitude: left(&self.quaternion).tr_mul(&state.attitude),
            velocity: self.turn.tr_mul(&state.velocity),
            spin: state.spin,
        }
    }

    /// The states and forces of `solution` relative to the slope, in `seen`.
    pub fn solution_from_world(&self, solution: &StepSolution, seen: &mut StepSolution) {
        seen.copy_from(solution);
        for state in &mut seen.states {
            *state = self.state_from_world(state);
        }
        for contact in &mut seen.contacts {
            contact.force = self.turn * contact.force;
            contact.slip = self.turn * contact.slip;
        }
    }

    pub fn fixed_to_world(&self, fixed: &Fixed) -> Result<Fixed, Error> {
        let piece = fixed.piece.moved_by(&self.turn.transpose(), &Vector3::zeros())?;
        Ok(Fixed { piece, friction: fixed.friction })
    }
}
