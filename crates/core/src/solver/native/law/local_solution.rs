//! Local solution of a coupling: its law solved for the impulse.

use super::rows::CouplingRows;
use nalgebra::{Matrix3, Vector3};

/// Local solution of one coupling for its impulse (N5): δp̂ = offset + gain · δu.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LocalSolution {
    pub(crate) offset: Vector3<f64>,
    pub(crate) gain: Gain,
}

/// Slope of the impulse with respect to the motion of the point: the gain D of (N5).
#[derive(Debug, Clone, Copy)]
pub(crate) enum Gain {
    /// Open coupling.
    Zero,
    /// Sticking coupling with isotropic stiffness k: −k E.
    Spring(f64),
    Full(Matrix3<f64>),
    /// Moment of a contact.
    Moment(MomentGain),
}

/// Gain D of a contact's moment, which is symmetric, and the change of the moment with the normal
/// impulse γ of its contact.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MomentGain {
    /// D₁₁, D₂₁, D₂₂, D₃₁, D₃₂ and D₃₃. Six numbers make this as large as a [`Gain::Full`].
    lower: [f64; 6],
    /// ∂p̂/∂γ.
    pub(crate) by_load: Vector3<f64>,
}

impl MomentGain {
    pub(super) fn new(gain: &Matrix3<f64>, by_load: Vector3<f64>) -> Self {
        let at = |i: usize, j: usize| gain[(i, j)];
        Self { lower: [at(0, 0), at(1, 0), at(1, 1), at(2, 0), at(2, 1), at(2, 2)], by_load }
    }

    /// D.
    pub(crate) fn matrix(&self) -> Matrix3<f64> {
        let [a, b, c, d, e, f] = self.lower;
        Matrix3::new(a, b, d, b, c, e, d, e, f)
    }
}

impl LocalSolution {
    /// Open coupling: p̂ = −â n.
    pub(crate) fn open(impulse: &Vector3<f64>, rows: &CouplingRows) -> Self {
        let offset =
            if rows.adhesion == 0.0 { -impulse } else { -impulse - rows.normal() * rows.adhesion };
        Self { offset, gain: Gain::Zero }
    }

    /// Spring with the same `stiffness` in all directions.
    pub(crate) fn stick(offset: Vector3<f64>, stiffness: f64) -> Self {
        Self { offset, gain: Gain::Spring(stiffness) }
    }

    /// Local solution of a moment.
    pub(super) fn moment(offset: Vector3<f64>, gain: MomentGain) -> Self {
        Self { offset, gain: Gain::Moment(gain) }
    }

    /// Local solution with a full gain.
    pub(crate) fn full(offset: Vector3<f64>, gain: Matrix3<f64>) -> Self {
        Self { offset, gain: Gain::Full(gain) }
    }
}

impl Gain {
    /// D as a matrix. `None` for an open coupling.
    pub(crate) fn matrix(&self) -> Option<Matrix3<f64>> {
        match self {
            Self::Zero => None,
            Self::Spring(stiffness) => Some(Matrix3::from_diagonal_element(-stiffness)),
            Self::Full(gain) => Some(*gain),
            Self::Moment(gain) => Some(gain.matrix()),
        }
    }

    /// Gain of the first row alone.
    pub(crate) fn first(&self) -> f64 {
        match self {
            Self::Zero => 0.0,
            Self::Spring(stiffness) => -stiffness,
            Self::Full(gain) => gain[(0, 0)],
            Self::Moment(gain) => gain.lower[0],
        }
    }
}

/// Factored gain D = T diag(g) Fᵀ.
///
/// A motion that a stiff row does not measure then contributes exactly zero. The entries of D would
/// leave a rounding error.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Factored {
    /// T: impulse directions of the rows.
    pub(crate) to: Matrix3<f64>,
    pub(crate) gains: Vector3<f64>,
    /// F: the rows, an orthonormal frame.
    pub(crate) from: Matrix3<f64>,
}

impl Factored {
    /// Zero gain of an open coupling.
    pub(crate) fn nothing() -> Self {
        Self::along(&Matrix3::identity(), Vector3::zeros())
    }

    /// Independent gains along the axes `frame`.
    pub(crate) fn along(frame: &Matrix3<f64>, gains: Vector3<f64>) -> Self {
        Self { to: *frame, gains, from: *frame }
    }
}
