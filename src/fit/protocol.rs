//! Where a simulation starts, and how it is compared: of tosses by the protocol after Acosta, Yang and Posa,
//! "Validating robotics simulators on real-world impacts", IEEE RA-L 7(3), 2022; of several bodies from the first frame on.

use super::model::Model;
use super::recording::Toss;
use crate::mechanics::State;
use nalgebra::{SVector, Vector3, Vector4};

/// The constants of the protocol. They are of the scene, not of the values that are tried: else a
/// fit could better its score by starting elsewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct Protocol {
    /// Where simulations start.
    pub begin: Begin,
    /// The length that distances are told in, m: the longest side.
    pub length: f64,
    /// Substeps of a frame: h = 1 / (rate · substeps).
    pub substeps: usize,
}

/// Where a simulation starts.
#[derive(Debug, Clone, PartialEq)]
pub enum Begin {
    /// In the first frame, as it is recorded.
    AtFirst,
    /// A little before the body may touch, with velocities of all frames before.
    AtTouch {
        /// The height of the centre below which the body may touch, m: the half diagonal of its box.
        height: f64,
        /// g, m/s².
        gravity: f64,
        /// So many frames before the one that may touch.
        lead: usize,
    },
}

/// From this frame on there are enough before it to refit the velocities.
const LEAST_FRAMES: usize = 4;

impl Protocol {
    /// The protocol of a scene.
    #[must_use]
    pub fn new(model: &Model, substeps: usize) -> Self {
        let begin = match model.is_of_tosses() {
            false => Begin::AtFirst,
            true => {
                let (height, gravity) = (model.extents().norm(), model.gravity().norm());
                Begin::AtTouch { height, gravity, lead: 3 }
            }
        };
        Self { begin, length: model.length(), substeps }
    }

    /// The frame that a simulation starts from: the first one, or `lead` before the first whose centre is at the
    /// touch height or below, the first frame at the earliest.
    #[must_use]
    pub fn start_frame(&self, toss: &Toss) -> usize {
        let Begin::AtTouch { height, lead, .. } = self.begin else { return 0 };
        let low = |frame: &State| frame.position.z <= height;
        let touch = toss.frames.iter().position(low).unwrap_or(0);
        touch.saturating_sub(lead).min(toss.frames.len().saturating_sub(2))
    }

    /// The states that a simulation starts from, one a body: the recorded ones of the first frame, or
    /// [`Protocol::start`].
    #[must_use]
    pub fn starts(&self, toss: &Toss) -> Vec<State> {
        match self.begin {
            Begin::AtFirst => toss.frame(0).to_vec(),
            Begin::AtTouch { .. } => vec![self.start(toss)],
        }
    }

    /// The start of a toss at frame `i`, `start_frame`. Recorded velocities are backward
    /// differences, median filtered; where there are four frames before it they are found anew from
    /// all of them, with t_k = k / rate:
    ///
    /// ```text
    /// ω = log(q₀* q_i) / t_i
    /// v_xy = (x_{i−1} − x₀) / t_{i−1}
    /// z_k + g t_k²/2 ≈ a + b t_k  (k = 0 … i − 1, least squares),  v_z = b − g t_{i−1}
    /// ```
    ///
    /// That v_z is the speed at frame i − 1, a frame before the position; by it the published
    /// figures are reproduced. Of a toss without frames it is NaN throughout.
    #[must_use]
    pub fn start(&self, toss: &Toss) -> State {
        let (i, frames) = (self.start_frame(toss), &toss.frames);
        let Some(&(mut state)) = frames.get(i) else {
            return State::from_vector(&SVector::repeat(f64::NAN));
        };
        let Begin::AtTouch { gravity, .. } = self.begin else { return state };
        if i < LEAST_FRAMES {
            return state;
        }
        let time = |k: usize| k as f64 / toss.rate;
        state.spin = turn_between(&frames[0].attitude, &state.attitude) / time(i);
        let mean = (frames[i - 1].position - frames[0].position) / time(i - 1);
        state.velocity.x = mean.x;
        state.velocity.y = mean.y;
        let height = |k: usize| frames[k].position.z + 0.5 * gravity * time(k).powi(2);
        state.velocity.z = slope((0..i).map(|k| (time(k), height(k)))) - gravity * time(i - 1);
        state
    }
}

/// The least-squares slope through points (t, y).
fn slope(points: impl Iterator<Item = (f64, f64)> + Clone) -> f64 {
    let n = points.clone().count() as f64;
    let (t, y) = points.clone().fold((0.0, 0.0), |sum, point| (sum.0 + point.0, sum.1 + point.1));
    let (t, y) = (t / n, y / n);
    let (ty, tt) = points.fold((0.0, 0.0), |sum, point| {
        (sum.0 + (point.0 - t) * (point.1 - y), sum.1 + (point.0 - t).powi(2))
    });
    ty / tt
}

/// log(a* b), rad, in the frame of a: the turn from attitude `a` to `b`, the shorter way.
#[must_use]
pub fn turn_between(a: &Vector4<f64>, b: &Vector4<f64>) -> Vector3<f64> {
    let (u, v) = (Vector3::new(a[1], a[2], a[3]), Vector3::new(b[1], b[2], b[3]));
    let mut scalar = a[0] * b[0] + u.dot(&v);
    let mut vector = a[0] * v - b[0] * u - u.cross(&v);
    if scalar < 0.0 {
        (scalar, vector) = (-scalar, -vector);
    }
    let sine = vector.norm();
    if sine == 0.0 { vector } else { vector * (2.0 * sine.atan2(scalar) / sine) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_turn_between_attitudes_is_told_in_the_first_ones_frame() {
        let about = |axis: Vector3<f64>, angle: f64| {
            let v = axis.normalize() * (0.5 * angle).sin();
            Vector4::new((0.5 * angle).cos(), v.x, v.y, v.z)
        };
        let product =
            |a: &Vector4<f64>, b: &Vector4<f64>| crate::mechanics::quaternion::left(a) * b;
        let first = about(Vector3::new(1.0, 2.0, -0.5), 1.1);
        let turn = Vector3::new(0.3, -0.2, 0.7);
        let second = product(&first, &about(turn, turn.norm()));
        assert!((turn_between(&first, &second) - turn).norm() < 1e-14);
        assert!((turn_between(&first, &-second) - turn).norm() < 1e-14, "the other sign");
        assert_eq!(turn_between(&first, &first), Vector3::zeros());
    }

    #[test]
    fn a_parabola_gives_its_slope() {
        let points = (0..7).map(|k| (0.1 * f64::from(k), 2.0 - 3.0 * 0.1 * f64::from(k)));
        assert!((slope(points) + 3.0).abs() < 1e-13);
    }
}
