//! Two small nonlinear functions of the step problem and their derivatives.

use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};

/// Smoothed friction force f_xy of one contact (eq. 11):
///
/// ```text
/// ρ = √(f·f + ε²),   ‖f‖_ε = ρ − ε,   d = f / (‖f‖_ε + ε) = f / ρ
/// ```
///
/// d is both the gradient of ‖f‖_ε and the direction in the dissipation rows. Its Jacobian D is
/// therefore also the Hessian of ‖f‖_ε.
#[derive(Debug, Clone, Copy)]
pub(super) struct SmoothForce {
    f: Vector2<f64>,
    rho: f64,
    /// Smoothed norm ‖f‖_ε, N.
    pub(super) norm: f64,
    /// Direction d, dimensionless.
    pub(super) direction: Vector2<f64>,
}

impl SmoothForce {
    pub(super) fn new(f: Vector2<f64>, epsilon: f64) -> Self {
        let squared = f.norm_squared();
        let rho = (squared + epsilon * epsilon).sqrt();
        // ρ − ε without the cancellation at small f.
        Self { f, rho, norm: squared / (rho + epsilon), direction: f / rho }
    }

    /// D = ∂d/∂f = (E − d dᵀ)/ρ (eq. D3).
    pub(super) fn direction_jacobian(&self) -> Matrix2<f64> {
        let d = self.direction;
        (Matrix2::identity() - d * d.transpose()) / self.rho
    }

    /// ∇²(y·d) = (3 (y·d) d dᵀ − (y·d) E − y dᵀ − d yᵀ)/ρ² (eq. D4).
    pub(super) fn direction_hessian(&self, y: Vector2<f64>) -> Matrix2<f64> {
        let d = self.direction;
        let along = y.dot(&self.f) / self.rho;
        (3.0 * along * d * d.transpose()
            - Matrix2::identity() * along
            - y * d.transpose()
            - d * y.transpose())
            / (self.rho * self.rho)
    }
}

/// Normalised attitude u = p/|p| of the attitude row: value and derivatives at p.
#[derive(Debug, Clone, Copy)]
pub(super) struct Normalised {
    /// Unit vector u.
    pub(super) unit: Vector4<f64>,
    norm: f64,
}

impl Normalised {
    pub(super) fn new(p: Vector4<f64>) -> Self {
        let norm = p.norm();
        Self { unit: p / norm, norm }
    }

    /// ∂u/∂p = (E − u uᵀ)/|p| (eq. D1).
    pub(super) fn jacobian(&self) -> Matrix4<f64> {
        (Matrix4::identity() - self.unit * self.unit.transpose()) / self.norm
    }

    /// ∇²(y·u) = (3 (y·u) u uᵀ − (y·u) E − y uᵀ − u yᵀ)/|p|² (eq. D2).
    pub(super) fn hessian(&self, y: Vector4<f64>) -> Matrix4<f64> {
        let u = self.unit;
        let along = y.dot(&u);
        (3.0 * along * u * u.transpose()
            - Matrix4::identity() * along
            - y * u.transpose()
            - u * y.transpose())
            / (self.norm * self.norm)
    }
}
