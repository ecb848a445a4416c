//! Colliders near each other: the pairs of the broad phase, by collider.

use super::collider::{Collider, Colliders, PieceOwner, placed};
use super::hidden_parts::{HiddenPart, hidden_parts};
use super::memory::Neighbour;
use super::{Contact, Partner};
use crate::geometry::{CorePart, Piece};
use crate::world::World;
use nalgebra::Vector3;
use std::ops::Range;

/// Radius of the ball about a fixed piece in which its neighbours are listed, over the radius of the
/// piece, and the part of it in which they are used. Touching points are on the piece to a small
/// fraction of its size.
const LISTED: f64 = 1.1;
const USED: f64 = 1.05;

/// Ranges of the lists of a pair of a body's piece and a fixed one; `None` if they are not made.
#[derive(Debug, Clone, Default)]
struct PairLists {
    around: Option<Range<u32>>,
    hidden: Option<Range<u32>>,
}

/// For each piece of a body, the colliders whose boxes overlap its box.
#[derive(Debug, Clone, Default)]
pub(super) struct Partners {
    colliders: Colliders,
    /// Number of the first piece of each body, and the number after the last.
    first: Vec<usize>,
    /// First entry of each piece in `list`.
    starts: Vec<u32>,
    list: Vec<usize>,
    /// For each entry of `list`, what is listed for the pair.
    pairs: Vec<PairLists>,
    around: Vec<usize>,
    /// Hidden parts that the pieces near a pair hide: a fixed piece, and an index in its list.
    hidden: Vec<(u32, u32)>,
    /// Fixed pieces whose hidden parts are known, in ascending order, and the places of their lists.
    known: Vec<(usize, u32)>,
    parts: Vec<Box<[HiddenPart]>>,
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

    /// The pieces of the world may have changed.
    pub(super) fn forget_pieces(&mut self) {
        self.forget();
        self.known.clear();
        self.parts.clear();
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
        self.pairs.resize(self.list.len(), PairLists::default());
        self.around.clear();
        self.hidden.clear();
    }

    /// Lists the pieces around the fixed piece `b` that are near the piece `a` of a body, for
    /// [`Partners::each_at`]. The other fixed pieces do not move, so the list holds until the pairs change.
    pub(super) fn list_around(&mut self, world: &World, [a, b]: [usize; 2]) {
        let Some(entry) = self.entry_with_faces(world, [a, b]) else { return };
        if self.pairs[entry].around.is_some() {
            return;
        }
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
        self.pairs[entry].around = Some(first as u32..around.len() as u32);
        self.around = around;
    }

    /// Lists the parts of the fixed piece `b` that pieces near the piece `a` of a body hide from it, for
    /// [`Partners::is_hidden`].
    pub(super) fn list_hidden(&mut self, world: &World, [a, b]: [usize; 2]) {
        let Some(entry) = self.entry_with_faces(world, [a, b]) else { return };
        if self.pairs[entry].hidden.is_some() {
            return;
        }
        let table = match self.known.binary_search_by_key(&b, |(number, _)| *number) {
            Ok(place) => self.known[place].1,
            Err(place) => {
                let table = self.parts.len() as u32;
                self.parts.push(hidden_parts(world, &self.colliders, b).into());
                self.known.insert(place, (b, table));
                table
            }
        };
        let own = self.colliders.at(b).owner;
        let may_hide = |number: &usize| {
            let other = self.colliders.at(*number).owner;
            let may_touch = match self.colliders.at(a).owner {
                PieceOwner::Body(body) => world.may_touch(body, other.partner()),
                PieceOwner::Fixed(_) => false,
            };
            (other == own || may_touch) && self.get(a).binary_search(number).is_ok()
        };
        let parts = self.parts[table as usize].iter().enumerate();
        let parts = parts.filter(|(_, part)| part.by.iter().all(may_hide));
        let parts: Vec<_> = parts.map(|(part, _)| (table, part as u32)).collect();
        let first = self.hidden.len() as u32;
        self.hidden.extend(parts);
        self.pairs[entry].hidden = Some(first..self.hidden.len() as u32);
    }

    /// True if other fixed pieces hide the `part` of the second, fixed piece of a pair at `point` (m) from a
    /// contact with the outward `normal`, see [`HiddenPart::hides`]. False if it is not known.
    pub(super) fn is_hidden(
        &self,
        numbers: [usize; 2],
        part: CorePart,
        (point, normal): (&Vector3<f64>, &Vector3<f64>),
        within: f64,
    ) -> bool {
        let listed = self.entry(numbers).and_then(|entry| self.pairs[entry].hidden.as_ref());
        let hidden = listed.map_or(0..0, |range| range.start as usize..range.end as usize);
        self.hidden[hidden].iter().any(|(table, place)| {
            self.parts[*table as usize][*place as usize].hides(part, point, normal, within)
        })
    }

    /// Entry of the fixed piece `b` near the piece `a` of a body, if `a` has faces. A ball or a capsule touches
    /// one or two points of a piece, and its lists cost more than they save. None for the plane of a patch of
    /// triangles, whose edges are far away.
    fn entry_with_faces(&self, world: &World, [a, b]: [usize; 2]) -> Option<usize> {
        let [own, other] = [a, b].map(|number| self.colliders.at(number));
        let (PieceOwner::Body(body), PieceOwner::Fixed(index)) = (own.owner, other.owner) else {
            return None;
        };
        if world.terrain(index).is_some_and(|terrain| terrain.is_plane(other.piece)) {
            return None;
        }
        let has_faces = !world.bodies()[body].pieces()[own.piece].core().faces().is_empty();
        has_faces.then(|| self.entry([a, b])).flatten()
    }

    /// True if the collider `b` is near the piece `a` of a body.
    pub(super) fn are_near(&self, pair: [usize; 2]) -> bool {
        self.entry(pair).is_some()
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
        let listed = self.entry(numbers).and_then(|entry| self.pairs[entry].around.as_ref());
        match listed.filter(|_| is_within(numbers[1])) {
            Some(around) => {
                for &number in &self.around[around.start as usize..around.end as usize] {
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

    /// Colliders of a contact with their numbers, A first. `None` for the ground, and without such pieces.
    pub(super) fn colliders_of(&self, contact: &Contact) -> Option<[(usize, Collider); 2]> {
        let pair = contact.key.pair?;
        let collider = |owner: PieceOwner, piece: usize| {
            let number = self.number(owner, piece)?;
            Some((number, Collider { owner, piece }))
        };
        let owner = match contact.key.partner {
            Partner::Body(body) => PieceOwner::Body(body),
            Partner::Fixed(index) => PieceOwner::Fixed(index),
            Partner::Ground => return None,
        };
        let body = PieceOwner::Body(contact.key.body);
        Some([collider(body, pair.pieces.0)?, collider(owner, pair.pieces.1)?])
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
