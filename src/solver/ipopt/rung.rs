//! The rungs of the ladder, each with its reason.

use tumble_core::step::StepStatus;

/// How a step came to be solved.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Rung {
    /// Ipopt from the previous step's solution with its multipliers, where Ipopt found that
    /// solution itself for the same flags: at rest and in sliding little changes.
    Warm,
    /// Ipopt from the previous step's solution alone, the tutorial's start.
    Previous,
    /// Ipopt from the native solver's point, with the flags of the contacts that carry a
    /// force there: a flagged contact that lifts off while it slips leaves the program
    /// without a feasible optimum (docs/formulation.md, section 8).
    NativeStart,
    /// Ipopt from free flight without forces: forgets a bad previous solution.
    FreeFlight,
    /// Ipopt from free flight with the body's weight shared by the flagged contacts: off
    /// the corner of the cone, where the program's derivatives bend most.
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

    /// The word of run.json.
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

    /// How many iterations to wait for. A warm start that is near enough takes few; where the previous
    /// solution alone has not led to the end in 30, the native start mostly does in less than five, and
    /// where that has taken 60 it mostly goes on to its limit, and another start is cheaper
    /// (docs/ipopt-path.md).
    pub(super) fn patience(self) -> u32 {
        match self {
            Self::Warm => 25,
            Self::Previous => 30,
            Self::NativeStart => 60,
            Self::FreeFlight | Self::SharedWeight | Self::Native => u32::MAX,
        }
    }

    /// Whether the forces of its start have settled, so that Ipopt is to stay near them.
    pub(super) fn has_settled(self) -> bool {
        matches!(self, Self::Warm | Self::NativeStart)
    }

    /// How the step counts that this rung solved.
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
