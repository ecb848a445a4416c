//! Return status of a solve.

use std::fmt;

/// Ipopt's `ApplicationReturnStatus` with every documented value. [`Unknown`](Self::Unknown) holds
/// any other number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ReturnStatus {
    /// 0: optimal to the tolerance.
    SolveSucceeded,
    /// 1: only the looser "acceptable" tolerances were met.
    SolvedToAcceptableLevel,
    /// 2: converged to a point of local infeasibility.
    InfeasibleProblemDetected,
    /// 3: steps became too small to make progress.
    SearchDirectionBecomesTooSmall,
    /// 4: the iterates diverge.
    DivergingIterates,
    /// 5: the intermediate callback requested the end.
    UserRequestedStop,
    /// 6: a feasible point of a square problem.
    FeasiblePointFound,
    /// −1: the iteration limit was reached.
    MaximumIterationsExceeded,
    /// −2: the restoration phase failed.
    RestorationFailed,
    /// −3: an unrecoverable error in the computation of a step.
    ErrorInStepComputation,
    /// −4: the limit on processor time was reached.
    MaximumCpuTimeExceeded,
    /// −5: the limit on wall time was reached (3.14).
    MaximumWallTimeExceeded,
    /// −10: fewer free variables than equality constraints.
    NotEnoughDegreesOfFreedom,
    /// −11: the problem definition is inconsistent.
    InvalidProblemDefinition,
    /// −12: an option's value or a solver that it names is not available.
    InvalidOption,
    /// −13: a callback refused or returned a number that is not finite.
    InvalidNumberDetected,
    /// −100: an exception without a more specific status.
    UnrecoverableException,
    /// −101: an exception that is not Ipopt's.
    NonIpoptExceptionThrown,
    /// −102: out of memory.
    InsufficientMemory,
    /// −199: an internal error.
    InternalError,
    /// A number that this version of the wrapper does not know.
    Unknown(i32),
}

/// Table of numbers, variants and Ipopt's names.
const KNOWN: [(i32, ReturnStatus, &str); 20] = {
    use ReturnStatus as S;
    [
        (0, S::SolveSucceeded, "Solve_Succeeded"),
        (1, S::SolvedToAcceptableLevel, "Solved_To_Acceptable_Level"),
        (2, S::InfeasibleProblemDetected, "Infeasible_Problem_Detected"),
        (3, S::SearchDirectionBecomesTooSmall, "Search_Direction_Becomes_Too_Small"),
        (4, S::DivergingIterates, "Diverging_Iterates"),
        (5, S::UserRequestedStop, "User_Requested_Stop"),
        (6, S::FeasiblePointFound, "Feasible_Point_Found"),
        (-1, S::MaximumIterationsExceeded, "Maximum_Iterations_Exceeded"),
        (-2, S::RestorationFailed, "Restoration_Failed"),
        (-3, S::ErrorInStepComputation, "Error_In_Step_Computation"),
        (-4, S::MaximumCpuTimeExceeded, "Maximum_CpuTime_Exceeded"),
        (-5, S::MaximumWallTimeExceeded, "Maximum_WallTime_Exceeded"),
        (-10, S::NotEnoughDegreesOfFreedom, "Not_Enough_Degrees_Of_Freedom"),
        (-11, S::InvalidProblemDefinition, "Invalid_Problem_Definition"),
        (-12, S::InvalidOption, "Invalid_Option"),
        (-13, S::InvalidNumberDetected, "Invalid_Number_Detected"),
        (-100, S::UnrecoverableException, "Unrecoverable_Exception"),
        (-101, S::NonIpoptExceptionThrown, "NonIpopt_Exception_Thrown"),
        (-102, S::InsufficientMemory, "Insufficient_Memory"),
        (-199, S::InternalError, "Internal_Error"),
    ]
};

impl ReturnStatus {
    /// Variant of Ipopt's number.
    pub fn from_code(code: i32) -> Self {
        let known = KNOWN.iter().find(|(known, ..)| *known == code);
        known.map_or(Self::Unknown(code), |(_, status, _)| *status)
    }

    fn row(self) -> Option<&'static (i32, Self, &'static str)> {
        KNOWN.iter().find(|(_, status, _)| *status == self)
    }

    /// Ipopt's number.
    pub fn code(self) -> i32 {
        match self {
            Self::Unknown(code) => code,
            known => known.row().map_or(i32::MIN, |(code, ..)| *code),
        }
    }

    /// Ipopt's name of the status, `Solve_Succeeded` for example.
    pub fn name(self) -> &'static str {
        self.row().map_or("Unknown_Status", |(.., name)| name)
    }

    /// True if the solve met the requested tolerance. The acceptable level does not count.
    pub fn is_success(self) -> bool {
        self == Self::SolveSucceeded
    }

    /// True if Ipopt started iterating, so that its point is meaningful.
    pub fn has_point(self) -> bool {
        matches!(self.code(), -4..=6) || self == Self::MaximumWallTimeExceeded
    }
}

impl fmt::Display for ReturnStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown(code) => write!(f, "Unknown_Status ({code})"),
            known => f.write_str(known.name()),
        }
    }
}

#[cfg(test)]
#[path = "tests/status.rs"]
mod tests;
