//! Warm-start memory of Ipopt: the last solutions with slacks and multipliers.

use crate::ipopt::IteratePoint;
use crate::step_nlp::ProgramPoint;
use tumble_core::contact::ContactKey;
use tumble_core::step::StepSolution;

/// A solution with its point of the program.
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
struct Remembered {
    solution: StepSolution,
    point: Vec<f64>,
    /// Multipliers, if Ipopt itself converged to this point.
    multipliers: Option<Multipliers>,
}

/// Multipliers of a converged point, for the contacts of its program.
#[derive(Clone)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Multipliers {
    pub(super) contacts: Vec<ContactKey>,
    pub(super) constraints: Vec<f64>,
    pub(super) lower: Vec<f64>,
    pub(super) upper: Vec<f64>,
}

impl Multipliers {
    pub(super) fn new(contacts: Vec<ContactKey>, point: IteratePoint<'_>) -> Self {
        Self {
            contacts,
            constraints: point.constraint_multipliers.to_vec(),
            lower: point.lower_multipliers.to_vec(),
            upper: point.upper_multipliers.to_vec(),
        }
    }

    /// True if the multipliers fit a program of this size.
    pub(super) fn fits(&self, variables: usize, rows: usize) -> bool {
        self.constraints.len() == rows && self.lower.len() == variables
    }
}

/// Last two solutions. If a step is undone, the next one starts from the earlier solution.
#[derive(Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct IpoptMemory(Vec<Remembered>);

#[cfg(feature = "save")]
impl IpoptMemory {
    /// True if the memory is valid: at most two solutions, each with a point of `variables` numbers.
    pub(super) fn is_whole(&self, variables: usize) -> bool {
        self.0.len() <= 2 && self.0.iter().all(|known| known.point.len() == variables)
    }
}

impl IpoptMemory {
    /// Deletes all solutions.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    fn find(&self, solution: &StepSolution) -> Option<&Remembered> {
        self.0.iter().find(|known| known.solution == *solution)
    }

    /// Point of `solution`, if it is one of the last two.
    pub(super) fn point(&self, solution: &StepSolution) -> Option<&[f64]> {
        self.find(solution).map(|known| known.point.as_slice())
    }

    /// Ipopt's multipliers at `solution`, if known.
    pub(super) fn multipliers(&self, solution: &StepSolution) -> Option<&Multipliers> {
        self.find(solution).and_then(|known| known.multipliers.as_ref())
    }

    /// Stores `solution` of the step after `previous`, and keeps the entry of `previous`.
    pub(super) fn keep(
        &mut self,
        previous: &StepSolution,
        solution: &StepSolution,
        point: &ProgramPoint,
        multipliers: Option<Multipliers>,
    ) {
        self.0.retain(|known| known.solution == *previous);
        self.0.truncate(1);
        let solution = solution.clone();
        let point = point.as_slice().to_vec();
        self.0.push(Remembered { solution, point, multipliers });
    }
}
