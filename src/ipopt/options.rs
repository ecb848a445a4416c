//! Ipopt's options as typed fields.
//!
//! Only options that this project uses exist here. Misspelt names and values of the wrong type are
//! therefore compile errors. Ipopt accepts NaN, and prints a message about a refused option at any
//! print level. [`Options::validate`] prevents both.

use super::IpoptError;

/// Update strategy of the barrier parameter (`mu_strategy`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BarrierStrategy {
    /// Fiacco–McCormick: reduce once a barrier problem is solved. Ipopt's default.
    #[default]
    Monotone,
    /// Choose a new value in every iteration.
    Adaptive,
}

/// Step length of the constraint multipliers (`alpha_for_y`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MultiplierStep {
    /// Same step length as the variables. Ipopt's default.
    #[default]
    Primal,
    /// Step length that minimises the dual infeasibility.
    MinDualInfeasibility,
}

/// Scaling of the problem by its gradients at the start point (`nlp_scaling_method`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scaling {
    /// Scale so that gradients at the start are at most 100. Ipopt's default.
    #[default]
    GradientBased,
    /// No scaling.
    None,
}

/// Settings of one solve.
///
/// [`Default`] is the recommended set. It has Ipopt's own defaults except for three settings of the
/// linear solver MUMPS, which save time on small problems and change no result.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Convergence tolerance (`tol`), in (0, 1).
    pub tolerance: f64,
    /// Iteration limit (`max_iter`), at most 1 000 000.
    pub max_iterations: u32,
    /// Barrier strategy (`mu_strategy`).
    pub barrier: BarrierStrategy,
    /// Step length of the constraint multipliers (`alpha_for_y`).
    pub multiplier_step: MultiplierStep,
    /// Initial barrier parameter (`mu_init`), in (0, 1e6]; Ipopt's default is 0.1.
    pub initial_barrier: f64,
    /// Problem scaling (`nlp_scaling_method`).
    pub scaling: Scaling,
    /// Factor of the objective inside Ipopt (`obj_scaling_factor`), in (0, 1e12]. It also scales
    /// the objective against `tolerance`. Ipopt's default is 1.
    pub objective_scaling: f64,
    /// Distance by which the start is pushed away from a bound, in (0, 0.5]. It is absolute
    /// (`bound_push`) and a fraction of the distance between two bounds (`bound_frac`). Ipopt's
    /// default is 0.01.
    pub bound_push: f64,
    /// MUMPS column ordering (`mumps_pivot_order`): 0, 2, 3, 5, 6 or 7. The value 0 is approximate
    /// minimum degree, the cheapest for small problems. Ipopt's default is 7, automatic.
    pub mumps_pivot_order: u32,
    /// MUMPS working-memory reserve in per cent (`mumps_mem_percent`), in 0…10 000. Ipopt's default
    /// is 1000.
    pub mumps_memory_percent: u32,
    /// Least number of iterative refinements of a linear solve (`min_refinement_steps`), in 0…10.
    /// Ipopt's default is 1.
    pub min_refinement_steps: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            tolerance: 1e-8,
            max_iterations: 3000,
            barrier: BarrierStrategy::Monotone,
            multiplier_step: MultiplierStep::Primal,
            initial_barrier: 0.1,
            scaling: Scaling::GradientBased,
            objective_scaling: 1.0,
            bound_push: 0.01,
            mumps_pivot_order: 0,
            mumps_memory_percent: 100,
            min_refinement_steps: 0,
        }
    }
}

/// Distance of a warm start from the bounds; see `warm_start_bound_push`.
const WARM_START_PUSH: f64 = 1e-8;

/// Option in the form of Ipopt's C interface: name and value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum OptionValue {
    Text(&'static str, &'static str),
    Number(&'static str, f64),
    Integer(&'static str, i32),
}

impl Options {
    /// Checks every value against its range.
    ///
    /// # Errors
    /// [`IpoptError::Option`] names the first option out of range.
    pub fn validate(&self) -> Result<(), IpoptError> {
        let number = |name, value: f64, low: f64, high: f64, allowed| {
            if value > low && value <= high {
                Ok(())
            } else {
                Err(IpoptError::Option { name, value, allowed })
            }
        };
        let integer = |name, value: u32, high: u32, allowed| {
            if value <= high {
                Ok(())
            } else {
                Err(IpoptError::Option { name, value: value.into(), allowed })
            }
        };
        number("tol", self.tolerance, 0.0, 1.0 - f64::EPSILON, "above 0 and below 1")?;
        integer("max_iter", self.max_iterations, 1_000_000, "0 to 1000000")?;
        number("mu_init", self.initial_barrier, 0.0, 1e6, "above 0 and up to 1e6")?;
        let allowed = "above 0 and up to 1e12";
        number("obj_scaling_factor", self.objective_scaling, 0.0, 1e12, allowed)?;
        number("bound_push", self.bound_push, 0.0, 0.5, "above 0 and up to 0.5")?;
        // 1 needs a user-defined order; 4 (PORD) can end the process.
        if !matches!(self.mumps_pivot_order, 0 | 2 | 3 | 5..=7) {
            return Err(IpoptError::Option {
                name: "mumps_pivot_order",
                value: self.mumps_pivot_order.into(),
                allowed: "0, 2, 3, 5, 6 or 7",
            });
        }
        integer("mumps_mem_percent", self.mumps_memory_percent, 10_000, "0 to 10000")?;
        integer("min_refinement_steps", self.min_refinement_steps, 10, "0 to 10")
    }

    /// Settings for Ipopt. `warm` is true for a start with multipliers.
    pub(super) fn settings(&self, warm: bool) -> Vec<OptionValue> {
        use OptionValue::{Integer, Number, Text};
        let int = |value: u32| i32::try_from(value).unwrap_or(i32::MAX);
        let mut settings = vec![
            // The print level alone leaves the banner.
            Integer("print_level", 0),
            Text("sb", "yes"),
            // An ipopt.opt in the working directory must not override these settings.
            Text("option_file_name", ""),
            // Other solvers that Debian's build lists end the process or fail.
            Text("linear_solver", "mumps"),
            // The callbacks check every number. With "yes", 3.11 reads an uninitialised vector and
            // crashes after `constraints` has refused.
            Text("check_derivatives_for_naninf", "no"),
            Number("tol", self.tolerance),
            Integer("max_iter", int(self.max_iterations)),
            Text(
                "mu_strategy",
                match self.barrier {
                    BarrierStrategy::Monotone => "monotone",
                    BarrierStrategy::Adaptive => "adaptive",
                },
            ),
            Text(
                "alpha_for_y",
                match self.multiplier_step {
                    MultiplierStep::Primal => "primal",
                    MultiplierStep::MinDualInfeasibility => "min-dual-infeas",
                },
            ),
            Number("mu_init", self.initial_barrier),
            Text(
                "nlp_scaling_method",
                match self.scaling {
                    Scaling::GradientBased => "gradient-based",
                    Scaling::None => "none",
                },
            ),
            Number("obj_scaling_factor", self.objective_scaling),
            Number("bound_push", self.bound_push),
            Number("bound_frac", self.bound_push),
            Integer("mumps_pivot_order", int(self.mumps_pivot_order)),
            Integer("mumps_mem_percent", int(self.mumps_memory_percent)),
            Integer("min_refinement_steps", int(self.min_refinement_steps)),
        ];
        if warm {
            settings.extend([
                Text("warm_start_init_point", "yes"),
                Number("warm_start_bound_push", WARM_START_PUSH),
                Number("warm_start_bound_frac", WARM_START_PUSH),
                Number("warm_start_slack_bound_push", WARM_START_PUSH),
                Number("warm_start_slack_bound_frac", WARM_START_PUSH),
                Number("warm_start_mult_bound_push", WARM_START_PUSH),
            ]);
        }
        settings
    }
}
