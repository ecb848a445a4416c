//! State of the contact search from step to step.

use super::collider::{Colliders, PieceOwner};
use super::collision::PairState;
use super::{Contact, ContactKey, Partner};
use crate::geometry::{Aabb, Hint};
use crate::mechanics::{Pose, State};
#[cfg(feature = "save")]
use crate::world::World;
use crate::world::without;
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// Pose of an unknown body.
pub(super) const NOWHERE: Pose = Pose {
    position: Vector3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
    rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
};

/// A pair of colliders that may touch.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Neighbour {
    /// Indices of the colliders, the first one of a body.
    pub(super) colliders: [usize; 2],
    pub(super) hint: Hint,
    /// Separation at its last evaluation (m). It is only a lower bound if `is_bound`.
    pub(super) gap: f64,
    /// True if `gap` is a lower bound.
    pub(super) is_bound: bool,
    /// True if two polyhedra touched at the last step's start, with points that other pieces hide only.
    pub(super) is_hidden: bool,
    /// Range of the pair's contacts at the last step's start in [`Memory::pair_contacts`].
    pub(super) contacts: Range<usize>,
    /// Room at the last step's start, for a triangle of a terrain.
    #[cfg_attr(feature = "save", serde(skip))]
    pub(super) clearance: Clearance,
}

/// Lower bound on the separation of a pair at some poses (m). It makes searches faster and does not
/// change their results, so it is not saved, and all are equal.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Clearance(pub(super) f64);

impl PartialEq for Clearance {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl Neighbour {
    pub(super) fn owners(&self, colliders: &Colliders) -> [PieceOwner; 2] {
        self.colliders.map(|at| colliders.at(at).owner)
    }

    pub(super) fn looked(&mut self, colliders: &Colliders) -> PairState<'_> {
        let numbers = self.colliders;
        let colliders = numbers.map(|at| colliders.at(at));
        let Self { hint, gap, is_bound, is_hidden, .. } = self;
        PairState { colliders, numbers, hint, gap, is_bound, is_hidden: *is_hidden }
    }
}

/// State of the contact search over the steps. Together with the world it is all that another
/// search needs to continue.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Memory {
    /// Enlarged boxes of the bodies' pieces, in the order of colliders. Boxes of fixed pieces are
    /// in the sweep.
    pub(super) boxes: Vec<Aabb>,
    /// Poses of the bodies when the boxes were made.
    pub(super) searched: Vec<Pose>,
    /// Pairs in ascending order of their colliders.
    pub(super) pairs: Vec<Neighbour>,
    /// States of the bodies at the last evaluation of the gaps.
    pub(super) end: Vec<State>,
    /// States at the start of the step whose end was searched last.
    pub(super) from: Vec<State>,
    /// Poses at the last step's start. A pair of bodies that have not moved reuses its contacts.
    pub(super) start: Vec<Pose>,
    /// Contacts at the last step's start, by pair.
    pub(super) pair_contacts: Vec<Contact>,
    /// Contacts added within the last step. They stay while neither body moves, because the bodies
    /// would otherwise collide again.
    pub(super) added: Vec<Contact>,
}

impl Memory {
    /// True if there was no search yet.
    pub(crate) fn is_empty(&self) -> bool {
        self.end.is_empty()
    }

    /// Copies `other` into the buffers of this one.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        let Self { boxes, searched, pairs, end, from, start, pair_contacts, added } = other;
        self.boxes.clone_from(boxes);
        self.searched.clone_from(searched);
        self.pairs.clone_from(pairs);
        self.end.clone_from(end);
        self.from.clone_from(from);
        self.start.clone_from(start);
        self.pair_contacts.clone_from(pair_contacts);
        self.added.clone_from(added);
    }

    /// True if this state fits `world`: all its counts match, and all bodies and pieces exist.
    #[cfg(feature = "save")]
    pub(crate) fn fits(&self, world: &World) -> bool {
        let bodies = world.bodies().len();
        let pieces = Colliders::new(world).collider_count();
        let own = world.bodies().iter().map(|body| body.pieces().len()).sum();
        let one_a_body = |count: usize| count == 0 || count == bodies;
        let is_searched =
            self.boxes.is_empty() || self.boxes.len() == own && self.searched.len() == bodies;
        let is_known = |pair: &Neighbour| {
            let [first, second] = pair.colliders;
            let Range { start, end } = pair.contacts;
            first < own && second < pieces && start <= end && end <= self.pair_contacts.len()
        };
        is_searched
            && [self.end.len(), self.from.len(), self.start.len()].into_iter().all(one_a_body)
            && self.pairs.iter().all(is_known)
            && self.pairs.is_sorted_by(|a, b| a.colliders < b.colliders)
            && self.pair_contacts.iter().chain(&self.added).all(|contact| contact.key.is_of(world))
    }

    /// Removes the pairs and contacts of a body with the given pieces.
    pub(super) fn forget(&mut self, body: usize, pieces: &Range<usize>) {
        let piece = |piece: usize| (!pieces.contains(&piece)).then_some(piece);
        self.renumber(piece, |other| (other != body).then_some(other));
    }

    /// Requests a new search for a body.
    pub(super) fn expect(&mut self, body: usize) {
        self.boxes.clear();
        self.end.clear();
        self.from.clear();
        if let Some(pose) = self.start.get_mut(body) {
            *pose = NOWHERE;
        }
    }

    /// Removes a body with the given pieces from the world; the following ones move up.
    pub(super) fn remove(&mut self, body: usize, pieces: &Range<usize>) {
        let piece = |piece: usize| match piece {
            before if before < pieces.start => Some(before),
            after if after >= pieces.end => Some(after - pieces.len()),
            _ => None,
        };
        self.renumber(piece, |other| without(other, body));
        if self.boxes.len() >= pieces.end {
            self.boxes.drain(pieces.clone());
        }
        for poses in [&mut self.searched, &mut self.start] {
            if body < poses.len() {
                poses.remove(body);
            }
        }
        for states in [&mut self.end, &mut self.from] {
            if body < states.len() {
                states.remove(body);
            }
        }
    }

    /// Adds a last body with the given pieces to the world.
    pub(super) fn add(&mut self, body: usize, pieces: &Range<usize>) {
        let moved = |piece: usize| {
            if piece < pieces.start { Some(piece) } else { Some(piece + pieces.len()) }
        };
        self.renumber(moved, Some);
        self.start.resize(body + 1, NOWHERE);
        self.expect(body);
    }

    /// Renumbers pieces and bodies in the same order. Pairs and contacts without a new number are
    /// removed.
    fn renumber(
        &mut self,
        piece: impl Fn(usize) -> Option<usize>,
        body: impl Fn(usize) -> Option<usize> + Copy,
    ) {
        let Self { pairs, pair_contacts, added, .. } = self;
        let renumbered =
            |contact: &Contact| Some(Contact { key: contact.key.renumbered(body)?, ..*contact });
        let before = std::mem::take(pair_contacts);
        pairs.retain_mut(|pair| {
            let (Some(first), Some(second)) = (piece(pair.colliders[0]), piece(pair.colliders[1]))
            else {
                return false;
            };
            pair.colliders = [first, second];
            let begin = pair_contacts.len();
            pair_contacts.extend(before[pair.contacts.clone()].iter().filter_map(renumbered));
            pair.contacts = begin..pair_contacts.len();
            true
        });
        *added = added.iter().filter_map(renumbered).collect();
    }
}

impl ContactKey {
    /// Renumbers the bodies of this key; `None` if one has no new number.
    pub(crate) fn renumbered(&self, body: impl Fn(usize) -> Option<usize>) -> Option<Self> {
        let partner = match self.partner {
            Partner::Body(other) => Partner::Body(body(other)?),
            fixed @ (Partner::Ground | Partner::Fixed(_)) => fixed,
        };
        Some(Self { body: body(self.body)?, partner, ..*self })
    }
}
