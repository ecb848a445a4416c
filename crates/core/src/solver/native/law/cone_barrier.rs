//! Interior of Coulomb's cone: variables of a contact in the interior point method (N7).
//!
//! Equation numbers refer to `docs/native-solver.md`.

use super::cone::Cone;
use super::rows::CouplingRows;
use crate::solver::native::settings::{COMPLIANCE, LEAST_SCALE, TO_BOUNDARY};
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// Variables of one contact besides V, in its frame (t₁, t₂, n), or their change.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ConeBarrier {
    /// Friction coefficient μ.
    friction: f64,
    /// Adhesion â (m/s).
    adhesion: f64,
    /// Normal impulse γ > 0, with the adhesion (m/s).
    normal: f64,
    /// Tangential impulse β, |β| < μγ (m/s).
    tangential: Vector2<f64>,
    /// Gap speed s > 0 (m/s).
    gap: f64,
    /// Dual speed ψ > |η| (m/s).
    dual: f64,
    /// Tangential speed η (m/s).
    slip: Vector2<f64>,
}

/// Data for the step of the speeds, once the step of the impulse is known.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Pending {
    /// (η, s) − û.
    gap_error: Vector3<f64>,
    /// Right-hand side of (N7b).
    dual_target: f64,
}

impl Pending {
    /// Zero data.
    pub(super) const NONE: Self = Self { gap_error: Vector3::new(0.0, 0.0, 0.0), dual_target: 0.0 };
}

/// Right-hand sides of the linearised (N7a), (N7b), (N7c).
#[derive(Debug, Clone, Copy)]
struct Targets {
    gap: f64,
    dual: f64,
    slip: Vector2<f64>,
}

impl ConeBarrier {
    pub(super) const ZERO: Self = Self {
        friction: 0.0,
        adhesion: 0.0,
        normal: 0.0,
        tangential: Vector2::new(0.0, 0.0),
        gap: 0.0,
        dual: 0.0,
        slip: Vector2::new(0.0, 0.0),
    };

    /// Number of products that converge to κ.
    pub(super) const PRODUCTS: usize = 2;

    pub(super) fn centred(cone: &Cone, rows: &CouplingRows, speed: f64, strength: f64) -> Self {
        Self {
            friction: cone.friction,
            adhesion: rows.adhesion,
            normal: strength,
            gap: speed,
            dual: speed / cone.friction.max(LEAST_SCALE),
            ..Self::ZERO
        }
    }

    /// p̂ (m/s).
    pub(super) fn impulse(&self) -> Vector3<f64> {
        Vector3::new(self.tangential[0], self.tangential[1], self.normal - self.adhesion)
    }

    /// p̂ + â n, which has the compliance (m/s).
    fn pressing(&self) -> Vector3<f64> {
        Vector3::new(self.tangential[0], self.tangential[1], self.normal)
    }

    /// |(η, s) − û| at the motion u of the rows (m/s).
    pub(super) fn error(&self, u: &Vector3<f64>) -> f64 {
        (self.speeds() - (u + COMPLIANCE * self.pressing())).amax()
    }

    /// (η, s) (m/s).
    fn speeds(&self) -> Vector3<f64> {
        Vector3::new(self.slip[0], self.slip[1], self.gap)
    }

    /// γ s + (μ γ ψ + β·η).
    pub(super) fn products(&self) -> f64 {
        self.normal * self.gap
            + self.friction * self.normal * self.dual
            + self.tangential.dot(&self.slip)
    }

    /// μγη + ψβ.
    fn slip_product(&self, friction: f64) -> Vector2<f64> {
        friction * self.normal * self.slip + self.dual * self.tangential
    }

    /// (κ, κ, 0) minus the current products and the quadratic terms of `predictor`.
    fn targets(&self, kappa: f64, predictor: &Self) -> Targets {
        let friction = self.friction;
        let dual_product =
            |cone: &Self| friction * cone.normal * cone.dual + cone.tangential.dot(&cone.slip);
        Targets {
            gap: kappa - self.normal * self.gap - predictor.normal * predictor.gap,
            dual: kappa - dual_product(self) - dual_product(predictor),
            slip: -self.slip_product(friction) - predictor.slip_product(friction),
        }
    }

    /// Linearises (N7) and solves it for the impulse: (δγ, δβ) = offset + gain δu.
    pub(super) fn eliminate(
        &self,
        kappa: f64,
        predictor: &Self,
        u: &Vector3<f64>,
    ) -> Option<(Vector3<f64>, Matrix3<f64>, Pending)> {
        let targets = self.targets(kappa, predictor);
        let gap_error = self.speeds() - u - COMPLIANCE * self.pressing();
        let (offset, gain) = self.solved(&targets, &gap_error)?;
        Some((offset, gain, Pending { gap_error, dual_target: targets.dual }))
    }

    /// Solves the linearised (N7) with these right-hand sides: offset and gain of the impulse by
    /// δu.
    fn solved(
        &self,
        targets: &Targets,
        gap_error: &Vector3<f64>,
    ) -> Option<(Vector3<f64>, Matrix3<f64>)> {
        let friction = self.friction;
        // s δγ + γ δs = r_a with δs = δu_z + ε δγ − e_z.
        let across = self.gap + COMPLIANCE * self.normal;
        let normal_offset = (targets.gap + self.normal * gap_error[2]) / across;
        let normal_gain = -self.normal / across;
        if friction <= 0.0 {
            let gain = Matrix3::from_diagonal(&Vector3::new(0.0, 0.0, normal_gain));
            return Some((Vector3::new(0.0, 0.0, normal_offset), gain));
        }
        // δψ = (r_b − μψ δγ − η·δβ − β·δη)/(μγ) is inserted into μη δγ + μγ δη + β δψ + ψ δβ = r_c
        // with δη = δu_xy + ε δβ − e_xy.
        let radius = friction * self.normal;
        let (beta, eta) = (&self.tangential, &self.slip);
        let by_slip = Matrix2::from_diagonal_element(radius) - beta * beta.transpose() / radius;
        let by_force = Matrix2::from_diagonal_element(self.dual) - beta * eta.transpose() / radius
            + COMPLIANCE * by_slip;
        let by_normal = friction * eta - beta * (self.dual / self.normal);
        let inverse = by_force.try_inverse()?;
        let by_impulse = targets.slip - beta * (targets.dual / radius) - by_normal * normal_offset;
        let offset = inverse * (by_impulse + by_slip * gap_error.xy());
        let turn = -inverse * by_slip;
        let press = -inverse * by_normal * normal_gain;
        Some((
            Vector3::new(offset[0], offset[1], normal_offset),
            Matrix3::new(
                turn[(0, 0)],
                turn[(0, 1)],
                press[0],
                turn[(1, 0)],
                turn[(1, 1)],
                press[1],
                0.0,
                0.0,
                normal_gain,
            ),
        ))
    }

    /// Largest deviation of the products from κ (m²/s²), beyond the rounding of their terms.
    pub(super) fn off_centre(&self, kappa: f64) -> f64 {
        /// Rounding relative to the terms.
        const ROUNDING: f64 = 1e-14;
        let Targets { gap, dual, slip } = self.targets(kappa, &Self::ZERO);
        if self.friction <= 0.0 {
            // Without friction there is only one product.
            return gap.abs();
        }
        let radius = self.friction * self.normal;
        let of_dual = radius * self.dual + self.tangential.norm() * self.slip.norm();
        let of_slip = radius * self.slip.norm() + self.dual * self.tangential.norm();
        let missed = [(dual.abs(), of_dual), (slip.amax(), of_slip)];
        let beyond = missed.map(|(missed, summands)| missed - ROUNDING * summands);
        beyond.into_iter().fold(gap.abs(), f64::max)
    }

    /// δp̂ by δμ at fixed motion of the rows: the right-hand sides of (N7) are −γψ δμ and −γη δμ.
    pub(super) fn by_friction(&self) -> Option<Vector3<f64>> {
        let (dual, slip) = (-self.normal * self.dual, -self.normal * self.slip);
        let (offset, _) = self.solved(&Targets { gap: 0.0, dual, slip }, &Vector3::zeros())?;
        Some(offset)
    }

    /// Step of all variables for given steps of the impulse and of the point, both in the contact's
    /// frame.
    pub(super) fn step(
        &self,
        impulse: &Vector3<f64>,
        moved: &Vector3<f64>,
        rest: &Pending,
    ) -> Self {
        let Pending { gap_error, dual_target } = rest;
        let friction = self.friction;
        let speeds = moved + COMPLIANCE * impulse - gap_error;
        let mut step = Self {
            friction: 0.0,
            adhesion: 0.0,
            normal: impulse[2],
            tangential: impulse.xy(),
            gap: speeds[2],
            dual: 0.0,
            slip: speeds.xy(),
        };
        if friction > 0.0 {
            let products = friction * self.dual * step.normal
                + self.slip.dot(&step.tangential)
                + self.tangential.dot(&step.slip);
            step.dual = (dual_target - products) / (friction * self.normal);
        }
        step
    }

    pub(super) fn moved(&self, step: &Self, length: f64) -> Self {
        Self {
            friction: self.friction,
            adhesion: self.adhesion,
            normal: self.normal + length * step.normal,
            tangential: self.tangential + length * step.tangential,
            gap: self.gap + length * step.gap,
            dual: self.dual + length * step.dual,
            slip: self.slip + length * step.slip,
        }
    }

    /// Longest step, at most 1, that keeps γ, s and both cone variables inside.
    pub(super) fn longest_step(&self, step: &Self) -> f64 {
        let friction = self.friction;
        let mut length = 1.0_f64;
        for (value, change) in [(self.normal, step.normal), (self.gap, step.gap)] {
            if change < 0.0 {
                length = length.min(-TO_BOUNDARY * value / change);
            }
        }
        if friction > 0.0 {
            let force = to_cone_boundary(
                friction * self.normal,
                self.tangential,
                friction * step.normal,
                step.tangential,
            );
            let speed = to_cone_boundary(self.dual, self.slip, step.dual, step.slip);
            length = length.min(TO_BOUNDARY * force).min(TO_BOUNDARY * speed);
        }
        length
    }
}

/// Smallest positive t with |x + t dx| = a + t da, for |x| < a.
fn to_cone_boundary(a: f64, x: Vector2<f64>, da: f64, dx: Vector2<f64>) -> f64 {
    // (a + t da)² − |x + t dx|² = p t² + 2 q t + r = 0 with r > 0.
    let p = da * da - dx.norm_squared();
    let q = a * da - x.dot(&dx);
    let r = a * a - x.norm_squared();
    let discriminant = q * q - p * r;
    if discriminant < 0.0 {
        return f64::INFINITY;
    }
    let root = discriminant.sqrt();
    // Numerically stable pair of roots.
    let sum = if q >= 0.0 { -(q + root) } else { -q + root };
    let roots = [sum / p, r / sum];
    roots.into_iter().filter(|t| *t > 0.0 && t.is_finite()).fold(f64::INFINITY, f64::min)
}
