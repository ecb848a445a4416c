//! A measured number, its expected values, and the verdict on it.

use std::f64::consts::LN_2;

/// A measured number and its expected values.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestQuantity {
    /// The name.
    pub name: &'static str,
    /// The unit; `1` for a number.
    pub unit: &'static str,
    /// The value in the simulation.
    pub measured: f64,
    /// The closed-form value of the time-stepping scheme.
    pub discrete: f64,
    /// The closed-form value in continuous time.
    pub exact: f64,
    /// The allowed |measured − discrete|: rounding and the residuals of the steps.
    pub tolerance: f64,
    /// The relation between `measured` and `discrete`.
    pub claim: QuantityClaim,
    /// The convergence of `discrete` to `exact` as the time step h shrinks.
    pub convergence: Convergence,
}

/// The relation between the measured and the discrete value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QuantityClaim {
    /// measured = discrete.
    Equal,
    /// measured ≤ discrete.
    AtMost,
}

/// The behaviour of discrete − exact as the time step h shrinks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Convergence {
    /// Zero: the scheme is exact for this quantity.
    Exact,
    /// Proportional to hᵖ.
    Order(i32),
    /// At most this bound; the value depends on where the steps fall.
    Within(f64),
    /// Unknown: the steps are too coarse.
    Unresolved,
}

/// The largest difference of an observed order from the declared one. The next term of the
/// expansion in h changes the order by about 1/n for n steps of the motion.
const ORDER_TOLERANCE: f64 = 0.1;
const LEAST_STEPS: f64 = 20.0;
/// The largest uncertainty of an order that is reported.
const ORDER_UNCERTAINTY: f64 = 0.2;

/// Order `p`, for a motion of `steps` steps.
pub(crate) fn order(p: i32, steps: f64) -> Convergence {
    if steps >= LEAST_STEPS { Convergence::Order(p) } else { Convergence::Unresolved }
}

/// At most `bound` to first order, for a motion of `steps` steps.
pub(crate) fn within(bound: f64, steps: f64) -> Convergence {
    if steps >= LEAST_STEPS { Convergence::Within(bound) } else { Convergence::Unresolved }
}

/// A name and its unit.
pub(crate) type QuantityLabel = (&'static str, &'static str);

/// A quantity for which the scheme is exact.
pub(crate) fn equal(
    (name, unit): QuantityLabel,
    measured: f64,
    exact: f64,
    tolerance: f64,
) -> TestQuantity {
    let (claim, convergence) = (QuantityClaim::Equal, Convergence::Exact);
    TestQuantity { name, unit, measured, discrete: exact, exact, tolerance, claim, convergence }
}

/// A quantity that must not be positive.
pub(crate) fn at_most_zero(label: QuantityLabel, measured: f64, tolerance: f64) -> TestQuantity {
    TestQuantity { claim: QuantityClaim::AtMost, ..equal(label, measured, 0.0, tolerance) }
}

/// A quantity that is zero in continuous time and at most `bound` with finite steps.
pub(crate) fn at_most(label: QuantityLabel, measured: f64, bound: f64) -> TestQuantity {
    at_most_zero(label, measured, 0.0).stepped(bound, Convergence::Within(bound))
}

impl TestQuantity {
    /// The quantity with the value `discrete` of the scheme.
    pub(crate) fn stepped(self, discrete: f64, convergence: Convergence) -> Self {
        Self { discrete, convergence, ..self }
    }

    /// measured − discrete.
    pub fn error(&self) -> f64 {
        self.measured - self.discrete
    }

    /// True if the claim holds within the tolerance.
    pub fn holds(&self) -> bool {
        match self.claim {
            QuantityClaim::Equal => self.error().abs() <= self.tolerance,
            QuantityClaim::AtMost => self.error() <= self.tolerance,
        }
    }

    /// The observed order p = log₂(e(h)/e(h/2)) of e = measured − exact, with the quantity
    /// `at_half` the time step. `None` without a declared order, or if the tolerance is as large as
    /// the error.
    pub fn order(&self, at_half: &Self) -> Option<f64> {
        let Convergence::Order(_) = self.convergence else { return None };
        let error = |quantity: &Self| quantity.measured - quantity.exact;
        (self.order_uncertainty(at_half) <= ORDER_UNCERTAINTY)
            .then(|| (error(self) / error(at_half)).abs().log2())
    }

    /// The effect of both tolerances on the observed order: Σ tolerance/(|e| ln 2).
    fn order_uncertainty(&self, at_half: &Self) -> f64 {
        let of = |quantity: &Self| {
            quantity.tolerance / ((quantity.measured - quantity.exact).abs() * LN_2)
        };
        of(self) + of(at_half)
    }

    /// True if the discrete and the measured value converge as declared, given the quantity
    /// `at_half` the time step.
    pub fn converges(&self, at_half: &Self) -> bool {
        let [here, there] = [self, at_half].map(|quantity| quantity.discrete - quantity.exact);
        match self.convergence {
            Convergence::Exact => here.abs() <= self.tolerance,
            Convergence::Within(bound) => here.abs() <= bound + self.tolerance,
            Convergence::Unresolved => true,
            Convergence::Order(p) => {
                let near = |order: f64, tolerance| (order - f64::from(p)).abs() <= tolerance;
                let measured = ORDER_TOLERANCE + self.order_uncertainty(at_half);
                near((here / there).abs().log2(), ORDER_TOLERANCE)
                    && self.order(at_half).is_none_or(|order| near(order, measured))
            }
        }
    }
}
