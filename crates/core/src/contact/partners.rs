//! Colliders near each other: the pairs of the broad phase, by collider.

use super::collider::{Collider, Colliders, PieceOwner, placed};
use super::memory::Neighbour;
use crate::geometry::Piece;
use crate::world::World;
use nalgebra::Vector3;
use std::ops::Range;

/// Radius of the ball about a fixed piece in which its neighbours are listed, over the radius of the
/// piece, and the part of it in which they are used. Touching points are on the piece to a small
/// fraction of its size.
const LISTED: f64 = 1.1;
const USED: f64 = 1.05;

/// For each piece of a body, the colliders whose boxes overlap its box.
#[derive(Debug, Clone, Default)]
pub(super) struct Partners {
    colliders: Colliders,
    /// Number of the first piece of each body, and the number after the last.
    first: Vec<usize>,
    /// First entry of each piece in `list`.
    starts: Vec<u32>,
    list: Vec<usize>,
    /// For each entry of `list`, the range of `around` with the pieces near both, if they are listed.
    pairs: Vec<Option<Range<u32>>>,
    around: Vec<usize>,
    /// Workspace: next free entry of each piece.
    next: Vec<u32>,
    /// False if the pairs may have changed.
    is_known: bool,
    /// Number of updates of the lists.
    version: u64,
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
        self.version += 1;
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
        self.pairs.clear();
        self.pairs.resize(self.list.len(), None);
        self.around.clear();
    }

    /// Lists the pieces around the fixed piece `b` that are near the piece `a` of a body, for
    /// [`Partners::each_at`]. The other fixed pieces do not move, so the list holds until the pairs change.
    pub(super) fn list_around(&mut self, world: &World, [a, b]: [usize; 2]) {
        let Some(entry) = self.entry([a, b]).filter(|entry| self.pairs[*entry].is_none()) else {
            return;
        };
        let fixed = |number: usize| match self.colliders.at(number) {
            Collider { owner: PieceOwner::Body(_), .. } => None,
            collider => Some(placed(world, &[], collider).0),
        };
        let Some(piece) = fixed(b) else { return };
        let first = self.around.len();
        let is_away = |other: &Piece| {
            let apart = other.core().centre() - piece.core().centre();
            let reach = LISTED * (other.bounding_radius() + piece.bounding_radius());
            apart.norm_squared() > reach * reach
        };
        let mut around = std::mem::take(&mut self.around);
        let near = self.get(a).iter().copied().filter(|other| !fixed(*other).is_some_and(is_away));
        around.extend(near.chain(self.siblings(a)));
        self.pairs[entry] = Some(first as u32..around.len() as u32);
        self.around = around;
    }

    /// Entry in `list` of the collider `b` near the piece `a` of a body.
    fn entry(&self, [a, b]: [usize; 2]) -> Option<usize> {
        let first = *self.starts.get(a)? as usize;
        self.get(a).binary_search(&b).ok().map(|place| first + place)
    }

    /// Visits the colliders near both pieces of a pair that may reach the point `x` (m, world), as
    /// [`Partners::each_near`] does.
    pub(super) fn each_at(
        &self,
        world: &World,
        numbers: [usize; 2],
        x: &Vector3<f64>,
        visit: &mut dyn FnMut(usize, Collider),
    ) {
        let is_within = |number: usize| {
            let piece = placed(world, &[], self.colliders.at(number)).0;
            let reach = USED * piece.bounding_radius();
            (x - piece.core().centre()).norm_squared() <= reach * reach
        };
        let listed = self.entry(numbers).and_then(|entry| self.pairs[entry].clone());
        match listed.filter(|_| is_within(numbers[1])) {
            Some(range) => {
                for &number in &self.around[range.start as usize..range.end as usize] {
                    visit(number, self.colliders.at(number));
                }
            }
            None => self.each_near(numbers, visit),
        }
    }

    /// Number of updates of the lists: they are the same as long as it is.
    pub(super) fn version(&self) -> u64 {
        self.version
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
    fn siblings(&self, number: usize) -> Range<usize> {
        match self.colliders.at(number).owner {
            PieceOwner::Body(body) => self.first[body]..self.first[body + 1],
            PieceOwner::Fixed(_) => 0..0,
        }
    }
}
