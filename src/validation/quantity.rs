//! A measured number, what it should be, and how that is judged.

/// A number that was measured, and what it should be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quantity {
    /// In words.
    pub name: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// From the simulation.
    pub measured: f64,
    /// What the steps must give: their equations for this motion, solved by hand.
    pub discrete: f64,
    /// What Newton's and Coulomb's laws give in continuous time.
    pub exact: f64,
    /// How far rounding and the residuals of the run's steps may take `measured` from
    /// `discrete`.
    pub slack: f64,
    /// What is claimed of the two.
    pub claim: Claim,
    /// How `discrete` comes to `exact` as the time step h shrinks.
    pub convergence: Convergence,
}

/// What a quantity claims.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Claim {
    /// measured = discrete.
    Equal,
    /// measured ≤ discrete.
    AtMost,
}

/// How discrete − exact goes with the time step h.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Convergence {
    /// It is zero: the step is exact for this quantity.
    Exact,
    /// Like hᵖ.
    Order(i32),
    /// It depends on how the steps happen to fall, and is at most this.
    Within(f64),
    /// The steps are too coarse for an order.
    Unresolved,
}

/// How far an order that shows may be from the one declared. The next term of the expansion
/// in h moves it by about 1/n, n being the steps of the motion, of which there must be some.
const ORDER_TOLERANCE: f64 = 0.1;
const LEAST_STEPS: f64 = 20.0;
/// An order is shown where the slack makes it uncertain by no more than this.
const ORDER_UNCERTAINTY: f64 = 0.2;

impl Convergence {
    /// Order `p`, for a motion of `steps` steps.
    pub(super) fn order(p: i32, steps: f64) -> Self {
        if steps >= LEAST_STEPS { Self::Order(p) } else { Self::Unresolved }
    }

    /// At most `bound`, to first order, for a motion of `steps` steps.
    pub(super) fn within(bound: f64, steps: f64) -> Self {
        if steps >= LEAST_STEPS { Self::Within(bound) } else { Self::Unresolved }
    }
}

/// Its name and its unit.
pub(super) type Label = (&'static str, &'static str);

/// A quantity for which the step is exact.
pub(super) fn exactly((name, unit): Label, measured: f64, exact: f64, slack: f64) -> Quantity {
    let (claim, convergence) = (Claim::Equal, Convergence::Exact);
    Quantity { name, unit, measured, discrete: exact, exact, slack, claim, convergence }
}

/// A quantity that may be 0 or less.
pub(super) fn at_most_zero(label: Label, measured: f64, slack: f64) -> Quantity {
    Quantity { claim: Claim::AtMost, ..exactly(label, measured, 0.0, slack) }
}

/// A quantity that is zero in continuous time and at most `most` of the step's.
pub(super) fn at_most(label: Label, measured: f64, most: f64) -> Quantity {
    at_most_zero(label, measured, 0.0).in_steps(most, Convergence::Within(most))
}

impl Quantity {
    /// The same, of which the steps make `discrete`.
    pub(super) fn in_steps(self, discrete: f64, convergence: Convergence) -> Self {
        Self { discrete, convergence, ..self }
    }

    /// measured − discrete.
    #[must_use]
    pub fn error(&self) -> f64 {
        self.measured - self.discrete
    }

    /// Whether the claim holds, to within the slack.
    #[must_use]
    pub fn holds(&self) -> bool {
        match self.claim {
            Claim::Equal => self.error().abs() <= self.slack,
            Claim::AtMost => self.error() <= self.slack,
        }
    }

    /// The order p of measured − exact, which goes like hᵖ, from the same quantity `at_half`
    /// the time step: p = log₂(e(h)/e(h/2)). `None` where none is declared, or where the
    /// slack hides it.
    #[must_use]
    pub fn order(&self, at_half: &Self) -> Option<f64> {
        let Convergence::Order(_) = self.convergence else { return None };
        let uncertainty = self.order_uncertainty() + at_half.order_uncertainty();
        let error = |quantity: &Self| quantity.measured - quantity.exact;
        (uncertainty <= ORDER_UNCERTAINTY).then(|| (error(self) / error(at_half)).abs().log2())
    }

    /// What the slack s of an error e may do to its log₂: s/(|e| ln 2).
    fn order_uncertainty(&self) -> f64 {
        self.slack / ((self.measured - self.exact).abs() * std::f64::consts::LN_2)
    }

    /// Whether discrete and measured answers come to the exact one as they are declared to,
    /// with the same quantity `at_half` the time step.
    #[must_use]
    pub fn converges(&self, at_half: &Self) -> bool {
        let [here, there] = [self, at_half].map(|quantity| quantity.discrete - quantity.exact);
        match self.convergence {
            Convergence::Exact => here.abs() <= self.slack,
            Convergence::Within(bound) => here.abs() <= bound + self.slack,
            Convergence::Unresolved => true,
            Convergence::Order(p) => {
                let near = |order: f64, tolerance| (order - f64::from(p)).abs() <= tolerance;
                let uncertainty = self.order_uncertainty() + at_half.order_uncertainty();
                near((here / there).abs().log2(), ORDER_TOLERANCE)
                    && self
                        .order(at_half)
                        .is_none_or(|order| near(order, ORDER_TOLERANCE + uncertainty))
            }
        }
    }
}
