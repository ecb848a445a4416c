//! Warm-start memory of Ipopt: the last solutions with slacks and multipliers.

use super::start::ProgramStart;
use crate::ipopt::IteratePoint;
use tumble_core::contact::ContactKey;
use tumble_core::step::StepSolution;

/// A solution with its point of the program.
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
struct Remembered {
    solution: StepSolution,
    point: ProgramStart,
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
    pub(super) fn of(contacts: Vec<ContactKey>, point: IteratePoint<'_>) -> Self {
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
    /// True if the memory is valid: at most two solutions, each with the values of its contacts.
    pub(super) fn is_whole(&self) -> bool {
        let is_whole = |known: &Remembered| {
            let values = known.point.values.len();
            values == known.solution.contacts.len()
                && known.point.states.len() == known.solution.states.len()
        };
        self.0.len() <= 2 && self.0.iter().all(is_whole)
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
    pub(super) fn point(&self, solution: &StepSolution) -> Option<&ProgramStart> {
        self.find(solution).map(|known| &known.point)
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
        point: &ProgramStart,
        multipliers: Option<Multipliers>,
    ) {
        self.0.retain(|known| known.solution == *previous);
        self.0.truncate(1);
        let (solution, point) = (solution.clone(), point.clone());
        self.0.push(Remembered { solution, point, multipliers });
    }
}
