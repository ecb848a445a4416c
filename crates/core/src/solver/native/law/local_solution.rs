//! Local solution of a coupling: its law solved for the impulse.

use nalgebra::{Matrix3, Vector3};

/// Local solution of one coupling for its impulse (N5): δp̂ = offset + gain · δu.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct LocalSolution {
    pub(in super::super) offset: Vector3<f64>,
    pub(in super::super) gain: Gain,
}

/// Slope of the impulse with respect to the motion of the point: the gain D of (N5).
#[derive(Debug, Clone, Copy)]
pub(in super::super) enum Gain {
    /// Open coupling.
    Zero,
    /// Sticking coupling with isotropic stiffness k: −k E.
    Spring(f64),
    Full(Matrix3<f64>),
}

impl LocalSolution {
    /// Open coupling: p̂ = 0.
    pub(in super::super) fn open(impulse: &Vector3<f64>) -> Self {
        Self { offset: -impulse, gain: Gain::Zero }
    }

    /// Spring with the same `stiffness` in all directions.
    pub(in super::super) fn stick(offset: Vector3<f64>, stiffness: f64) -> Self {
        Self { offset, gain: Gain::Spring(stiffness) }
    }

    /// Local solution with a full gain.
    pub(in super::super) fn full(offset: Vector3<f64>, gain: Matrix3<f64>) -> Self {
        Self { offset, gain: Gain::Full(gain) }
    }
}

impl Gain {
    /// Gain of the first row alone.
    pub(in super::super) fn first(&self) -> f64 {
        match self {
            Self::Zero => 0.0,
            Self::Spring(stiffness) => -stiffness,
            Self::Full(gain) => gain[(0, 0)],
        }
    }
}

/// Factored gain D = T diag(g) Fᵀ.
///
/// A motion that a stiff row does not measure then contributes exactly zero. The entries of D would
/// leave a rounding error.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Factored {
    /// T: impulse directions of the rows.
    pub(in super::super) to: Matrix3<f64>,
    pub(in super::super) gains: Vector3<f64>,
    /// F: the rows, an orthonormal frame.
    pub(in super::super) from: Matrix3<f64>,
}

impl Factored {
    /// Zero gain of an open coupling.
    pub(in super::super) fn nothing() -> Self {
        Self::along(&Matrix3::identity(), Vector3::zeros())
    }

    /// Independent gains along the axes `frame`.
    pub(in super::super) fn along(frame: &Matrix3<f64>, gains: Vector3<f64>) -> Self {
        Self { to: *frame, gains, from: *frame }
    }
}
