//! The contact law as rows of seven numbers of a contact and a step, with their derivatives: what the
//! bodies do enters through three of them alone.
//!
//! ```text
//! s = (F_t1, F_t2, F_n, λ, φ⁺/h, c_1, c_2)
//! φ̂ = φ⁺/h + ε (p̂_n − p̂⁰_n),   ĉ = c + ε (p̂_t − p̂⁰_t),   p̂ = h F              (eq. P13)
//! ```
//!
//! On the path to a plan all contacts have the same four rows (eq. P16):
//!
//! ```text
//! φ_δ(F_n, φ̂) = 0,   μ F_n ĉ + λ F_t = 0,   φ_δ(λ, μ F_n − ‖F_t‖_ε) = 0
//! ```
//!
//! and with modes fixed each those of its own (eq. P17).

use crate::step_nlp::kernels::SmoothForce;
use nalgebra::{SMatrix, SVector, Vector2, Vector3};

/// Numbers of s.
pub(super) const NUMBERS: usize = 7;
/// Rows of a contact, at most.
pub(super) const ROWS: usize = 4;
/// The places of F_t1, F_t2 in s are 0 and 1; of F_n, λ, φ⁺/h and of c these.
pub(super) const NORMAL: usize = 2;
pub(super) const SLIP_SPEED: usize = 3;
pub(super) const GAP: usize = 4;
pub(super) const SLIP: usize = 5;

pub(super) type Numbers = SVector<f64, NUMBERS>;

/// Which rows a contact has in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Rows {
    /// Every mode at once, smoothed by δ; ε_f of the friction force's norm.
    Smoothed { delta: f64, norm: f64 },
    /// No force: φ⁺ ≥ 0.
    Open,
    /// φ̂ = 0, ĉ = 0, (μ F_n)² − |F_t|² ≥ 0.
    Stick,
    /// φ̂ = 0, μ F_n ĉ + λ F_t = 0, (μ F_n)² − |F_t|² = 0.
    Slip,
}

/// The law of one contact in one step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Law {
    pub(super) rows: Rows,
    pub(super) friction: f64,
    /// ε h: the motion by a unit of force.
    pub(super) compliance: f64,
    /// F⁰, at which the compliance gives nothing.
    pub(super) anchor: Vector3<f64>,
}

/// The smoothed function of Fischer and Burmeister and its derivatives (eqs. P15 and P19):
///
/// ```text
/// φ_δ(a, b) = a + b − ρ = 2 (ab − δ)/(a + b + ρ),   ρ = √(a² + b² + 2δ)
/// ∇φ = 1 − d,   ∇²φ = −(E − d dᵀ)/ρ,   d = (a, b)/ρ
/// ```
#[derive(Debug, Clone, Copy)]
pub(super) struct Complementarity {
    pub(super) value: f64,
    pub(super) slope: Vector2<f64>,
    rho: f64,
}

impl Complementarity {
    pub(super) fn new(a: f64, b: f64, delta: f64) -> Self {
        let rho = (a * a + b * b + 2.0 * delta).sqrt();
        let sum = a + b;
        // The second form where the first cancels.
        let value = if sum > 0.0 { 2.0 * (a * b - delta) / (sum + rho) } else { sum - rho };
        Self { value, slope: Vector2::new(1.0 - a / rho, 1.0 - b / rho), rho }
    }

    /// ∂²/∂a², ∂²/∂a∂b, ∂²/∂b².
    pub(super) fn curvature(&self) -> [f64; 3] {
        let d = Vector2::from_element(1.0) - self.slope;
        [d[0] * d[0] - 1.0, d[0] * d[1], d[1] * d[1] - 1.0].map(|entry| entry / self.rho)
    }
}

impl Law {
    /// How many rows there are.
    pub(super) fn count(&self) -> usize {
        match self.rows {
            Rows::Open => 1,
            _ if self.friction == 0.0 => 1,
            Rows::Smoothed { .. } | Rows::Stick | Rows::Slip => 4,
        }
    }

    /// The first four numbers near s that obey the smoothed rows, as far as they can without the motion: where a force is open it
    /// is what δ leaves of it, and the rows are not dependent there.
    ///
    /// ```text
    /// open: F_n = δ/φ⁺,  slip: λ = |c| + δ/(μ F_n),  F_t = −μ F_n c/λ,  stick: λ = δ/(μ F_n − |F_t|)
    /// ```
    pub(super) fn on_path(&self, s: &Numbers) -> [f64; 4] {
        let Rows::Smoothed { delta, .. } = self.rows else { return [s[0], s[1], s[2], s[3]] };
        let normal = s[NORMAL].max(delta / s[GAP].max(delta.sqrt()));
        let most = self.friction * normal;
        if most == 0.0 {
            return [0.0, 0.0, normal, 0.0];
        }
        let (force, slip) = (Vector2::new(s[0], s[1]), Vector2::new(s[SLIP], s[SLIP + 1]));
        let room = most - force.norm();
        if slip.norm() * most < delta && room > delta {
            return [s[0], s[1], normal, delta / room];
        }
        let slip_speed = slip.norm() + delta / most;
        let force = slip * (-most / slip_speed);
        [force[0], force[1], normal, slip_speed]
    }

    /// Whether number `i` of s, of the first four, is a variable.
    pub(super) fn has(&self, i: usize) -> bool {
        let rubs = self.friction > 0.0;
        match self.rows {
            Rows::Open => false,
            Rows::Stick => i == NORMAL || (rubs && i != SLIP_SPEED),
            Rows::Smoothed { .. } | Rows::Slip => i == NORMAL || rubs,
        }
    }

    /// Whether the last row is an inequality ≥ 0; all others are equations.
    pub(super) fn is_inequality(&self, row: usize) -> bool {
        match self.rows {
            Rows::Open => true,
            Rows::Stick => row == 3,
            Rows::Smoothed { .. } | Rows::Slip => false,
        }
    }

    /// Which numbers of s row `row` is made of.
    pub(super) fn depends(&self, row: usize) -> &'static [usize] {
        match (self.rows, row) {
            (Rows::Open, _) => &[GAP],
            (_, 0) => &[NORMAL, GAP],
            (Rows::Stick, 1) => &[0, SLIP],
            (Rows::Stick, 2) => &[1, SLIP + 1],
            (_, 1) => &[0, NORMAL, SLIP_SPEED, SLIP],
            (_, 2) => &[1, NORMAL, SLIP_SPEED, SLIP + 1],
            (Rows::Smoothed { .. }, _) => &[0, 1, NORMAL, SLIP_SPEED],
            _ => &[0, 1, NORMAL],
        }
    }

    /// The pairs i ≥ j of numbers of s whose second derivatives can differ from zero.
    pub(super) fn couples(&self) -> &'static [(usize, usize)] {
        match self.rows {
            Rows::Open => &[],
            Rows::Smoothed { .. } if self.friction == 0.0 => {
                &[(NORMAL, NORMAL), (GAP, NORMAL), (GAP, GAP)]
            }
            _ if self.friction == 0.0 => &[],
            Rows::Stick => &[(0, 0), (1, 1), (NORMAL, NORMAL)],
            Rows::Slip => &[
                (0, 0),
                (1, 1),
                (NORMAL, NORMAL),
                (NORMAL, 0),
                (NORMAL, 1),
                (SLIP_SPEED, 0),
                (SLIP_SPEED, 1),
                (SLIP, NORMAL),
                (SLIP + 1, NORMAL),
            ],
            Rows::Smoothed { .. } => &[
                (0, 0),
                (1, 0),
                (1, 1),
                (NORMAL, 0),
                (NORMAL, 1),
                (NORMAL, NORMAL),
                (SLIP_SPEED, 0),
                (SLIP_SPEED, 1),
                (SLIP_SPEED, NORMAL),
                (SLIP_SPEED, SLIP_SPEED),
                (GAP, NORMAL),
                (GAP, GAP),
                (SLIP, NORMAL),
                (SLIP + 1, NORMAL),
            ],
        }
    }

    /// φ̂ and ĉ.
    fn yielding(&self, s: &Numbers) -> (f64, Vector2<f64>) {
        let gives = |i: usize| self.compliance * (s[i] - self.anchor[i]);
        (s[GAP] + gives(NORMAL), Vector2::new(s[SLIP] + gives(0), s[SLIP + 1] + gives(1)))
    }

    fn tangential(s: &Numbers, norm: f64) -> SmoothForce {
        SmoothForce::new(Vector2::new(s[0], s[1]), norm)
    }

    /// The rows.
    pub(super) fn values(&self, s: &Numbers) -> [f64; ROWS] {
        let (gap, slip) = self.yielding(s);
        let mu = self.friction;
        let sliding = slip * (mu * s[NORMAL]) + Vector2::new(s[0], s[1]) * s[SLIP_SPEED];
        let square = mu * mu * s[NORMAL] * s[NORMAL] - s[0] * s[0] - s[1] * s[1];
        match self.rows {
            Rows::Open => [s[GAP], 0.0, 0.0, 0.0],
            Rows::Stick => [gap, slip[0], slip[1], square],
            Rows::Slip => [gap, sliding[0], sliding[1], square],
            Rows::Smoothed { delta, norm } => {
                let room = mu * s[NORMAL] - Self::tangential(s, norm).norm;
                let cone = Complementarity::new(s[SLIP_SPEED], room, delta).value;
                let normal = Complementarity::new(s[NORMAL], gap, delta).value;
                [normal, sliding[0], sliding[1], cone]
            }
        }
    }

    /// The rows' slopes by s.
    pub(super) fn slopes(&self, s: &Numbers) -> SMatrix<f64, ROWS, NUMBERS> {
        let (gap, slip) = self.yielding(s);
        let (mu, gives) = (self.friction, self.compliance);
        let mut slopes = SMatrix::<f64, ROWS, NUMBERS>::zeros();
        let mut pushed = (gives, 1.0);
        if let Rows::Smoothed { delta, .. } = self.rows {
            let by = Complementarity::new(s[NORMAL], gap, delta).slope;
            pushed = (by[0] + gives * by[1], by[1]);
        }
        if self.rows != Rows::Open {
            slopes[(0, NORMAL)] = pushed.0;
        }
        slopes[(0, GAP)] = pushed.1;
        for axis in 0..2 {
            let row = 1 + axis;
            match self.rows {
                Rows::Open => {}
                Rows::Stick => {
                    slopes[(row, axis)] = gives;
                    slopes[(row, SLIP + axis)] = 1.0;
                    slopes[(3, axis)] = -2.0 * s[axis];
                }
                Rows::Slip | Rows::Smoothed { .. } => {
                    slopes[(row, axis)] = s[SLIP_SPEED] + mu * s[NORMAL] * gives;
                    slopes[(row, NORMAL)] = mu * slip[axis];
                    slopes[(row, SLIP_SPEED)] = s[axis];
                    slopes[(row, SLIP + axis)] = mu * s[NORMAL];
                    slopes[(3, axis)] = -2.0 * s[axis];
                }
            }
        }
        slopes[(3, NORMAL)] = 2.0 * mu * mu * s[NORMAL];
        if let Rows::Smoothed { delta, norm } = self.rows {
            let force = Self::tangential(s, norm);
            let room = mu * s[NORMAL] - force.norm;
            let by = Complementarity::new(s[SLIP_SPEED], room, delta).slope;
            slopes[(3, SLIP_SPEED)] = by[0];
            slopes[(3, NORMAL)] = mu * by[1];
            for axis in 0..2 {
                slopes[(3, axis)] = -by[1] * force.direction[axis];
            }
        }
        slopes
    }

    /// Σ y_r ∇²(row r) by s, the lower triangle.
    pub(super) fn curvature(&self, s: &Numbers, y: &[f64; ROWS]) -> SMatrix<f64, NUMBERS, NUMBERS> {
        let (gap, _) = self.yielding(s);
        let (mu, gives) = (self.friction, self.compliance);
        let mut curvature = SMatrix::<f64, NUMBERS, NUMBERS>::zeros();
        if let Rows::Smoothed { delta, norm } = self.rows {
            let [aa, ab, bb] = Complementarity::new(s[NORMAL], gap, delta).curvature();
            curvature[(NORMAL, NORMAL)] = y[0] * (aa + gives * (2.0 * ab + gives * bb));
            curvature[(GAP, NORMAL)] = y[0] * (ab + gives * bb);
            curvature[(GAP, GAP)] = y[0] * bb;
            // λ and the room in the cone, of which F_n and F_t make μ F_n − ‖F_t‖.
            let force = Self::tangential(s, norm);
            let room = mu * s[NORMAL] - force.norm;
            let cone = Complementarity::new(s[SLIP_SPEED], room, delta);
            let [aa, ab, bb] = cone.curvature();
            let by_room = [-force.direction[0], -force.direction[1], mu];
            curvature[(SLIP_SPEED, SLIP_SPEED)] = y[3] * aa;
            for (i, by) in by_room.iter().enumerate() {
                curvature[(SLIP_SPEED, i)] = y[3] * ab * by;
                for (j, other) in by_room.iter().enumerate().take(i + 1) {
                    curvature[(i, j)] += y[3] * bb * by * other;
                }
            }
            let bends = force.direction_jacobian() * (-y[3] * cone.slope[1]);
            curvature[(0, 0)] += bends[(0, 0)];
            curvature[(1, 0)] += bends[(1, 0)];
            curvature[(1, 1)] += bends[(1, 1)];
        }
        if matches!(self.rows, Rows::Stick | Rows::Slip) {
            curvature[(0, 0)] = -2.0 * y[3];
            curvature[(1, 1)] = -2.0 * y[3];
            curvature[(NORMAL, NORMAL)] = 2.0 * mu * mu * y[3];
        }
        if matches!(self.rows, Rows::Smoothed { .. } | Rows::Slip) {
            for axis in 0..2 {
                let y = y[1 + axis];
                curvature[(SLIP_SPEED, axis)] += y;
                curvature[(NORMAL, axis)] += y * mu * gives;
                curvature[(SLIP + axis, NORMAL)] += y * mu;
            }
        }
        curvature
    }
}
