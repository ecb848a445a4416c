//! Slopes of couplings that are good for the next matrix, too.

use super::CouplingLink;
use crate::solver::native::coupling::Coupling;
use crate::solver::native::equations::Velocity;
use crate::solver::native::member::IslandBody;

/// Of which points the slopes of an island's couplings are.
#[derive(Debug, Clone, Default)]
pub(in super::super) struct KeptSlopes {
    /// The problem that they are of, by its [number](super::Island::begun); 0 for none.
    problem: u64,
    /// V of every body for which those of its couplings were made, and whether it has left that by more than they may be off.
    made: Vec<Velocity>,
    moved: Vec<bool>,
    /// Of every coupling, whether its slope is the one for these.
    known: Vec<bool>,
}

impl KeptSlopes {
    /// Goes on to the matrix at `velocity` of the problem of this number with these bodies, in which slopes may be off by `slack`,
    /// in parts of themselves. Returns whether some may be kept; where none may, that of every coupling is asked for anew.
    pub(super) fn follow(
        &mut self,
        (problem, members): (u64, &[IslandBody]),
        velocity: &[Velocity],
        slack: f64,
    ) -> bool {
        let keeps = self.problem == problem && slack > 0.0;
        if !keeps {
            // What is made without slack may serve one with it.
            self.problem = problem;
            self.made.clear();
            self.made.extend_from_slice(velocity);
            self.known.clear();
        }
        self.moved.clear();
        let bodies = self.made.iter_mut().zip(velocity).zip(members);
        self.moved.extend(bodies.map(|((made, now), member)| {
            let moved = member.turns_by(made, now) > slack;
            if moved {
                *made = *now;
            }
            moved
        }));
        keeps
    }

    /// Whether the slope of coupling `index` is known. Where it `is_asked` for it is from now on, being made where it was not. The
    /// slope of what bounces is another one on each side of a speed, and not kept.
    pub(super) fn are_of(
        &mut self,
        index: usize,
        (link, coupling): (&CouplingLink, &Coupling),
        is_asked: bool,
    ) -> bool {
        if index == self.known.len() {
            self.known.push(is_asked);
            return false;
        }
        let moved = self.moved[link.a] || link.b.as_ref().is_some_and(|b| self.moved[b.index]);
        let is_known = self.known[index] && !moved && !coupling.bounces();
        self.known[index] = is_known || is_asked;
        is_known
    }
}
