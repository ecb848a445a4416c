//! Ipopt's options, typed.
//!
//! Only options with a use in this project exist here, so that a misspelt name
//! or a value of the wrong type cannot be written. Ipopt prints a message when it
//! refuses an option whatever the print level, and it accepts NaN; both are ruled
//! out by [`Options::validate`] before Ipopt sees a value.

use super::IpoptError;

/// How the barrier parameter is reduced (`mu_strategy`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum BarrierStrategy {
    /// Fiacco–McCormick: reduce once a barrier problem is solved. Ipopt's default.
    #[default]
    Monotone,
    /// Choose anew in every iteration.
    Adaptive,
}

/// How far the multipliers of the constraints follow a step (`alpha_for_y`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum MultiplierStep {
    /// As far as the variables. Ipopt's default.
    #[default]
    Primal,
    /// To the least dual infeasibility.
    MinDualInfeasibility,
}

/// Whether Ipopt rescales the problem from its gradients at the start
/// (`nlp_scaling_method`).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Scaling {
    /// Scale so that gradients at the start are at most 100. Ipopt's default.
    #[default]
    GradientBased,
    /// Leave the problem as it is.
    None,
}

/// The settings of one solve.
///
/// [`Default`] is the recommended set: Ipopt's own defaults except for three
/// settings of the linear solver MUMPS that change no result and take a third off
/// the time of small problems.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Convergence tolerance (`tol`), in (0, 1).
    pub tolerance: f64,
    /// Iteration limit (`max_iter`), at most 1 000 000.
    pub max_iterations: u32,
    /// Barrier strategy (`mu_strategy`).
    pub barrier: BarrierStrategy,
    /// Multipliers' step (`alpha_for_y`).
    pub multiplier_step: MultiplierStep,
    /// Initial barrier parameter (`mu_init`), in (0, 1e6]; Ipopt's default is 0.1.
    pub initial_barrier: f64,
    /// Problem scaling (`nlp_scaling_method`).
    pub scaling: Scaling,
    /// What the objective is multiplied with inside Ipopt (`obj_scaling_factor`), and so how
    /// much of it `tolerance` stands for. In (0, 1e12]; Ipopt's default is 1.
    pub objective_scaling: f64,
    /// How far the start is pushed away from a bound, absolutely (`bound_push`) and as
    /// a fraction of the distance between two bounds (`bound_frac`); Ipopt's default
    /// is 0.01. In (0, 0.5].
    pub bound_push: f64,
    /// MUMPS column ordering (`mumps_pivot_order`): 0 is approximate minimum degree,
    /// the cheapest for a problem this small; Ipopt's default is 7, automatic. 0, 2, 3, 5, 6
    /// or 7.
    pub mumps_pivot_order: u32,
    /// MUMPS working-memory reserve in per cent (`mumps_mem_percent`); Ipopt's
    /// default is 1000. In 0…10 000.
    pub mumps_memory_percent: u32,
    /// Least number of iterative refinements of a linear solve
    /// (`min_refinement_steps`); Ipopt's default is 1. In 0…10.
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

/// How far a warm start is kept from the bounds; see `warm_start_bound_push`.
const WARM_START_PUSH: f64 = 1e-8;

/// One option as Ipopt's C interface takes it.
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
        // 1 needs an order to be given; 4 (PORD) can end the process.
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

    /// The settings to hand to Ipopt, `warm` for a start with multipliers.
    pub(super) fn settings(&self, warm: bool) -> Vec<OptionValue> {
        use OptionValue::{Integer, Number, Text};
        let int = |value: u32| i32::try_from(value).unwrap_or(i32::MAX);
        let mut settings = vec![
            // Silence: the level alone leaves the banner.
            Integer("print_level", 0),
            Text("sb", "yes"),
            // An ipopt.opt in the working directory must not override these settings.
            Text("option_file_name", ""),
            // The other solvers that Debian's build lists end the process or fail.
            Text("linear_solver", "mumps"),
            // The callbacks check every number themselves. With "yes", 3.11 reads a vector
            // that was never filled, and crashes, once `constraints` has refused.
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
