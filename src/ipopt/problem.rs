//! Input of a solve: functions, bounds and start point.

use super::IpoptError;
use crate::sparsity::SparsityPattern;

/// Nonlinear program
///
/// ```text
/// min f(x)   subject to   g_L ≤ g(x) ≤ g_U,   x_L ≤ x ≤ x_U
/// ```
///
/// with n variables, m constraints, first derivatives and the Hessian of the Lagrangian. The
/// wrapper refuses values that are not finite. The solve then ends with
/// [`InvalidNumberDetected`](super::ReturnStatus::InvalidNumberDetected). A panic in any method
/// propagates to the caller of the solve.
pub trait NonlinearProgram {
    /// Number of variables n, at least 1.
    fn variable_count(&self) -> usize;
    /// Number of constraints m.
    fn constraint_count(&self) -> usize;
    /// Structural non-zeros of ∂g/∂x (m × n).
    fn jacobian_pattern(&self) -> &SparsityPattern;
    /// Structural non-zeros of the Hessian of the Lagrangian (n × n), lower triangle.
    fn hessian_pattern(&self) -> &SparsityPattern;

    /// Objective f(x).
    fn objective(&mut self, x: &[f64]) -> f64;
    /// Writes ∇f(x), n numbers.
    fn gradient(&mut self, x: &[f64], gradient: &mut [f64]);
    /// Writes g(x), m numbers.
    fn constraints(&mut self, x: &[f64], constraints: &mut [f64]);
    /// Writes ∂g/∂x in the order of the pattern.
    fn jacobian(&mut self, x: &[f64], values: &mut [f64]);
    /// Writes σ∇²f + Σ yⱼ∇²gⱼ in the order of the pattern.
    fn hessian(
        &mut self,
        x: &[f64],
        objective_factor: f64,
        multipliers: &[f64],
        values: &mut [f64],
    );

    /// Called once per iteration; `false` ends the solve with
    /// [`UserRequestedStop`](super::ReturnStatus::UserRequestedStop).
    fn keep_going(&mut self, _progress: &IpoptProgress) -> bool {
        true
    }
}

/// Progress of one iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct IpoptProgress {
    /// Iteration number, from 0.
    pub iteration: u32,
    /// True while the restoration phase runs.
    pub in_restoration: bool,
    /// Objective value (unscaled).
    pub objective: f64,
    /// Largest violation of a constraint.
    pub primal_infeasibility: f64,
    /// Largest dual infeasibility.
    pub dual_infeasibility: f64,
    /// Barrier parameter.
    pub barrier: f64,
}

/// Bounds on variables (n) and constraints (m). ±∞ or a magnitude of at least 1e19 means unbounded.
/// Equal bounds fix a variable or make a constraint an equation.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    /// Lower bounds x_L.
    pub lower: Vec<f64>,
    /// Upper bounds x_U.
    pub upper: Vec<f64>,
    /// Lower bounds g_L.
    pub constraint_lower: Vec<f64>,
    /// Upper bounds g_U.
    pub constraint_upper: Vec<f64>,
}

impl Bounds {
    /// Checks lengths, order and NaN, which Ipopt ignores silently.
    pub(super) fn validate(&self, n: usize, m: usize) -> Result<(), IpoptError> {
        let pairs = [
            ("variable bounds", &self.lower, &self.upper, n),
            ("constraint bounds", &self.constraint_lower, &self.constraint_upper, m),
        ];
        for (what, lower, upper, expected) in pairs {
            for found in [lower.len(), upper.len()] {
                if found != expected {
                    return Err(IpoptError::Length { what, expected, found });
                }
            }
            for (index, (&low, &high)) in lower.iter().zip(upper).enumerate() {
                let ordered = low <= high && low < f64::INFINITY && high > f64::NEG_INFINITY;
                if !ordered {
                    return Err(IpoptError::Bounds { what, index, lower: low, upper: high });
                }
            }
        }
        Ok(())
    }
}

/// Start point of a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StartPoint<'a> {
    /// A point alone; Ipopt estimates the multipliers.
    Cold {
        /// Variables, n numbers.
        x: &'a [f64],
    },
    /// A point with the multipliers of a similar, solved problem.
    Warm {
        /// Variables, n numbers.
        x: &'a [f64],
        /// Constraint multipliers, m numbers.
        constraint_multipliers: &'a [f64],
        /// Multipliers of the lower bounds, n numbers ≥ 0.
        lower_multipliers: &'a [f64],
        /// Multipliers of the upper bounds, n numbers ≥ 0.
        upper_multipliers: &'a [f64],
    },
}

impl StartPoint<'_> {
    /// Checks lengths and that every number is finite.
    pub(super) fn validate(&self, n: usize, m: usize) -> Result<(), IpoptError> {
        let check = |what, values: &[f64], expected: usize| {
            if values.len() != expected {
                return Err(IpoptError::Length { what, expected, found: values.len() });
            }
            match values.iter().position(|value| !value.is_finite()) {
                Some(index) => Err(IpoptError::NotFinite { what, index, value: values[index] }),
                None => Ok(()),
            }
        };
        match *self {
            Self::Cold { x } => check("start point", x, n),
            Self::Warm { x, constraint_multipliers, lower_multipliers, upper_multipliers } => {
                check("start point", x, n)?;
                check("constraint multipliers", constraint_multipliers, m)?;
                check("lower bound multipliers", lower_multipliers, n)?;
                check("upper bound multipliers", upper_multipliers, n)
            }
        }
    }
}
