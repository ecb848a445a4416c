//! Rungs of the ladder, each with its reason.

/// Start point of a solve.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Rung {
    /// Ipopt from the previous step's solution and multipliers, if Ipopt found that solution with
    /// the same contacts. Suits rest and sliding, where little changes.
    Warm,
    /// Ipopt from the previous step's solution alone, the tutorial's start.
    Previous,
    /// Ipopt from the native solver's point, with the contacts that carry a force there. A contact
    /// that lifts off while it slips leaves the program without a feasible optimum
    /// (docs/formulation.md, section 8).
    NativeStart,
    /// Ipopt from free flight without forces, and without grazing contacts. Discards a bad previous
    /// solution.
    FreeFlight,
    /// Ipopt from free flight with the body's weight shared by its contacts. Avoids the apex of the
    /// friction cone, where the derivatives change most.
    SharedWeight,
    /// The native solver's own solution, marked [`StepStatus::Fallback`](crate::StepStatus::Fallback).
    Native,
}

impl Rung {
    /// All rungs, in their order.
    pub const ALL: [Self; 6] = [
        Self::Warm,
        Self::Previous,
        Self::NativeStart,
        Self::FreeFlight,
        Self::SharedWeight,
        Self::Native,
    ];

    /// Name in run.json.
    pub fn name(self) -> &'static str {
        match self {
            Self::Warm => "warm",
            Self::Previous => "previous",
            Self::NativeStart => "native_start",
            Self::FreeFlight => "free_flight",
            Self::SharedWeight => "shared_weight",
            Self::Native => "native",
        }
    }
}
