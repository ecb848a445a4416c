//! What Ipopt's next step can start from: the last solutions with all that the program knows of
//! them, slacks and multipliers included.

use crate::ipopt::Point;
use crate::step::StepSolution;

/// A solution as a point of the program, `P`, and what Ipopt ended with, `M`.
#[derive(Clone)]
pub(super) struct Remembered<P, M> {
    solution: StepSolution,
    pub(super) point: P,
    /// Where Ipopt converged to the point itself.
    pub(super) multipliers: Option<M>,
}

/// The multipliers of a point that Ipopt converged to, for the flags it was solved with.
#[derive(Clone)]
pub(super) struct Multipliers {
    pub(super) flags: Vec<bool>,
    pub(super) constraints: Vec<f64>,
    pub(super) lower: Vec<f64>,
    pub(super) upper: Vec<f64>,
}

impl Multipliers {
    pub(super) fn of(flags: &[bool], point: Point<'_>) -> Self {
        Self {
            flags: flags.to_vec(),
            constraints: point.constraint_multipliers.to_vec(),
            lower: point.lower_multipliers.to_vec(),
            upper: point.upper_multipliers.to_vec(),
        }
    }
}

/// The last solution and the one before it: a step that is taken back starts again from the
/// earlier one.
pub(super) struct Memory<P, M> {
    entries: Vec<Remembered<P, M>>,
}

impl<P, M> Default for Memory<P, M> {
    fn default() -> Self {
        Self { entries: Vec::new() }
    }
}

impl<P: Clone, M> Memory<P, M> {
    /// Forgets all.
    pub(super) fn clear(&mut self) {
        self.entries.clear();
    }

    /// What is known of `solution`, if it is one of the last two.
    pub(super) fn find(&self, solution: &StepSolution) -> Option<&Remembered<P, M>> {
        self.entries.iter().find(|entry| entry.solution == *solution)
    }

    /// What Ipopt ended with at `solution`, if that is known.
    pub(super) fn multipliers(&self, solution: &StepSolution) -> Option<&M> {
        self.find(solution).and_then(|known| known.multipliers.as_ref())
    }

    /// Keeps `solution` of the step that followed `previous`, and what is known of that one.
    pub(super) fn keep(
        &mut self,
        previous: &StepSolution,
        solution: &StepSolution,
        point: &P,
        multipliers: Option<M>,
    ) {
        self.entries.retain(|entry| entry.solution == *previous);
        self.entries.truncate(1);
        let (solution, point) = (solution.clone(), point.clone());
        self.entries.push(Remembered { solution, point, multipliers });
    }
}
