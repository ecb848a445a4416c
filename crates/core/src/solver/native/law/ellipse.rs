//! Law of a contact whose friction depends on the direction (N18): the [cone](super::cone) of scaled motion
//! and impulse.
//!
//! With S = diag(σ, 1, 1) in the frame (t₁, t₂, n) of the rows,
//!
//! ```text
//! p̃ = S⁻¹ p̂,   ũ = S û,   û = u + ε D p̂                                     (N18)
//! ```
//!
//! obey Coulomb's law. Equation numbers refer to `docs/native-solver.md`.

use super::cone::{Cone, ConeProjection};
use super::cone_barrier::{ConeBarrier, Pending};
use super::local_solution::{Factored, LocalSolution};
use super::map::{MapPiece, NaturalMap};
use super::rows::CouplingRows;
use nalgebra::{Matrix3, Vector3};

/// Projection arguments of the scaled motion and impulse.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EllipseProjection {
    pub(super) cone: ConeProjection,
}

/// S v, or S⁻¹ v with 1/σ, for v in world axes.
fn stretched(rows: &CouplingRows, stretch: f64, v: &Vector3<f64>) -> Vector3<f64> {
    let first = rows.frame.column(0);
    v + first * ((stretch - 1.0) * first.dot(v))
}

impl EllipseProjection {
    #[inline(never)]
    pub(super) fn new(
        map: &NaturalMap,
        rows: &CouplingRows,
        cone: &Cone,
        u: &Vector3<f64>,
        impulse: &Vector3<f64>,
    ) -> Self {
        let u = u + map.compliance * rows.compliant_motion(map.compliance, impulse);
        let w = stretched(rows, rows.stretch, &u);
        let q = stretched(rows, rows.stretch.recip(), impulse);
        let exact = NaturalMap { compliance: 0.0, ..*map };
        Self { cone: ConeProjection::new(&exact, rows, cone, &w, &q) }
    }

    /// Local solution on the `piece`, with ε = `compliance`: that of the cone, with S D S as compliance
    /// of the scaled impulse.
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
                // δp̂ = −D⁻¹ (û + δu)/ε, as without friction.
                let scaled = Vector3::new(rows.stretch.recip(), 1.0, 1.0);
                let u = rows.frame * rows.frame.tr_mul(&self.cone.u).component_mul(&scaled);
                let gains = rows.springs(compliance);
                let gain = rows.frame * Matrix3::from_diagonal(&gains) * rows.frame.transpose();
                LocalSolution::full(gain * u, gain)
            }
            MapPiece::Slip | MapPiece::Axes(_) | MapPiece::Moment { .. } => {
                let slip = self.slip(rows, compliance);
                let gain = slip.gain(rows);
                let offset = slip.offset + slip.gain_of_normal() * self.cone.u_n;
                LocalSolution::full(stretched(rows, rows.stretch, &offset), gain)
            }
        }
    }

    /// Offset of the slip piece for use with the `gain` of another point, as of the cone.
    pub(super) fn slip_offset(
        &self,
        rows: &CouplingRows,
        compliance: f64,
        gain: &Matrix3<f64>,
    ) -> Vector3<f64> {
        let slip = self.slip(rows, compliance);
        stretched(rows, rows.stretch, &slip.offset) + gain * (rows.normal() * self.cone.u_n)
    }

    /// Factored gain of the `piece`, with ε = `compliance`.
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
                self.slip(rows, compliance).factored(rows)
            }
        }
    }

    /// Slip piece of the scaled impulse. With its direction t, s = n × t, b = μ (γ − ρ_n ũ_n)/|y| and the
    /// compliance C = S D S,
    ///
    /// ```text
    /// δp̃_n = −(ũ_n + δũ_n)/ε,   δp̃_t = μ (γ + δp̃_n) − t·p̃,
    /// δp̃_s (1 − b + b ρ ε C_ss) = −s·p̃ − b ρ s·δũ − b ρ ε C_st δp̃_t              (N19)
    /// ```
    fn slip(&self, rows: &CouplingRows, compliance: f64) -> EllipseSlip {
        let ConeProjection { gamma, beta, rho_t: rho, friction, .. } = self.cone;
        let (t, n, bend) = (self.cone.direction(), rows.normal(), self.cone.bend());
        let s = n.cross(&t);
        let (first, second) = (rows.frame.column(0), rows.frame.column(1));
        let bent = bend * rho * compliance * rows.ratio_at(compliance);
        let soft = |a: &Vector3<f64>, b: &Vector3<f64>| {
            let square = rows.stretch * rows.stretch;
            square * first.dot(a) * first.dot(b) + second.dot(a) * second.dot(b)
        };
        let across = 1.0 - bend + bent * soft(&s, &s);
        let coupled = bent * soft(&s, &t) / across;
        let along = friction * gamma - t.dot(&beta);
        let sideways = -s.dot(&beta) / across - coupled * along;
        EllipseSlip {
            s,
            n,
            offset: along * t + sideways * s,
            turn: -bend * rho / across,
            press: t * friction - s * (coupled * friction),
            stiffness: 1.0 / compliance,
        }
    }
}

/// Slip piece of the scaled impulse: δp̃ = offset + turn s sᵀ δũ − (n + press)(ũ_n + δũ_n)/ε.
struct EllipseSlip {
    s: Vector3<f64>,
    n: Vector3<f64>,
    offset: Vector3<f64>,
    turn: f64,
    press: Vector3<f64>,
    stiffness: f64,
}

impl EllipseSlip {
    /// Change of p̃ by the normal motion.
    fn gain_of_normal(&self) -> Vector3<f64> {
        (self.n + self.press) * -self.stiffness
    }

    /// Gain of the impulse p̂ by the motion u.
    fn gain(&self, rows: &CouplingRows) -> Matrix3<f64> {
        let sideways = stretched(rows, rows.stretch, &self.s);
        let pressed = stretched(rows, rows.stretch, &self.gain_of_normal());
        sideways * sideways.transpose() * self.turn + pressed * self.n.transpose()
    }

    /// Factored gain along S s and n. Motion along t' = S s × n has no effect.
    fn factored(&self, rows: &CouplingRows) -> Factored {
        let sideways = stretched(rows, rows.stretch, &self.s);
        let length = sideways.norm();
        let s = sideways / length;
        let pressed = self.n + stretched(rows, rows.stretch, &self.press);
        let t = s.cross(&self.n);
        Factored {
            to: Matrix3::from_columns(&[t, s, pressed]),
            gains: Vector3::new(0.0, self.turn * length * length, -self.stiffness),
            from: Matrix3::from_columns(&[t, s, self.n]),
        }
    }
}

/// Variables of the interior point method: those of the cone of scaled motion and impulse.
#[derive(Debug, Clone, Copy)]
pub(crate) struct EllipseBarrier {
    pub(super) cone: ConeBarrier,
    stretch: f64,
}

impl EllipseBarrier {
    pub(super) fn centred(cone: &Cone, rows: &CouplingRows, speed: f64, strength: f64) -> Self {
        Self { cone: ConeBarrier::centred(cone, rows, speed, strength), stretch: rows.stretch }
    }

    /// Zero change.
    pub(super) fn nothing(&self) -> Self {
        Self { cone: ConeBarrier::ZERO, ..*self }
    }

    /// Diagonal of S.
    fn scale(&self) -> Vector3<f64> {
        Vector3::new(self.stretch, 1.0, 1.0)
    }

    /// p̂ in the axes of the rows (m/s).
    pub(super) fn impulse(&self) -> Vector3<f64> {
        self.cone.impulse().component_mul(&self.scale())
    }

    pub(super) fn error(&self, u: &Vector3<f64>) -> f64 {
        self.cone.error(&u.component_mul(&self.scale()))
    }

    pub(super) fn eliminate(
        &self,
        kappa: f64,
        predictor: &Self,
        u: &Vector3<f64>,
    ) -> Option<(Vector3<f64>, Matrix3<f64>, Pending)> {
        let scale = self.scale();
        let w = u.component_mul(&scale);
        let (offset, gain, pending) = self.cone.eliminate(kappa, &predictor.cone, &w)?;
        let diagonal = Matrix3::from_diagonal(&scale);
        Some((offset.component_mul(&scale), diagonal * gain * diagonal, pending))
    }

    pub(super) fn by_friction(&self) -> Option<Vector3<f64>> {
        Some(self.cone.by_friction()?.component_mul(&self.scale()))
    }

    pub(super) fn step(
        &self,
        impulse: &Vector3<f64>,
        moved: &Vector3<f64>,
        rest: &Pending,
    ) -> Self {
        let scale = self.scale();
        let q = impulse.component_div(&scale);
        Self { cone: self.cone.step(&q, &moved.component_mul(&scale), rest), ..*self }
    }

    pub(super) fn moved(&self, step: &Self, length: f64) -> Self {
        Self { cone: self.cone.moved(&step.cone, length), ..*self }
    }
}
