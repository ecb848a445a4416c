//! What an error is made of: the same toss from many starts within the noise of its recording.
//!
//! A start has the noise of a frame in place and attitude, and in the velocities what that noise
//! makes of the protocol's differences over the frames before it:
//!
//! ```text
//! σ_v = √2 σ_r / Δt,   σ_ω = √2 σ_θ / Δt,   Δt = the time that the velocity is taken over
//! ```
//!
//! Where the ensemble spreads, no model could say better which way the toss goes; where it does not
//! and is still far from the recording, the model (or a start that is off by more than noise) is to
//! blame.

use super::error::FitError;
use super::loss::{Loss, TossScore};
use super::model::Model;
use super::parameter::ParameterValues;
use super::protocol::Protocol;
use super::recording::Toss;
use super::rollout::rollout_from;
use crate::mechanics::State;
use crate::mechanics::quaternion::left;
use nalgebra::{Vector3, Vector4};
use rand_mt::Mt;
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// The noise of a recorded frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Noise {
    /// σ_r, m, of each coordinate.
    pub position: f64,
    /// σ_θ, rad, about each axis.
    pub attitude: f64,
}

/// One toss from many starts.
#[derive(Debug, Clone, PartialEq)]
pub struct Ensemble {
    /// The scores of its members.
    pub scores: Vec<TossScore>,
    /// The member of least loss.
    pub best: TossScore,
    /// Where the members end: the root mean square distance from their mean, m.
    pub spread: f64,
    /// Whether members end on the recorded face, and others do not.
    pub divided: bool,
}

/// Above this angle at the end, rad, a toss lies on another face.
const OTHER_FACE: f64 = std::f64::consts::FRAC_PI_4;

/// Every toss from `members` starts within `noise`, the first without any.
///
/// # Errors
/// No members; an interrupt; a toss that cannot be simulated.
#[expect(clippy::too_many_arguments, reason = "what a roll-out needs, and how it is varied")]
pub fn ensembles(
    model: &Model,
    protocol: &Protocol,
    values: &ParameterValues,
    tosses: &[Toss],
    members: usize,
    noise: Noise,
    seed: u32,
    interrupt: &Arc<AtomicBool>,
) -> Result<Vec<Ensemble>, FitError> {
    if members == 0 {
        return Err(FitError::Request("an ensemble needs a member".to_owned()));
    }
    if !model.is_of_tosses() {
        let why = "an ensemble is of the starts of tosses; a recording of several bodies has none";
        return Err(FitError::Request(why.to_owned()));
    }
    let one = |(index, toss): (usize, &Toss)| {
        let mut draws = Mt::new(seed.wrapping_add(index as u32).wrapping_mul(0x9e37_79b9));
        let start = protocol.start(toss);
        let (mut scores, mut ends) = (Vec::new(), Vec::new());
        for member in 0..members {
            let start = match member {
                0 => start,
                _ => varied(&start, protocol.start_frame(toss), toss.rate, noise, &mut draws),
            };
            let mut end = start.position;
            let each = |states: &[State]| end = states[0].position;
            let found = rollout_from(&[start], model, protocol, values, toss, interrupt, each)?;
            scores.push(found);
            ends.push(end);
        }
        let mean = ends.iter().sum::<Vector3<f64>>() / members as f64;
        let square = ends.iter().map(|end| (end - mean).norm_squared()).sum::<f64>();
        let other = scores.iter().filter(|score| score.end > OTHER_FACE).count();
        let least = |best: TossScore, score: &TossScore| {
            if Loss::Mean.of(score) < Loss::Mean.of(&best) { *score } else { best }
        };
        Ok(Ensemble {
            best: scores.iter().fold(scores[0], least),
            spread: (square / members as f64).sqrt(),
            divided: other > 0 && other < members,
            scores,
        })
    };
    tosses.par_iter().enumerate().map(one).collect()
}

/// A start with noise; `frame` is where it is taken from.
fn varied(start: &State, frame: usize, rate: f64, noise: Noise, draws: &mut Mt) -> State {
    let time = frame.saturating_sub(1).max(1) as f64 / rate;
    let mut normal = |size: f64| Vector3::from_fn(|_, _| size * gauss(draws));
    let speed = 2f64.sqrt() / time;
    let turn = 0.5 * normal(noise.attitude);
    let turn = Vector4::new(1.0, turn.x, turn.y, turn.z).normalize();
    State {
        position: start.position + normal(noise.position),
        attitude: left(&start.attitude) * turn,
        velocity: start.velocity + normal(noise.position * speed),
        spin: start.spin + normal(noise.attitude * speed),
    }
}

/// A draw of the normal distribution, by Box and Muller.
fn gauss(draws: &mut Mt) -> f64 {
    let mut unit = || (f64::from(draws.next_u32()) + 0.5) / 4_294_967_296.0;
    (-2.0 * unit().ln()).sqrt() * (std::f64::consts::TAU * unit()).cos()
}
