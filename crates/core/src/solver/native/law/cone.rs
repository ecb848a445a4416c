//! Law of a contact: natural map (N4) of Alart and Curnier (1991), its pieces and their
//! linearisation (N5).
//!
//! Equation numbers refer to `docs/native-solver.md`.

use super::local_solution::{Factored, LocalSolution};
use super::map::{MapPiece, NaturalMap};
use super::moment::Load;
use super::rows::CouplingRows;
use nalgebra::{Matrix3, Vector3};

/// Hard contact with Coulomb's circular friction cone and maximum dissipation.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cone {
    /// Friction coefficient μ.
    pub(crate) friction: f64,
}

/// Projection arguments of one contact in the natural map (N4).
///
/// With û = u + ε D p̂, both split along and across the normal, p̂ + â n = γ n + β with the adhesion â:
///
/// ```text
/// γ − ρ_n û_n   and   β − ρ_t û_t
/// ```
#[derive(Debug, Clone, Copy)]
pub(crate) struct ConeProjection {
    /// û (m/s).
    pub(super) u: Vector3<f64>,
    /// û_n (m/s).
    pub(super) u_n: f64,
    /// γ (m/s).
    pub(super) gamma: f64,
    /// β (m/s).
    pub(super) beta: Vector3<f64>,
    rho_n: f64,
    pub(super) rho_t: f64,
    /// γ − ρ_n û_n (m/s).
    pub(super) normal: f64,
    /// β − ρ_t û_t (m/s).
    pub(super) tangential: Vector3<f64>,
    /// Length of `tangential` (m/s).
    pub(super) size: f64,
    /// Friction coefficient μ.
    pub(super) friction: f64,
}

impl ConeProjection {
    #[inline]
    pub(super) fn new(
        map: &NaturalMap,
        rows: &CouplingRows,
        cone: &Cone,
        u: &Vector3<f64>,
        impulse: &Vector3<f64>,
    ) -> Self {
        let n = &rows.normal();
        let u = u + map.compliance * rows.compliant_motion(map.compliance, impulse);
        let u_n = n.dot(&u);
        let along = n.dot(impulse);
        let gamma = along + rows.adhesion;
        let beta = impulse - n * along;
        let rho_n = rows.scale[2];
        let rho_t = rows.scale[0] * map.tangential_factor;
        let tangential = beta - rho_t * (u - n * u_n);
        let size = tangential.norm();
        let (normal, friction) = (gamma - rho_n * u_n, cone.friction);
        Self { u, u_n, gamma, beta, rho_n, rho_t, normal, tangential, size, friction }
    }

    /// Natural map (N4) as a velocity (m/s):
    ///
    /// ```text
    /// n (γ − max(0, γ − ρ_n û_n))/ρ_n + (β − Π_{μ max(0, γ − ρ_n û_n)}(β − ρ_t û_t))/ρ_t
    /// ```
    #[inline]
    pub(super) fn natural_map(&self, rows: &CouplingRows) -> Vector3<f64> {
        let normal = self.normal.max(0.0);
        let radius = self.friction * normal;
        let shrink = if self.size > radius { radius / self.size } else { 1.0 };
        let tangential = (self.beta - shrink * self.tangential) / self.rho_t;
        tangential + rows.normal() * ((self.gamma - normal) / self.rho_n)
    }

    /// Normal impulse, and that of the projection argument.
    pub(super) fn load(&self) -> Load {
        Load { impulse: self.gamma, projected: self.normal.max(0.0) }
    }

    /// Piece of the natural map.
    pub(super) fn piece(&self) -> MapPiece {
        if self.normal <= 0.0 {
            MapPiece::Open
        } else if self.size <= self.friction * self.normal {
            MapPiece::Stick
        } else {
            MapPiece::Slip
        }
    }

    /// Absolute gap speed of a loaded contact (m/s).
    pub(super) fn held_speed(&self) -> f64 {
        if self.gamma > 0.0 { self.u_n.abs() } else { 0.0 }
    }

    /// Distance of the arguments to the next piece, each in its own scale (m/s).
    pub(super) fn margin(&self) -> f64 {
        let open = self.normal.abs() / self.rho_n;
        if self.normal <= 0.0 {
            return open;
        }
        open.min((self.size - self.friction * self.normal).abs() / self.rho_t)
    }

    /// Local solution on the `piece`, with ε = `compliance`.
    #[inline(always)]
    pub(super) fn local_solution(
        &self,
        piece: MapPiece,
        rows: &CouplingRows,
        impulse: &Vector3<f64>,
        compliance: f64,
    ) -> LocalSolution {
        match piece {
            MapPiece::Open => LocalSolution::open(impulse, rows),
            MapPiece::Stick => {
                let stiffness = 1.0 / compliance;
                if rows.is_isotropic() {
                    return LocalSolution::stick(-stiffness * self.u, stiffness);
                }
                // δp̂ = −D⁻¹ (û + δu)/ε
                let n = &rows.normal();
                let across = stiffness / rows.ratio_at(compliance);
                let along = n * n.transpose() * (stiffness - across);
                let springs = Matrix3::from_diagonal_element(across) + along;
                LocalSolution::full(-springs * self.u, -springs)
            }
            MapPiece::Slip | MapPiece::Axes(_) | MapPiece::Moment { .. } => {
                let (offset, gain) = self.linearise_slip(rows, compliance);
                LocalSolution::full(offset, gain)
            }
        }
    }

    /// Local solution on the slip piece (N5): (offset, gain) of δp̂ = offset + gain · δu, with δû =
    /// δu + ε D δp̂ and ε = `compliance`.
    ///
    /// The piece is û_n = 0 and β = μ (γ − ρ_n û_n) t, with t the direction of the projection
    /// argument β − ρ_t û_t. Its changes are δû_n = −û_n and δt = s sᵀ (δβ − ρ_t δû_t)/|β − ρ_t
    /// û_t|, s = n × t.
    fn linearise_slip(&self, rows: &CouplingRows, compliance: f64) -> (Vector3<f64>, Matrix3<f64>) {
        let Slip { t, s, n, across, turn, stiffness } = self.slip(rows, compliance);
        let friction = self.friction;
        let normal_offset = -stiffness * self.u_n;
        let along = friction * (self.gamma + normal_offset) - t.dot(&self.beta);
        let sideways = -s.dot(&self.beta) / across;
        let press = (-stiffness * friction) * t - stiffness * n;
        (
            along * t + sideways * s + normal_offset * n,
            turn * s * s.transpose() + press * n.transpose(),
        )
    }

    /// Offset of the slip piece for use with the `gain` D of another point, whose direction t
    /// differs:
    ///
    /// ```text
    /// μ (γ − û_n/ε) t − û_n/ε n  →  μ γ t + D n û_n
    /// ```
    ///
    /// The term D δu cancels û_n/ε along the old t. An offset along the new t would leave the
    /// difference as an impulse.
    pub(super) fn slip_offset(
        &self,
        rows: &CouplingRows,
        compliance: f64,
        gain: &Matrix3<f64>,
    ) -> Vector3<f64> {
        let Slip { t, s, n, across, .. } = self.slip(rows, compliance);
        let along = self.friction * self.gamma - t.dot(&self.beta);
        let sideways = -s.dot(&self.beta) / across;
        along * t + sideways * s + gain * (n * self.u_n)
    }

    /// t: direction of the tangential projection argument.
    #[inline(always)]
    pub(super) fn direction(&self) -> Vector3<f64> {
        self.tangential / self.size.max(f64::MIN_POSITIVE)
    }

    /// b = μ (γ − ρ_n û_n)/|β − ρ_t û_t|, at most 1.
    #[inline(always)]
    pub(super) fn bend(&self) -> f64 {
        (self.friction * self.normal / self.size.max(f64::MIN_POSITIVE)).min(1.0)
    }

    /// Axes of the slip piece and its coefficients along them.
    #[inline(always)]
    fn slip(&self, rows: &CouplingRows, compliance: f64) -> Slip {
        let n = rows.normal();
        let t = self.direction();
        let bend = self.bend();
        let across = 1.0 - bend + self.rho_t * (compliance * rows.ratio_at(compliance)) * bend;
        let turn = -self.rho_t * bend / across;
        Slip { t, s: n.cross(&t), n, across, turn, stiffness: 1.0 / compliance }
    }

    /// Factored gain of the `piece`, with ε = `compliance`.
    ///
    /// A sticking contact has springs along n and across it. A slipping contact has, with t, s and
    /// n as above,
    ///
    /// ```text
    /// D = (−ρ_t bend/across) s sᵀ − (n + μ t) nᵀ/ε
    /// ```
    pub(super) fn factored(
        &self,
        piece: MapPiece,
        rows: &CouplingRows,
        compliance: f64,
    ) -> Factored {
        match piece {
            MapPiece::Open => Factored::nothing(),
            MapPiece::Stick => Factored::along(&rows.frame, rows.springs(compliance)),
            MapPiece::Slip | MapPiece::Axes(_) | MapPiece::Moment { .. } => {
                let Slip { t, s, n, turn, stiffness, .. } = self.slip(rows, compliance);
                Factored {
                    to: Matrix3::from_columns(&[t, s, n + t * self.friction]),
                    gains: Vector3::new(0.0, turn, -stiffness),
                    from: Matrix3::from_columns(&[t, s, n]),
                }
            }
        }
    }
}

/// Slip piece of (N5).
///
/// - `t`: direction of the projection argument; `s` = n × t.
/// - `across`: divisor of the sideways offset.
/// - `turn`: gain along s.
/// - `stiffness`: 1/ε.
struct Slip {
    t: Vector3<f64>,
    s: Vector3<f64>,
    n: Vector3<f64>,
    across: f64,
    turn: f64,
    stiffness: f64,
}

#[cfg(test)]
#[path = "tests/cone.rs"]
mod tests;
