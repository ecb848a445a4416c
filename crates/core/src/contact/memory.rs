//! What the search for contacts remembers from step to step.

use super::meeting::Looked;
#[cfg(feature = "save")]
use super::proxy::proxies_of;
use super::proxy::{PieceOwner, Proxy};
use super::{Contact, ContactKey, Partner};
use crate::geometry::{Aabb, Hint};
use crate::mechanics::{Pose, State};
#[cfg(feature = "save")]
use crate::world::World;
use crate::world::without;
use nalgebra::{Matrix3, Vector3};
use std::ops::Range;

/// Where no body is.
pub(super) const NOWHERE: Pose = Pose {
    position: Vector3::new(f64::INFINITY, f64::INFINITY, f64::INFINITY),
    rotation: Matrix3::new(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
};

/// Two pieces that may touch.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Neighbour {
    /// Indices of the proxies, the first one of a body.
    pub(super) proxies: [usize; 2],
    pub(super) hint: Hint,
    /// The separation where it was asked for last, m; a bound from below where they do not overlap,
    /// or where nothing better was asked for.
    pub(super) gap: f64,
    /// Whether it is a bound.
    pub(super) is_bound: bool,
    /// The contacts of the last step's start, in the memory of all pairs.
    pub(super) kept: Range<usize>,
}

impl Neighbour {
    pub(super) fn owners(&self, proxies: &[Proxy]) -> [PieceOwner; 2] {
        self.proxies.map(|at| proxies[at].owner)
    }

    pub(super) fn looked(&mut self, proxies: &[Proxy]) -> Looked<'_> {
        let proxies = self.proxies.map(|at| proxies[at]);
        let Self { hint, gap, is_bound, .. } = self;
        Looked { proxies, hint, gap, is_bound }
    }
}

/// What the search of a step knows of those before it, and what its answers depend on: with the
/// world it is all that a search needs to go on where another one was.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Memory {
    /// Around the pieces of bodies, which are the first. Those around what is fixed are in the sweep.
    pub(super) boxes: Vec<Aabb>,
    /// Where the bodies ended when the boxes were made.
    pub(super) searched: Vec<Pose>,
    /// In ascending order of their proxies.
    pub(super) pairs: Vec<Neighbour>,
    /// The bodies where the gaps were asked for last.
    pub(super) end: Vec<State>,
    /// The bodies at the start of the step whose end was looked at last.
    pub(super) from: Vec<State>,
    /// Where they were at the last step's start, and what touched there: of two bodies that have
    /// not moved since nothing is computed again.
    pub(super) start: Vec<Pose>,
    pub(super) kept: Vec<Contact>,
    /// What joined within the last step. It stays as long as neither body moves: without it both
    /// would meet again.
    pub(super) joined: Vec<Contact>,
}

impl Memory {
    /// Whether nothing was searched yet.
    pub(crate) fn is_empty(&self) -> bool {
        self.end.is_empty()
    }

    /// Makes this the same as `other`, in the memory that it has.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        let Self { boxes, searched, pairs, end, from, start, kept, joined } = other;
        self.boxes.clone_from(boxes);
        self.searched.clone_from(searched);
        self.pairs.clone_from(pairs);
        self.end.clone_from(end);
        self.from.clone_from(from);
        self.start.clone_from(start);
        self.kept.clone_from(kept);
        self.joined.clone_from(joined);
    }

    /// Whether it can be one of searches in `world`: whether all that it counts and names is there.
    #[cfg(feature = "save")]
    pub(crate) fn fits(&self, world: &World) -> bool {
        let (bodies, pieces) = (world.bodies().len(), proxies_of(world).count());
        let own = world.bodies().iter().map(|body| body.pieces().len()).sum();
        let one_a_body = |count: usize| count == 0 || count == bodies;
        let is_searched =
            self.boxes.is_empty() || self.boxes.len() == own && self.searched.len() == bodies;
        let is_known = |pair: &Neighbour| {
            let [first, second] = pair.proxies;
            let Range { start, end } = pair.kept;
            first < own && second < pieces && start <= end && end <= self.kept.len()
        };
        is_searched
            && [self.end.len(), self.from.len(), self.start.len()].into_iter().all(one_a_body)
            && self.pairs.iter().all(is_known)
            && self.pairs.is_sorted_by(|a, b| a.proxies < b.proxies)
            && self.kept.iter().chain(&self.joined).all(|contact| contact.key.is_of(world))
    }

    /// Forgets what touches the body, whose pieces are these.
    pub(super) fn forget(&mut self, body: usize, pieces: &Range<usize>) {
        let piece = |piece: usize| (!pieces.contains(&piece)).then_some(piece);
        self.renumber(piece, |other| (other != body).then_some(other));
    }

    /// Has the body, whose pieces these are, looked for anew.
    pub(super) fn expect(&mut self, body: usize) {
        self.boxes.clear();
        self.end.clear();
        self.from.clear();
        if let Some(pose) = self.start.get_mut(body) {
            *pose = NOWHERE;
        }
    }

    /// Takes the body out of the world, whose pieces are these: those after it move up.
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

    /// Adds a last body to those of the world, whose pieces will be these.
    pub(super) fn add(&mut self, body: usize, pieces: &Range<usize>) {
        let moved = |piece: usize| match piece < pieces.start {
            true => Some(piece),
            false => Some(piece + pieces.len()),
        };
        self.renumber(moved, Some);
        self.start.resize(body + 1, NOWHERE);
        self.expect(body);
    }

    /// Gives pieces and bodies other numbers in the same order; forgets what is of those without one.
    fn renumber(
        &mut self,
        piece: impl Fn(usize) -> Option<usize>,
        body: impl Fn(usize) -> Option<usize> + Copy,
    ) {
        let Self { pairs, kept, joined, .. } = self;
        let renumbered =
            |contact: &Contact| Some(Contact { key: contact.key.renumbered(body)?, ..*contact });
        let before = std::mem::take(kept);
        pairs.retain_mut(|pair| {
            let (Some(first), Some(second)) = (piece(pair.proxies[0]), piece(pair.proxies[1]))
            else {
                return false;
            };
            pair.proxies = [first, second];
            let begin = kept.len();
            kept.extend(before[pair.kept.clone()].iter().filter_map(renumbered));
            pair.kept = begin..kept.len();
            true
        });
        *joined = joined.iter().filter_map(renumbered).collect();
    }
}

impl ContactKey {
    /// The same between bodies of other numbers; `None` where one has none.
    pub(crate) fn renumbered(&self, body: impl Fn(usize) -> Option<usize>) -> Option<Self> {
        let partner = match self.partner {
            Partner::Body(other) => Partner::Body(body(other)?),
            fixed @ (Partner::Ground | Partner::Fixed(_)) => fixed,
        };
        Some(Self { body: body(self.body)?, partner, ..*self })
    }
}
