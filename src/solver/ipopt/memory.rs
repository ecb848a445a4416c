//! What Ipopt's next step can start from: the last solutions with all that the program knows of
//! them, slacks and multipliers included.

use super::start::ProgramStart;
use crate::ipopt::IteratePoint;
use tumble_core::contact::ContactKey;
use tumble_core::step::StepSolution;

/// A solution with what the program knows of it.
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
struct Remembered {
    solution: StepSolution,
    point: ProgramStart,
    /// Where Ipopt converged to the point itself.
    multipliers: Option<Multipliers>,
}

/// The multipliers of a point that Ipopt converged to, for the contacts it was posed with.
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

    /// Whether they are of a program of so many `variables` and `rows`.
    pub(super) fn fits(&self, variables: usize, rows: usize) -> bool {
        self.constraints.len() == rows && self.lower.len() == variables
    }
}

/// The last solution and the one before it: a step that is taken back starts again from the
/// earlier one.
#[derive(Default)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct IpoptMemory(Vec<Remembered>);

#[cfg(feature = "save")]
impl IpoptMemory {
    /// Whether it can be what a solver kept: at most two solutions, each with the values of its contacts.
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
    /// Forgets all.
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    fn find(&self, solution: &StepSolution) -> Option<&Remembered> {
        self.0.iter().find(|known| known.solution == *solution)
    }

    /// `solution` as a point, if it is one of the last two.
    pub(super) fn point(&self, solution: &StepSolution) -> Option<&ProgramStart> {
        self.find(solution).map(|known| &known.point)
    }

    /// What Ipopt ended with at `solution`, if that is known.
    pub(super) fn multipliers(&self, solution: &StepSolution) -> Option<&Multipliers> {
        self.find(solution).and_then(|known| known.multipliers.as_ref())
    }

    /// Keeps `solution` of the step that followed `previous`, and what is known of that one.
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
