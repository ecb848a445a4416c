//! The natural map of the contact law (N4), after Alart and Curnier (1991): the pieces that it has,
//! and each of them linearised (N5).
//!
//! Equation numbers are those of `docs/native-solver.md`.

use super::equations::{Answer, Candidate};
use nalgebra::{Matrix3, Vector3};

/// The contact law to be solved.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Law {
    /// ε in û = u + ε D p̂ (N6).
    pub(super) compliance: f64,
    /// Factor on ρ_t. The natural map has the same zeros for every one; a large one tells
    /// the directions of slips that are slow against the impulses.
    pub(super) sharpness: f64,
    /// A contact within this relative margin of its cone counts as sticking.
    pub(super) stick_margin: f64,
}

impl Law {
    /// No compliance.
    pub(super) const EXACT: Self = Self::with_compliance(0.0);

    pub(super) const fn with_compliance(compliance: f64) -> Self {
        Self { compliance, sharpness: 1.0, stick_margin: 0.0 }
    }
}

/// The piece of the natural map that a contact is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mode {
    Open,
    Stick,
    Slip,
}

/// One contact's arguments of the projections in the natural map (N4), with û = u + ε D p̂
/// and both split along and across the normal, p̂ = γ n + β:
///
/// ```text
/// γ − ρ_n û_n   and   β − ρ_t û_t
/// ```
#[derive(Debug, Clone, Copy)]
pub(super) struct Pull {
    /// û.
    u: Vector3<f64>,
    /// û_n.
    u_n: f64,
    /// γ.
    gamma: f64,
    /// β.
    beta: Vector3<f64>,
    rho_n: f64,
    rho_t: f64,
    /// γ − ρ_n û_n.
    normal: f64,
    /// β − ρ_t û_t.
    tangential: Vector3<f64>,
    /// Its length.
    size: f64,
}

impl Pull {
    #[inline]
    pub(super) fn new(
        law: &Law,
        candidate: &Candidate,
        u: &Vector3<f64>,
        impulse: &Vector3<f64>,
    ) -> Self {
        let n = &candidate.normal;
        let u = u + law.compliance * candidate.given(impulse);
        let (u_n, gamma) = (n.dot(&u), n.dot(impulse));
        let beta = impulse - n * gamma;
        let rho_n = candidate.normal_scale;
        let rho_t = candidate.tangential_scale * law.sharpness;
        let tangential = beta - rho_t * (u - n * u_n);
        let size = tangential.norm();
        Self { u, u_n, gamma, beta, rho_n, rho_t, normal: gamma - rho_n * u_n, tangential, size }
    }

    /// The impulse of both projections: n max(0, γ − ρ_n û_n) + Π(β − ρ_t û_t).
    pub(super) fn projected(&self, candidate: &Candidate) -> Vector3<f64> {
        let normal = self.normal.max(0.0);
        let radius = candidate.friction * normal;
        let shrink = if self.size > radius { radius / self.size } else { 1.0 };
        self.tangential * shrink + candidate.normal * normal
    }

    /// The natural map (N4), as a velocity:
    ///
    /// ```text
    /// n (γ − max(0, γ − ρ_n û_n))/ρ_n + (β − Π_{μ max(0, γ − ρ_n û_n)}(β − ρ_t û_t))/ρ_t
    /// ```
    #[inline]
    pub(super) fn natural_map(&self, candidate: &Candidate) -> Vector3<f64> {
        let normal = self.normal.max(0.0);
        let radius = candidate.friction * normal;
        let shrink = if self.size > radius { radius / self.size } else { 1.0 };
        let tangential = (self.beta - shrink * self.tangential) / self.rho_t;
        tangential + candidate.normal * ((self.gamma - normal) / self.rho_n)
    }

    /// The piece of the natural map; within `stick_margin` of the cone it is stick.
    pub(super) fn mode(&self, candidate: &Candidate, stick_margin: f64) -> Mode {
        if self.normal <= 0.0 {
            Mode::Open
        } else if self.size <= candidate.friction * (1.0 + stick_margin) * self.normal {
            Mode::Stick
        } else {
            Mode::Slip
        }
    }

    /// The piece `mode` linearised and solved for the impulse, with ε = `compliance`.
    #[inline(always)]
    pub(super) fn answer(
        &self,
        mode: Mode,
        candidate: &Candidate,
        impulse: &Vector3<f64>,
        compliance: f64,
    ) -> Answer {
        match mode {
            Mode::Open => Answer::open(impulse),
            Mode::Stick => {
                let stiffness = 1.0 / compliance;
                if candidate.gives_alike() {
                    return Answer::stick(-stiffness * self.u, stiffness);
                }
                // δp̂ = −D⁻¹ (û + δu)/ε
                let n = &candidate.normal;
                let across = stiffness / candidate.give;
                let along = n * n.transpose() * (stiffness - across);
                let springs = Matrix3::from_diagonal_element(across) + along;
                Answer::full(-springs * self.u, -springs)
            }
            Mode::Slip => {
                let (offset, gain) = self.linearise_slip(candidate, compliance);
                Answer::full(offset, gain)
            }
        }
    }

    /// The slip piece linearised and solved for the impulse (N5): (offset, gain) of
    /// δp̂ = offset + gain · δu, with δû = δu + ε D δp̂ and ε = `compliance`.
    ///
    /// û_n = 0, and β = μ (γ − ρ_n û_n) t with t the direction of the pull β − ρ_t û_t. By
    /// δû_n = −û_n and δt = s sᵀ (δβ − ρ_t δû_t)/|pull|, s = n × t.
    fn linearise_slip(
        &self,
        candidate: &Candidate,
        compliance: f64,
    ) -> (Vector3<f64>, Matrix3<f64>) {
        let stiffness = 1.0 / compliance;
        let (n, friction) = (&candidate.normal, candidate.friction);
        let size = self.size.max(f64::MIN_POSITIVE);
        let t = self.tangential / size;
        let s = n.cross(&t);
        let bend = (friction * self.normal / size).min(1.0);
        let across = 1.0 - bend + self.rho_t * (compliance * candidate.give) * bend;
        let normal_offset = -stiffness * self.u_n;
        let along = friction * (self.gamma + normal_offset) - t.dot(&self.beta);
        let sideways = -s.dot(&self.beta) / across;
        let turn = (-self.rho_t * bend / across) * s * s.transpose();
        let press = (-stiffness * friction) * t - stiffness * n;
        (along * t + sideways * s + normal_offset * n, turn + press * n.transpose())
    }
}
