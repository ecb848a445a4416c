//! Rows of a coupling, as input of its law.

use crate::joint::Graph;
use crate::solver::native::settings::COMPLIANCE;
use nalgebra::{Matrix3, Vector3};

/// Axes of a coupling's rows and their scales.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CouplingRows {
    /// Axes as columns: (t₁, t₂, n) of a contact.
    pub(crate) frame: Matrix3<f64>,
    /// ρ of each row: inverse of its own response. Scales the natural map.
    pub(crate) scale: Vector3<f64>,
    /// κ: ratio of the compliance across the normal to the one along it (N6).
    pub(crate) compliance_ratio: f64,
    /// σ: friction along t₁ over that along t₂ (N18).
    pub(crate) stretch: f64,
    /// â = h a/M of a contact (m/s): the cone has the impulse p̂ + â n (eq. 48).
    pub(crate) adhesion: f64,
}

/// Rows of a coupling, and the graphs of the step for joint rows.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LawRows<'a> {
    pub(crate) rows: &'a CouplingRows,
    pub(crate) graphs: &'a [Graph],
}

impl CouplingRows {
    /// These rows with the same scale for all.
    pub(crate) fn with_scale(&self, scale: f64) -> Self {
        Self { scale: Vector3::repeat(scale), ..*self }
    }

    /// Rows of a contact along the axes `frame`, (t₁, t₂, n), with the responses `tangential` and
    /// `normal`.
    pub(crate) fn from_contact(frame: Matrix3<f64>, tangential: f64, normal: f64) -> Self {
        let across = 1.0 / tangential;
        Self::from_scale(frame, Vector3::new(across, across, 1.0 / normal))
    }

    fn from_scale(frame: Matrix3<f64>, scale: Vector3<f64>) -> Self {
        Self { frame, scale, compliance_ratio: 1.0, stretch: 1.0, adhesion: 0.0 }
    }

    /// Rows of a joint with isotropic compliance and the given `response` of each row.
    pub(crate) fn from_joint(frame: Matrix3<f64>, response: &Vector3<f64>) -> Self {
        Self::from_scale(frame, response.map(f64::recip))
    }

    /// Last axis: the normal n of a contact.
    #[inline(always)]
    pub(crate) fn normal(&self) -> Vector3<f64> {
        self.frame.column(2).into_owned()
    }

    /// True if the compliance is isotropic.
    pub(crate) fn is_isotropic(&self) -> bool {
        self.compliance_ratio == 1.0
    }

    /// Same rows with isotropic compliance.
    pub(crate) fn isotropic(&self) -> Self {
        Self { compliance_ratio: 1.0, ..*self }
    }

    /// κ with ε = `compliance`. Below the ε of the selection rule it falls to 1 with ε, because the
    /// proximal point method converges with ε κ over the response of the rows.
    #[inline]
    pub(crate) fn ratio_at(&self, compliance: f64) -> f64 {
        if compliance < COMPLIANCE {
            1.0 + (self.compliance_ratio - 1.0) * (compliance / COMPLIANCE)
        } else {
            self.compliance_ratio
        }
    }

    /// Gains −D⁻¹/ε of a sticking contact along the rows, with ε = `compliance`.
    pub(super) fn springs(&self, compliance: f64) -> Vector3<f64> {
        let along = -1.0 / compliance;
        let across = along / self.ratio_at(compliance);
        Vector3::new(across, across, along)
    }

    /// D p̂ = γ n + κ β (N6) of an impulse p̂ = γ n + β, with ε = `compliance`.
    #[inline]
    pub(crate) fn compliant_motion(&self, compliance: f64, impulse: &Vector3<f64>) -> Vector3<f64> {
        if self.is_isotropic() {
            return *impulse;
        }
        let (normal, ratio) = (self.normal(), self.ratio_at(compliance));
        impulse * ratio + normal * (normal.dot(impulse) * (1.0 - ratio))
    }
}
