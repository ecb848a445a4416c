//! Colliders near each other: the pairs of the broad phase, by collider.

use super::collider::{Collider, Colliders, PieceOwner};
use super::memory::Neighbour;
use crate::world::World;

/// For each piece of a body, the colliders whose boxes overlap its box.
#[derive(Debug, Clone, Default)]
pub(super) struct Partners {
    colliders: Colliders,
    /// Number of the first piece of each body, and the number after the last.
    first: Vec<usize>,
    /// First entry of each piece in `list`.
    starts: Vec<u32>,
    list: Vec<usize>,
    /// Workspace: next free entry of each piece.
    next: Vec<u32>,
    /// False if the pairs may have changed.
    is_known: bool,
}

impl Partners {
    /// The pairs may have changed.
    pub(super) fn forget(&mut self) {
        self.is_known = false;
    }

    /// Updates the lists from the `pairs`, if they may have changed.
    pub(super) fn update(&mut self, world: &World, colliders: &Colliders, pairs: &[Neighbour]) {
        if self.is_known {
            return;
        }
        self.is_known = true;
        self.colliders.copy_from(colliders);
        let Self { first, starts, list, next, .. } = self;
        first.clear();
        first.push(0);
        for body in world.bodies() {
            first.push(first[first.len() - 1] + body.pieces().len());
        }
        let count = first[first.len() - 1];
        let ends = |pair: &Neighbour| {
            let [a, b] = pair.colliders;
            [(a, b), (b, a)].into_iter().filter(move |(one, _)| *one < count)
        };
        starts.clear();
        starts.resize(count + 1, 0);
        for (one, _) in pairs.iter().flat_map(ends) {
            starts[one + 1] += 1;
        }
        for at in 0..count {
            starts[at + 1] += starts[at];
        }
        list.clear();
        list.resize(starts[count] as usize, 0);
        next.clone_from(starts);
        for (one, other) in pairs.iter().flat_map(ends) {
            list[next[one] as usize] = other;
            next[one] += 1;
        }
    }

    /// Colliders near the piece `number`; none for a fixed collider.
    fn get(&self, number: usize) -> &[usize] {
        match self.starts.get(number..number + 2) {
            Some(&[from, to]) => &self.list[from as usize..to as usize],
            _ => &[],
        }
    }

    /// Number of a collider. `None` if it does not exist.
    pub(super) fn number(&self, owner: PieceOwner, piece: usize) -> Option<usize> {
        match owner {
            PieceOwner::Fixed(index) => self.colliders.number_of_fixed(index, piece),
            PieceOwner::Body(body) => {
                let number = self.first.get(body)? + piece;
                (number < *self.first.get(body + 1)?).then_some(number)
            }
        }
    }

    /// True if some other collider is near one of the `numbers` of a pair.
    pub(super) fn has_others(&self, numbers: [usize; 2]) -> bool {
        numbers
            .into_iter()
            .any(|number| self.get(number).len() > 1 || self.siblings(number).len() > 1)
    }

    /// True if `is` holds for the owners of all colliders near both pieces of a pair.
    pub(super) fn are_all(&self, numbers: [usize; 2], is: impl Fn(PieceOwner) -> bool) -> bool {
        let mut all = true;
        self.each_near(numbers, &mut |_, collider| all &= is(collider.owner));
        all
    }

    /// Visits the numbers of the colliders near both pieces of a pair: near the one with fewer
    /// partners, and the other pieces of its body.
    pub(super) fn each_near(&self, [a, b]: [usize; 2], visit: &mut dyn FnMut(usize, Collider)) {
        let is_body = matches!(self.colliders.at(b).owner, PieceOwner::Body(_));
        let near = if is_body && self.get(b).len() < self.get(a).len() { b } else { a };
        for &number in self.get(near) {
            visit(number, self.colliders.at(number));
        }
        for number in self.siblings(near) {
            visit(number, self.colliders.at(number));
        }
    }

    /// Numbers of the pieces of the body with the piece `number`.
    fn siblings(&self, number: usize) -> std::ops::Range<usize> {
        match self.colliders.at(number).owner {
            PieceOwner::Body(body) => self.first[body]..self.first[body + 1],
            PieceOwner::Fixed(_) => 0..0,
        }
    }
}
