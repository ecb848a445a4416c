//! Law of a contact's moment (N15): rolling and torsional resistance, within limits given by the normal
//! impulse of the contact.
//!
//! With the projection argument y = p̂ − ρ û and γ⁺ = max(0, γ − ρ_n û_n) of the contact,
//!
//! ```text
//! p̂_t = Π_{r γ⁺}(y_t),   p̂_n = clamp(y_n, −s γ⁺, s γ⁺),   r = μ_r/ℓ,   s = μ_s/ℓ     (N15)
//! ```
//!
//! Equation numbers refer to `docs/native-solver.md`.

use super::local_solution::{Factored, LocalSolution, MomentGain};
use super::map::{MapPiece, NaturalMap};
use super::rows::CouplingRows;
use crate::contact::law::project_on_interval;
use nalgebra::{Matrix3, Vector2, Vector3};

/// Limits of a contact's moment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MomentLaw {
    /// Index of the contact's coupling, which is before this one.
    pub(crate) contact: usize,
    /// r = μ_r/ℓ.
    pub(crate) rolling: f64,
    /// s = μ_s/ℓ.
    pub(crate) torsional: f64,
}

/// Normal impulse of a contact: γ, and γ⁺ of its projection argument (m/s).
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Load {
    pub(crate) impulse: f64,
    pub(crate) projected: f64,
}

/// Projection arguments of one moment, in the frame (t₁, t₂, n) of its contact.
#[derive(Debug, Clone, Copy)]
pub(crate) struct MomentProjection {
    /// r and s.
    limits: [f64; 2],
    load: Load,
    /// û (m/s).
    u: Vector3<f64>,
    /// p̂ (m/s).
    p: Vector3<f64>,
    /// ρ of the tangential rows and of the normal one.
    rho: [f64; 2],
}

impl MomentProjection {
    #[inline(never)]
    pub(super) fn new(
        map: &NaturalMap,
        rows: &CouplingRows,
        law: &MomentLaw,
        load: Load,
        u: &Vector3<f64>,
        impulse: &Vector3<f64>,
    ) -> Self {
        let u = rows.frame.tr_mul(&(u + map.compliance * impulse));
        let limits = [law.rolling, law.torsional];
        let rho = [rows.scale[0], rows.scale[2]];
        Self { limits, load, u, p: rows.frame.tr_mul(impulse), rho }
    }

    /// y (m/s).
    fn argument(&self) -> Vector3<f64> {
        let [across, along] = self.rho;
        self.p - Vector3::new(across * self.u[0], across * self.u[1], along * self.u[2])
    }

    /// |y_t| (m/s).
    fn size(&self) -> f64 {
        self.argument().xy().norm()
    }

    /// Limits r γ⁺ and s γ⁺ (m/s).
    fn limits(&self) -> (f64, f64) {
        let [rolling, torsional] = self.limits;
        (rolling * self.load.projected, torsional * self.load.projected)
    }

    /// Natural map (p̂ − P(y))/ρ (m/s).
    pub(super) fn natural_map(&self, rows: &CouplingRows) -> Vector3<f64> {
        let (rolling, torsional) = self.limits();
        let y = self.argument();
        let size = y.xy().norm();
        let shrink = if size > rolling { rolling / size } else { 1.0 };
        let along = project_on_interval(y[2], torsional);
        let asked = Vector3::new(shrink * y[0], shrink * y[1], along);
        rows.frame * (self.p - asked).component_div(&rows.scale)
    }

    pub(super) fn piece(&self) -> MapPiece {
        if self.load.projected <= 0.0 {
            return MapPiece::Open;
        }
        let (rolling, torsional) = self.limits();
        let spins = match self.argument()[2] {
            along if torsional > 0.0 && along.abs() <= torsional => 0,
            along if along < 0.0 => -1,
            _ => 1,
        };
        MapPiece::Moment { rolls: rolling == 0.0 || self.size() > rolling, spins }
    }

    /// Distance of the arguments to the next piece (m/s). Limits of zero have none.
    pub(super) fn margin(&self) -> f64 {
        let (rolling, torsional) = self.limits();
        let apart = |size: f64, limit: f64, rho: f64| {
            if limit > 0.0 { (size - limit).abs() / rho } else { f64::INFINITY }
        };
        let along = self.argument()[2].abs();
        apart(self.size(), rolling, self.rho[0]).min(apart(along, torsional, self.rho[1]))
    }

    /// Local solution on the `piece`, with ε = `compliance`.
    ///
    /// Rows within their limits have δp̂ = −(û + δu)/ε. On the disc, with t the direction of y_t, s = n × t
    /// and b = r γ⁺/|y_t|,
    ///
    /// ```text
    /// δp̂_t = (r γ − t·p̂) + r δγ,   δp̂_s = −(s·p̂ + ρ b s·δu)/(1 − b + ρ ε b)              (N16)
    /// ```
    pub(super) fn local_solution(
        &self,
        piece: MapPiece,
        rows: &CouplingRows,
        impulse: &Vector3<f64>,
        compliance: f64,
    ) -> LocalSolution {
        let MapPiece::Moment { spins, .. } = piece else {
            return LocalSolution::open(impulse, rows);
        };
        let (axes, gains) = self.along_axes(piece, compliance);
        let [rolling, torsional] = self.limits;
        let mut offset = Vector3::zeros();
        let mut by_load = Vector3::zeros();
        for k in 0..3 {
            let axis = axes.column(k);
            let u = axis.dot(&self.u);
            let p = axis.dot(&self.p);
            let limit = match (piece, k) {
                (MapPiece::Moment { rolls: true, .. }, 0) => rolling,
                (MapPiece::Moment { rolls: true, .. }, 1) => {
                    offset -= axis * (p / self.across(compliance));
                    continue;
                }
                (_, 2) if spins != 0 => torsional * f64::from(spins),
                _ => {
                    offset -= axis * (u / compliance);
                    continue;
                }
            };
            offset += axis * (limit * self.load.impulse - p);
            by_load += axis * limit;
        }
        let gain = axes * Matrix3::from_diagonal(&gains) * axes.transpose();
        let gain = rows.frame * gain * rows.frame.transpose();
        LocalSolution::moment(rows.frame * offset, MomentGain::new(&gain, rows.frame * by_load))
    }

    /// Factored gain of the `piece`, with ε = `compliance`.
    pub(super) fn factored(
        &self,
        piece: MapPiece,
        rows: &CouplingRows,
        compliance: f64,
    ) -> Factored {
        if piece == MapPiece::Open {
            return Factored::nothing();
        }
        let (axes, gains) = self.along_axes(piece, compliance);
        Factored::along(&(rows.frame * axes), gains)
    }

    /// Axes t, s and n of the `piece` in the frame, and the gain of each row.
    fn along_axes(&self, piece: MapPiece, compliance: f64) -> (Matrix3<f64>, Vector3<f64>) {
        let stiff = -1.0 / compliance;
        let MapPiece::Moment { rolls, spins } = piece else {
            return (Matrix3::identity(), Vector3::zeros());
        };
        let along = if spins == 0 { stiff } else { 0.0 };
        if !rolls {
            return (Matrix3::identity(), Vector3::new(stiff, stiff, along));
        }
        let t = self.argument().xy().try_normalize(0.0).unwrap_or(Vector2::x());
        let axes = Matrix3::new(t[0], -t[1], 0.0, t[1], t[0], 0.0, 0.0, 0.0, 1.0);
        let turn = -self.rho[0] * self.bend() / self.across(compliance);
        (axes, Vector3::new(0.0, turn, along))
    }

    /// b = r γ⁺/|y_t|, at most 1.
    fn bend(&self) -> f64 {
        (self.limits().0 / self.size().max(f64::MIN_POSITIVE)).min(1.0)
    }

    /// 1 − b + ρ ε b.
    fn across(&self, compliance: f64) -> f64 {
        let bend = self.bend();
        1.0 - bend + self.rho[0] * compliance * bend
    }
}
