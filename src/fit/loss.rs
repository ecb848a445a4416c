//! The loss: one number for how far simulated tosses are from recorded ones.

/// How far a simulated toss is from the recorded one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TossScore {
    /// The mean over frames and bodies of |Δr| / length.
    pub position: f64,
    /// The mean over frames and bodies of the angle between the attitudes, rad.
    pub rotation: f64,
    /// The largest angle of a body at the last frame, rad: about 90° or 180° on another face.
    pub end: f64,
    /// Steps taken, and those of them that failed.
    pub steps: u32,
    /// Steps that did not converge.
    pub failed: u32,
    /// The largest residual of a step, m/s.
    pub residual: f64,
}

/// How the errors of tosses become one number.
///
/// With p the mean distance in parts of the body's length and θ the mean angle of a toss,
///
/// ```text
/// e = p / 0.13 + θ / 17°
/// ```
///
/// the scales being what the best engines reach on the recorded cube, so that both count alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Loss {
    /// The mean of e / (1 + e/6): a toss that comes to rest on another face, where e is 5 to 15,
    /// counts two to four times a usual one and no more, however far off it is.
    #[default]
    Robust,
    /// The mean of e: what the mean errors say, chance included.
    Mean,
}

/// The scale of p.
pub(super) const DISTANCE: f64 = 0.13;
/// The scale of θ, rad.
pub(super) const ANGLE: f64 = 17.0 * std::f64::consts::PI / 180.0;
/// Where the robust loss bends.
const BEND: f64 = 6.0;

impl Loss {
    /// The loss of one toss.
    #[must_use]
    pub fn of(self, score: &TossScore) -> f64 {
        let e = score.position / DISTANCE + score.rotation / ANGLE;
        match self {
            Self::Robust => e / (1.0 + e / BEND),
            Self::Mean => e,
        }
    }

    /// The derivative of that by e.
    pub(super) fn slope(self, score: &TossScore) -> f64 {
        let e = score.position / DISTANCE + score.rotation / ANGLE;
        match self {
            Self::Robust => (1.0 + e / BEND).powi(-2),
            Self::Mean => 1.0,
        }
    }

    /// The second derivative of that by e.
    pub(super) fn bend(self, score: &TossScore) -> f64 {
        let e = score.position / DISTANCE + score.rotation / ANGLE;
        match self {
            Self::Robust => -2.0 / BEND * (1.0 + e / BEND).powi(-3),
            Self::Mean => 0.0,
        }
    }

    /// The mean over tosses.
    #[must_use]
    pub fn mean(self, scores: &[TossScore]) -> f64 {
        scores.iter().map(|score| self.of(score)).sum::<f64>() / scores.len() as f64
    }

    /// The word of the command line.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Robust => "robust",
            Self::Mean => "mean",
        }
    }
}
