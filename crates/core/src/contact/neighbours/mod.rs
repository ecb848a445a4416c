//! Contacts between pieces: of bodies with each other, and with what is fixed.
//!
//! The broad phase is a sweep over boxes that are a little larger than what moves in them; its
//! pairs are kept until something leaves its box. The narrow phase is exact
//! ([`crate::geometry::manifold`]).
//!
//! A plane of a piece stops a point wherever it meets the plane, also beside the face that it is
//! of. So the features of a step are taken from where the pieces touch: at the step's start, or on the
//! way to the end of what has been solved so far ([`super::meeting`]). What is merely near gives no contact.

mod pairs;
mod places;

use super::between::Between;
use super::key_index::{PieceIndex, ends_of};
use super::meeting::{BAND, Meeting, Sweeping};
use super::memory::{Memory, NOWHERE, Neighbour};
use super::owner::plane_of;
use super::proxy::{PieceExtent, PieceOwner, Proxy, placed, size};
use super::seam::shares_a_line_only;
use super::{Contact, Partner};
use crate::geometry::{PairScratch, PieceSide, Sweep, Touch, bound, manifold};
use crate::mechanics::{Pose, State, Way};
use crate::world::World;
use places::set_poses;
use std::ops::Range;

/// Pieces touch where they are apart by no more than this part of the smaller one's reach:
/// rounding of a state, and drifts that no motion makes.
const TOUCH: f64 = 1e-9;
/// Meetings on the way of a step that are apart by no more than this part of it are at one time.
const SAME_TIME: f64 = 1e-9;
/// What overlaps by less than this part of the world's reach is not looked at when a solver's last
/// solution is: what solvers leave.
const LOOKED_AGAIN: f64 = 1e-6;

/// Two pieces that overlap.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    /// m.
    pub depth: f64,
    /// How much of that would not count, m.
    pub allowed: f64,
    /// Whose they are: the second is what is fixed, if one is.
    pub between: (Partner, Partner),
}

/// The pieces of a world near each other, and memory of the search.
#[derive(Debug, Clone, Default)]
pub(super) struct Neighbours {
    memory: Memory,
    proxies: Vec<Proxy>,
    extents: Vec<PieceExtent>,
    /// Whose the boxes are.
    bodies: Vec<usize>,
    /// Where the bodies are at `end` and at `from`, and their ways in between.
    poses: Vec<Pose>,
    spare_poses: Vec<Pose>,
    begin: Vec<Pose>,
    ways: Vec<Way>,
    /// Memory to be exchanged with that of the start, of what touched there, and of the pairs.
    spare_start: Vec<Pose>,
    spare_kept: Vec<Contact>,
    /// The contacts of pairs that have moved, and of which pairs which of them are.
    moved: Vec<Contact>,
    moved_pairs: Vec<(usize, Range<usize>)>,
    spare_pairs: Vec<Neighbour>,
    /// Where two of them are where they meet within the step.
    between: Vec<Pose>,
    /// The pairs that meet within the step, and where each body does first.
    meetings: Vec<Meeting>,
    met: Vec<f64>,
    passed: bool,
    /// Whether no two of the pieces may touch, and the world's separations that it is of.
    is_apart: bool,
    separations: (Vec<(usize, Partner)>, Vec<usize>, Vec<bool>),
    sweep: Sweep,
    /// The contacts of the step that is looked at, by their pieces.
    index: PieceIndex,
    scratch: PairScratch,
    touches: Vec<Touch>,
}

impl Neighbours {
    /// Adds the contacts of the pieces that touch where the bodies are at `states`.
    pub(super) fn touching(
        &mut self,
        world: &World,
        states: &[State],
        contacts: &mut Vec<Contact>,
    ) {
        self.passed = false;
        if !self.stand(world, states) {
            return;
        }
        let Self { memory, proxies, poses, scratch, touches, .. } = self;
        let Memory { pairs, start, kept, joined, .. } = memory;
        if start == poses {
            // Nothing has moved.
            contacts.extend_from_slice(kept);
            contacts.extend_from_slice(joined);
            return;
        }
        std::mem::swap(start, &mut self.spare_start);
        let before = &self.spare_start;
        start.clone_from(poses);
        let (moved, moved_pairs) = (&mut self.moved, &mut self.moved_pairs);
        moved.clear();
        moved_pairs.clear();
        let still = |owner: PieceOwner| match owner {
            PieceOwner::Fixed(_) => true,
            PieceOwner::Body(index) => before.get(index) == Some(&poses[index]),
        };
        for (index, pair) in pairs.iter_mut().enumerate() {
            let [a, b] = pair.proxies.map(|at| proxies[at]);
            if still(a.owner) && still(b.owner) {
                continue;
            }
            let first = moved.len();
            let pieces = (placed(world, poses, a), placed(world, poses, b));
            let size = size(pieces.0.0).min(size(pieces.1.0));
            let plane_of = plane_of(world, states, poses, a, b);
            let hint = &mut pair.hint;
            pair.gap = manifold(pieces.0, pieces.1, BAND * size, plane_of, hint, scratch, touches);
            // Seen from the plane's side, to a last bit of its own.
            pair.is_bound = true;
            if pair.gap <= TOUCH * size && !shares_a_line_only(pieces.0, pieces.1, touches, size) {
                let between = Between { world, proxies: [a, b], at: poses, start: poses };
                moved.extend(touches.iter().filter_map(|touch| between.contact(touch, 0)));
            }
            moved_pairs.push((index, first..moved.len()));
        }
        // Pairs may have come and gone.
        let is_whole = pairs.iter().map(|pair| pair.kept.len()).sum::<usize>() == kept.len();
        if is_whole && moved_pairs.iter().all(|(pair, of)| pairs[*pair].kept.len() == of.len()) {
            for (pair, of) in &*moved_pairs {
                kept[pairs[*pair].kept.clone()].copy_from_slice(&moved[of.clone()]);
            }
        } else {
            let was = &mut self.spare_kept;
            std::mem::swap(kept, was);
            kept.clear();
            let mut moved_pairs = moved_pairs.iter().peekable();
            for (index, pair) in pairs.iter_mut().enumerate() {
                let first = kept.len();
                match moved_pairs.next_if(|(pair, _)| *pair == index) {
                    Some((_, of)) => kept.extend_from_slice(&moved[of.clone()]),
                    None => kept.extend_from_slice(&was[pair.kept.clone()]),
                }
                pair.kept = first..kept.len();
            }
        }
        contacts.extend_from_slice(kept);
        joined.retain(|contact| contact.key.bodies().map(PieceOwner::Body).all(still));
        contacts.extend_from_slice(joined);
    }

    /// Adds the contacts of the pieces that overlap by more than `depth` (m) where the bodies are at
    /// `next`, or that pass through each other on the way there, and that are not among the contacts.
    /// Returns whether there were any.
    pub(super) fn overlapping(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
        depth: f64,
        contacts: &mut Vec<Contact>,
    ) -> bool {
        let known = contacts.len();
        self.look(world, states, next, depth, contacts);
        // A step that is looked at again finds what it found before.
        if contacts.len() > known {
            let Self { memory: Memory { joined, .. }, index, .. } = self;
            joined.retain(|before| {
                let mut same = index.between(contacts, ends_of(&before.key));
                !same.any(|place| place >= known && contacts[place].key == before.key)
            });
            joined.extend_from_slice(&contacts[known..]);
        }
        contacts.len() > known
    }

    /// Whether the step `states` → `next` passes or leaves out something that its contacts do not see to: a
    /// pair goes through each other, overlaps deep, or turns too far to say.
    pub(super) fn passes(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
        contacts: &mut Vec<Contact>,
    ) -> bool {
        let Memory { end, from, .. } = &self.memory;
        if !(self.lists(world) && end == next && from == states) {
            let known = contacts.len();
            self.look(world, states, next, LOOKED_AGAIN * world.reach(), contacts);
            contacts.truncate(known);
        }
        self.passed
    }

    /// Adds the contacts that are missing, and notes whether the step passes something.
    fn look(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
        depth: f64,
        contacts: &mut Vec<Contact>,
    ) {
        self.passed = false;
        if !self.place(world, states, next) {
            return;
        }
        let Self { memory, proxies, poses, begin, between, meetings, met, .. } = self;
        let pairs = &mut memory.pairs;
        between.clone_from(begin);
        self.index.clear();
        self.index.reserve(contacts.capacity());
        let mut look = Sweeping {
            world,
            states,
            start: begin,
            end: poses,
            ways: &self.ways,
            extents: &self.extents,
            depth,
            between,
            index: &mut self.index,
            scratch: &mut self.scratch,
            touches: &mut self.touches,
            passed: false,
        };
        meetings.clear();
        met.clear();
        met.resize(states.len(), f64::INFINITY);
        for (index, pair) in pairs.iter_mut().enumerate() {
            let (before, at) = (contacts.len(), pair.proxies);
            meetings.extend(look.meeting(index, at, &mut pair.looked(proxies), contacts));
            if contacts.len() > before {
                meet(met, pair.owners(proxies), 0.0);
            }
        }
        // In the order in which they meet: what holds a body may keep it from others.
        meetings
            .sort_unstable_by(|x, y| x.share.total_cmp(&y.share).then_with(|| x.pair.cmp(&y.pair)));
        for meeting in meetings {
            let (before, pair) = (contacts.len(), &mut pairs[meeting.pair]);
            let owners = pair.owners(proxies);
            let waits = has_met(met, owners) < meeting.share - SAME_TIME;
            look.settle(meeting, &mut pair.looked(proxies), waits, contacts);
            if contacts.len() > before {
                meet(met, owners, meeting.share);
            }
        }
        self.passed = look.passed;
    }

    /// Deepest overlap of two pieces where the bodies are at `states`, of those deeper than what is `allowed` of theirs (m).
    pub(super) fn deepest(
        &mut self,
        world: &World,
        states: &[State],
        allowed: impl Fn([(Partner, PieceExtent); 2]) -> f64,
    ) -> Option<Overlap> {
        let mut deepest: Option<Overlap> = None;
        self.each_depth(world, states, |depth, sides| {
            if depth > deepest.map_or(0.0, |known| known.depth) {
                let allowed = allowed(sides);
                if depth > allowed {
                    deepest = Some(Overlap { depth, allowed, between: (sides[0].0, sides[1].0) });
                }
            }
        });
        deepest
    }

    /// All of these overlaps, the deepest first.
    pub(super) fn overlaps(
        &mut self,
        world: &World,
        states: &[State],
        least: f64,
        allowed: impl Fn([(Partner, PieceExtent); 2]) -> f64,
    ) -> Vec<Overlap> {
        let mut overlaps = Vec::new();
        self.each_depth(world, states, |depth, sides| {
            if depth > least {
                let between = (sides[0].0, sides[1].0);
                overlaps.push(Overlap { depth, allowed: allowed(sides), between });
            }
        });
        overlaps.sort_by(|a, b| b.depth.total_cmp(&a.depth));
        overlaps
    }

    /// Visits the pairs of near pieces where the bodies are at `states`: their depth (m, below 0 where they are apart), owners
    /// and extents.
    fn each_depth(
        &mut self,
        world: &World,
        states: &[State],
        mut visit: impl FnMut(f64, [(Partner, PieceExtent); 2]),
    ) {
        let known = self.memory.end == states && self.lists(world);
        if !known && !self.stand(world, states) {
            return;
        }
        let Self { memory, proxies, extents, poses, scratch, touches, .. } = self;
        for pair in &mut memory.pairs {
            let [a, b] = pair.proxies.map(|at| proxies[at]);
            let pieces = (placed(world, poses, a), placed(world, poses, b));
            if !known {
                pair.gap = bound(pieces.0, pieces.1, &pair.hint);
                pair.is_bound = true;
            }
            if pair.is_bound && pair.gap < 0.0 {
                let hint = &mut pair.hint;
                pair.gap = manifold(pieces.0, pieces.1, 0.0, PieceSide::A, hint, scratch, touches);
                pair.is_bound = false;
            }
            let extents = pair.proxies.map(|at| extents[at]);
            visit(-pair.gap, [(a.owner.partner(), extents[0]), (b.owner.partner(), extents[1])]);
        }
    }

    /// Makes `change` of the memory, where bodies are added, removed or held: it is then one of `world`.
    pub(super) fn change(&mut self, world: &World, change: impl FnOnce(&mut Memory)) {
        change(&mut self.memory);
        let bodies = world.bodies().len();
        for (poses, states) in
            [(&mut self.poses, &self.memory.end), (&mut self.begin, &self.memory.from)]
        {
            set_poses(poses, states);
            poses.resize(bodies, NOWHERE);
        }
        self.list_pieces(world);
    }

    /// What the next search goes on from.
    pub(super) fn memory(&self) -> &Memory {
        &self.memory
    }

    /// Goes on from `memory`, which must fit `world` ([`Memory::fits`]).
    pub(super) fn recall(&mut self, world: &World, memory: &Memory) {
        self.memory.copy_from(memory);
        if self.memory.start.is_empty() && self.memory.end.is_empty() {
            // Nothing was searched.
            self.proxies.clear();
            return;
        }
        // As after a change of bodies where what was searched is to be searched anew.
        self.change(world, |_| ());
    }
}

/// Whether `world` has two things whose pieces could touch. Where it has not, there is nothing to ask.
#[inline]
pub(super) fn has_pairs(world: &World) -> bool {
    world.bodies().len() + world.fixed().len() >= 2
}

/// Notes that two owners met at the part `share` of the way.
fn meet(met: &mut [f64], owners: [PieceOwner; 2], share: f64) {
    for owner in owners {
        if let PieceOwner::Body(index) = owner {
            met[index] = met[index].min(share);
        }
    }
}

/// Where one of two owners met something first; ∞ if they did not.
fn has_met(met: &[f64], owners: [PieceOwner; 2]) -> f64 {
    let of = |owner: PieceOwner| match owner {
        PieceOwner::Body(index) => met[index],
        PieceOwner::Fixed(_) => f64::INFINITY,
    };
    of(owners[0]).min(of(owners[1]))
}
