//! What a law answers: a coupling solved for its impulse, and the gain of that.

use nalgebra::{Matrix3, Vector3};

/// One coupling solved for its impulse (N5): δp̂ = offset + gain · δu.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Answer {
    pub(in super::super) offset: Vector3<f64>,
    pub(in super::super) gain: Gain,
}

/// What an impulse gains by a change of its point's motion.
#[derive(Debug, Clone, Copy)]
pub(in super::super) enum Gain {
    /// An open coupling: nothing.
    Zero,
    /// A sticking one: −k E.
    Spring(f64),
    Full(Matrix3<f64>),
}

impl Answer {
    /// p̂ = 0.
    pub(in super::super) fn open(impulse: &Vector3<f64>) -> Self {
        Self { offset: -impulse, gain: Gain::Zero }
    }

    /// A spring of `stiffness` in all directions.
    pub(in super::super) fn stick(offset: Vector3<f64>, stiffness: f64) -> Self {
        Self { offset, gain: Gain::Spring(stiffness) }
    }

    /// Any gain.
    pub(in super::super) fn full(offset: Vector3<f64>, gain: Matrix3<f64>) -> Self {
        Self { offset, gain: Gain::Full(gain) }
    }
}

impl Gain {
    /// That of the first row by itself.
    pub(in super::super) fn first(&self) -> f64 {
        match self {
            Self::Zero => 0.0,
            Self::Spring(stiffness) => -stiffness,
            Self::Full(gain) => gain[(0, 0)],
        }
    }
}

/// A gain in its factors, D = T diag(g) Fᵀ, where what is large and what is nothing stand apart: a motion that a stiff row does
/// not see makes exactly nothing of it, which of the entries of D is only so to rounding.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Factored {
    /// T: the impulses of the rows.
    pub(in super::super) to: Matrix3<f64>,
    pub(in super::super) gains: Vector3<f64>,
    /// F: the rows, an orthonormal frame.
    pub(in super::super) from: Matrix3<f64>,
}

impl Factored {
    /// That of an open coupling.
    pub(in super::super) fn nothing() -> Self {
        Self::along(&Matrix3::identity(), Vector3::zeros())
    }

    /// Gains along the axes `frame`, each by itself.
    pub(in super::super) fn along(frame: &Matrix3<f64>, gains: Vector3<f64>) -> Self {
        Self { to: *frame, gains, from: *frame }
    }
}
