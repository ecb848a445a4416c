//! Rungs of the ladder, each with its reason.

use tumble_core::step::StepStatus;

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
    /// Ipopt from free flight without forces. Discards a bad previous solution.
    FreeFlight,
    /// Ipopt from free flight with the body's weight shared by its contacts. Avoids the apex of the
    /// friction cone, where the derivatives change most.
    SharedWeight,
    /// The native solver's own solution, marked [`StepStatus::Fallback`].
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
    #[must_use]
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

    /// Iteration limit. A good warm start needs few iterations. After 30 iterations from the
    /// previous solution the native start mostly needs fewer than five. After 60 from the native
    /// start another start is cheaper (docs/ipopt-path.md).
    pub(super) fn patience(self) -> u32 {
        match self {
            Self::Warm => 25,
            Self::Previous => 30,
            Self::NativeStart => 60,
            Self::FreeFlight | Self::SharedWeight | Self::Native => u32::MAX,
        }
    }

    /// True if the forces of the start have settled, so that Ipopt should stay near them.
    pub(super) fn has_settled(self) -> bool {
        matches!(self, Self::Warm | Self::NativeStart)
    }

    /// Status of a step solved by this rung.
    pub(super) fn status(self) -> StepStatus {
        match self {
            Self::Warm | Self::Previous => StepStatus::Converged,
            Self::NativeStart | Self::FreeFlight | Self::SharedWeight => StepStatus::Retried,
            Self::Native => StepStatus::Fallback,
        }
    }

    pub(super) fn asks_native(self) -> bool {
        matches!(self, Self::NativeStart | Self::Native)
    }
}
