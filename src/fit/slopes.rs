//! How the errors of tosses change with the values: by the derivative of every step, pushed forwards.
//!
//! With a and b, the distance and the turn of a body in a frame in the loss' units, the error of a toss of F frames, times bodies, is
//!
//! ```text
//! e = Σ (|a| + |b|)/F,   ∂e = Σ (â·∂a + b̂·∂b)/F,
//! ```
//!
//! and the quadratic that touches |a| at where it is and lies above it everywhere, |a|²/2|a₀| + |a₀|/2, makes
//!
//! ```text
//! M = Σ (∂aᵀ∂a/|a| + ∂bᵀ∂b/|b|)/F
//! ```
//!
//! the matrix of a Gauss–Newton step: least squares with weights that are set anew at each. The loss ℓ(e) itself bends by less, as |a| is
//! straight along a; where the motions are taken for straight, by
//!
//! ```text
//! H = ℓ′ Σ (∂aᵀ (E − ââᵀ) ∂a/|a| + ∂bᵀ (E − b̂b̂ᵀ) ∂b/|b|)/F + ℓ″ ∂eᵀ ∂e.
//! ```

use super::error::FitError;
use super::loss::{ANGLE, DISTANCE, Loss};
use super::model::{Constant, Model};
use super::parameter::{Parameter, ParameterValues};
use super::protocol::{Protocol, turn_between};
use super::recording::Toss;
use super::rollout::{Seen, follow};
use crate::derivative::StateChange;
use crate::mechanics::quaternion::turn_slope;
use crate::solver::native::{StepChange, StepDerivative};
use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// What the loss of one toss does around some values.
#[derive(Debug, Clone, PartialEq)]
pub struct TossSlopes {
    /// Its loss.
    pub loss: f64,
    /// The derivatives of the loss by the parameters.
    pub gradient: DVector<f64>,
    /// The matrix of a Gauss–Newton step.
    pub matrix: DMatrix<f64>,
    /// H: how the loss bends.
    pub bend: DMatrix<f64>,
    /// How far the motion goes with each parameter: Σ (|∂a| + |∂b|)/F.
    pub shown: DVector<f64>,
    /// Steps of which the derivative is none: that failed or are wild, or touch in a way that is not known as a function of
    /// the poses.
    pub blind: u32,
    /// Steps that took a part of their restitution, which is taken for a constant.
    pub limited: u32,
}

/// Errors below this count as it: the weights of exact data would be infinite.
const LEAST: f64 = 1e-9;

/// One toss with these values, and how its loss changes with the `parameters`.
///
/// # Errors
/// As [`rollout`](super::rollout::rollout); a step that has no derivative.
pub fn slopes(
    (model, protocol): (&Model, &Protocol),
    (values, parameters, loss): (&ParameterValues, &[Parameter], Loss),
    toss: &Toss,
    interrupt: &Arc<AtomicBool>,
) -> Result<TossSlopes, FitError> {
    let count = parameters.len();
    let ways: Vec<Vec<(Constant, Vec<f64>)>> =
        parameters.iter().map(|&parameter| model.slope(parameter, values)).collect();
    let mut derivative = StepDerivative::new();
    let mut moving = vec![vec![StateChange::zero(); toss.bodies]; count];
    let mut next = Vec::new();
    let mut found = TossSlopes {
        loss: 0.0,
        gradient: DVector::zeros(count),
        matrix: DMatrix::zeros(count, count),
        bend: DMatrix::zeros(count, count),
        shown: DVector::zeros(count),
        blind: 0,
        limited: 0,
    };
    let mut each = |seen: Seen<'_>| match seen {
        Seen::Step(simulation, record) => {
            simulation.linearise(record, &mut derivative)?;
            let unsolved = matches!(record.report.status.name(), "failed" | "wild");
            found.blind += u32::from(unsolved || derivative.unknown() > 0);
            found.limited += u32::from(record.restitution_share < 1.0);
            for (moving, ways) in moving.iter_mut().zip(&ways) {
                let constants: Vec<_> =
                    ways.iter().map(|(constant, way)| (*constant, &way[..])).collect();
                let change = StepChange { states: moving, wrenches: &[], constants: &constants };
                derivative.push(&change, &mut next)?;
                std::mem::swap(moving, &mut next);
            }
            Ok(())
        }
        Seen::Frame(recorded, states) => {
            for (body, (recorded, state)) in recorded.iter().zip(states).enumerate() {
                let turn = turn_between(&recorded.attitude, &state.attitude);
                let to_turn = turn_slope(&turn);
                let part = |of: &dyn Fn(&StateChange) -> Vector3<f64>| {
                    let columns: Vec<_> = moving.iter().map(|change| of(&change[body])).collect();
                    Matrix3xX::from_columns(&columns)
                };
                let place = (state.position - recorded.position) / (protocol.length * DISTANCE);
                let by_place = part(&|change| change.position / (protocol.length * DISTANCE));
                let by_turn = part(&|change| to_turn * change.turn / ANGLE);
                for (error, by) in [(place, by_place), (turn / ANGLE, by_turn)] {
                    for (shown, by) in found.shown.iter_mut().zip(by.column_iter()) {
                        *shown += by.norm();
                    }
                    let size = error.norm().max(LEAST);
                    let along = by.tr_mul(&error) / size;
                    let square = by.tr_mul(&by);
                    found.bend += (&square - &along * along.transpose()) / size;
                    found.matrix += square / size;
                    found.gradient += along;
                }
            }
            Ok(())
        }
    };
    let starts = protocol.starts(toss);
    let score = follow(&starts, (model, protocol, values), toss, interrupt, &mut each)?;
    let frames = (toss.bodies * (toss.count() - protocol.start_frame(toss))) as f64;
    let share = loss.slope(&score) / frames;
    found.loss = loss.of(&score);
    found.shown /= frames;
    found.bend *= share;
    found.bend +=
        &found.gradient * found.gradient.transpose() * (loss.bend(&score) / (frames * frames));
    found.gradient *= share;
    found.matrix *= share;
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mechanics::quaternion::left;
    use nalgebra::Vector4;

    #[test]
    fn a_turn_changes_as_its_slope_says() {
        let about = |turn: Vector3<f64>| {
            let angle = turn.norm();
            let v = if angle > 0.0 { turn * ((0.5 * angle).sin() / angle) } else { turn };
            Vector4::new((0.5 * angle).cos(), v.x, v.y, v.z)
        };
        let first = about(Vector3::new(0.3, 0.1, -0.9));
        for turn in [
            Vector3::new(0.4, -0.2, 0.7),
            Vector3::new(2e-4, 1e-4, 0.0),
            Vector3::new(1.5, -2.0, 1.0),
        ] {
            let second = left(&first) * about(turn);
            let slope = turn_slope(&turn_between(&first, &second));
            for k in 0..3 {
                let unit = Vector3::<f64>::ith(k, 1e-6);
                let end = |by: Vector3<f64>| turn_between(&first, &(left(&second) * about(by)));
                let difference = (end(unit) - end(-unit)) / 2e-6;
                assert!((difference - slope.column(k)).norm() < 1e-8, "{turn} {k}");
            }
        }
    }
}
