//! The contact law: hard contact, Coulomb's circular cone and maximum dissipation, and the residual
//! of a force and a motion.
//!
//! Impulses are divided by the mass of body A, p̂ = h f/m_A, so that they have units of velocity.
//! Equation numbers refer to `docs/formulation.md`.

use crate::mechanics::{RigidBody, largest};
use crate::world::ContactLaw;
use nalgebra::{Matrix3, Vector3};

/// Response of the touching point to an impulse, used as the contact's own scale.
///
/// W is the 3 × 3 response of the relative velocity of the touching point to an impulse, for both
/// bodies together, in the frame of the contact:
///
/// ```text
/// W = Σ (E/m + Gᵀ I⁻¹ G),  G = [y]× Aᵀ,   w_n = m_A W_nn,  w_t = m_A ½ tr W_tt    (eq. 18)
/// ```
///
/// The response is dimensionless. It is 1 for a point at the centre of a body that touches the
/// ground.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Response {
    /// w_n: response along the normal.
    pub normal: f64,
    /// w_t: mean response over both tangents.
    pub tangential: f64,
}

impl Response {
    /// Response of one body, times its own mass. `frame` has (t₁, t₂, n) as columns.
    pub(super) fn at_point(
        body: &RigidBody,
        torque_map: &Matrix3<f64>,
        frame: &Matrix3<f64>,
    ) -> Self {
        let torques = torque_map * frame;
        let inverse = body.specific_inertia_inverse();
        let answers =
            if body.is_isotropic() { torques * inverse[(0, 0)] } else { inverse * torques };
        let diagonal = |k: usize| 1.0 + torques.column(k).dot(&answers.column(k));
        Self { normal: diagonal(2), tangential: 0.5 * (diagonal(0) + diagonal(1)) }
    }

    pub(super) fn plus(&self, other: &Self) -> Self {
        Self { normal: self.normal + other.normal, tangential: self.tangential + other.tangential }
    }

    pub(super) fn times(&self, factor: f64) -> Self {
        Self { normal: factor * self.normal, tangential: factor * self.tangential }
    }
}

/// Residual of a contact's impulse and motion, each part in m/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LawResidual {
    /// Complementarity residual |min(w_n p_n, u_n)| (eq. 18c).
    pub normal: f64,
    /// Friction residual ‖w_t p_t − Π(w_t p_t − u_t)‖, with Π the projection on the disc of radius
    /// μ w_t max(p_n, 0) (eq. 18d).
    pub friction: f64,
    /// Cone violation max(0, w_t (‖p_t‖ − μ p_n)) (eq. 18e).
    pub cone: f64,
}

impl ContactLaw {
    /// Friction without restitution.
    pub const fn plastic(friction: f64) -> Self {
        Self { friction, static_friction: None, restitution: 0.0, adhesion: 0.0 }
    }

    /// Residual of the impulse `p` divided by the mass of A (m/s) and the motion `u` (m/s), in the
    /// same axes as the unit `normal`. [Adhesion](super::adhesion) adds to the normal impulse. NaN propagates.
    pub fn residual(
        &self,
        response: &Response,
        normal: &Vector3<f64>,
        p: &Vector3<f64>,
        u: &Vector3<f64>,
    ) -> LawResidual {
        let (along, u_n) = (normal.dot(p), normal.dot(u));
        let p_n = along + self.adhesion;
        // `f64::min` would drop a NaN.
        let complementarity = -largest(-response.normal * p_n, -u_n);
        let projection = response.tangential * (p - normal * along);
        let slip = u - normal * u_n;
        let radius = self.friction * response.tangential * largest(p_n, 0.0);
        let friction = (projection - project_on_disc(projection - slip, radius)).norm();
        let outside = projection.norm() - self.friction * response.tangential * p_n;
        LawResidual { normal: complementarity.abs(), friction, cone: largest(0.0, outside) }
    }
}

/// Π: closest point of the tangential disc of `radius` about the origin.
pub(crate) fn project_on_disc(point: Vector3<f64>, radius: f64) -> Vector3<f64> {
    let norm = point.norm();
    if norm > radius { point * (radius / norm) } else { point }
}

/// Closest number to `value` from −`limit` to `limit`. NaN propagates from `value`.
pub(crate) fn project_on_interval(value: f64, limit: f64) -> f64 {
    // `f64::clamp` panics for a NaN limit.
    if value.abs() > limit { limit.copysign(value) } else { value }
}

#[cfg(test)]
#[path = "tests/law.rs"]
mod tests;
