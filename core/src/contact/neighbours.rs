//! Contacts between pieces: of bodies with each other, and with what is fixed.
//!
//! The broad phase is a sweep over boxes that are a little larger than what moves in them; its
//! pairs are kept until something leaves its box. The narrow phase is exact
//! ([`crate::geometry::manifold`]).
//!
//! A plane of a piece stops a point wherever it meets the plane, also beside the face that it is
//! of. So the features of a step are taken from where the pieces touch: at the step's start, or on the
//! way to the end of what has been solved so far ([`super::meeting`]). What is merely near gives no contact.

use super::between::Between;
use super::key_index::{PieceIndex, ends_of};
use super::meeting::{BAND, Look, Looked, Meeting};
use super::owner::plane_of;
use super::proxy::{Extent, Owner, Proxy, placed, proxies_of, size};
use super::seam::shares_a_line_only;
use super::{Contact, Partner};
use crate::geometry::{Aabb, Hint, Scratch, Side, Sweep, Touch, bound, bulge, manifold};
use crate::mechanics::{Pose, State, Way};
use crate::world::World;
use std::ops::Range;

/// Pieces touch where they are apart by no more than this part of the smaller one's reach:
/// rounding of a state, and drifts that no motion makes.
const TOUCH: f64 = 1e-9;
/// How much larger than its contents a box of the broad phase is, in parts of the reach.
const MARGIN: f64 = 0.1;
/// Meetings on the way of a step that are apart by no more than this part of it are at one time.
const SAME_TIME: f64 = 1e-9;
/// What overlaps by less than this part of the world's reach is not looked at when a solver's last
/// solution is: what solvers leave.
const LOOKED_AGAIN: f64 = 1e-6;

/// Two pieces that may touch.
#[derive(Debug, Clone)]
struct Neighbour {
    /// Indices of the proxies, the first one of a body.
    proxies: (usize, usize),
    hint: Hint,
    /// The separation where it was asked for last, m; a bound from below where they do not overlap,
    /// or where nothing better was asked for.
    gap: f64,
    /// Whether it is a bound.
    is_bound: bool,
    /// The contacts of the last step's start, in the memory of all pairs.
    kept: Range<usize>,
}

impl Neighbour {
    fn owners(&self, proxies: &[Proxy]) -> [Owner; 2] {
        [self.proxies.0, self.proxies.1].map(|at| proxies[at].owner)
    }

    fn looked(&mut self, proxies: &[Proxy]) -> Looked<'_> {
        let proxies = (proxies[self.proxies.0], proxies[self.proxies.1]);
        let Self { hint, gap, is_bound, .. } = self;
        Looked { proxies, hint, gap, is_bound }
    }
}

/// The pieces of a world near each other, and memory of the search.
#[derive(Debug, Clone, Default)]
pub(super) struct Neighbours {
    proxies: Vec<Proxy>,
    extents: Vec<Extent>,
    /// Around the pieces of bodies, which are the first. Those around what is fixed are in the sweep.
    boxes: Vec<Aabb>,
    /// Whose these are.
    bodies: Vec<usize>,
    pairs: Vec<Neighbour>,
    /// The bodies where the gaps were asked for last, and where they are there.
    end: Vec<State>,
    poses: Vec<Pose>,
    /// Where they were at the last step's start, and what touched there: of two bodies that have
    /// not moved since nothing is computed again.
    start: Vec<Pose>,
    kept: Vec<Contact>,
    /// What joined within the last step. It stays as long as neither body moves: without it both
    /// would meet again.
    joined: Vec<Contact>,
    /// The memory of both, and of the pairs, to be exchanged with.
    spare_start: Vec<Pose>,
    spare_kept: Vec<Contact>,
    spare_pairs: Vec<Neighbour>,
    /// The bodies at the start of the step whose end was looked at last, where they are there, and their
    /// ways from there.
    from: Vec<State>,
    begin: Vec<Pose>,
    ways: Vec<Way>,
    /// Where the bodies ended when the boxes were made.
    searched: Vec<Pose>,
    /// Where two of them are where they meet within the step.
    between: Vec<Pose>,
    /// The pairs that meet within the step, and where each body does first.
    meetings: Vec<Meeting>,
    met: Vec<f64>,
    passed: bool,
    sweep: Sweep,
    /// The contacts of the step that is looked at, by their pieces.
    index: PieceIndex,
    scratch: Scratch,
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
        if self.start == self.poses {
            // Nothing has moved.
            contacts.extend_from_slice(&self.kept);
            contacts.extend_from_slice(&self.joined);
            return;
        }
        let Self { proxies, pairs, poses, scratch, touches, .. } = self;
        std::mem::swap(&mut self.start, &mut self.spare_start);
        std::mem::swap(&mut self.kept, &mut self.spare_kept);
        let (start, before, kept, was) =
            (&mut self.start, &self.spare_start, &mut self.kept, &self.spare_kept);
        start.clone_from(poses);
        kept.clear();
        let still = |owner: Owner| match owner {
            Owner::Fixed(_) => true,
            Owner::Body(index) => before.get(index) == Some(&poses[index]),
        };
        for pair in pairs {
            let [a, b] = [pair.proxies.0, pair.proxies.1].map(|at| proxies[at]);
            let first = kept.len();
            if still(a.owner) && still(b.owner) {
                kept.extend_from_slice(&was[pair.kept.clone()]);
                pair.kept = first..kept.len();
                continue;
            }
            let pieces = (placed(world, poses, a), placed(world, poses, b));
            let size = size(pieces.0.0).min(size(pieces.1.0));
            let plane_of = plane_of(world, states, poses, (a, b));
            let hint = &mut pair.hint;
            pair.gap = manifold(pieces.0, pieces.1, BAND * size, plane_of, hint, scratch, touches);
            pair.is_bound = false;
            if pair.gap <= TOUCH * size && !shares_a_line_only(pieces, touches, size) {
                let between = Between { world, proxies: (a, b), at: poses, start: poses };
                kept.extend(touches.iter().filter_map(|touch| between.contact(touch, 0)));
            }
            pair.kept = first..kept.len();
        }
        contacts.extend_from_slice(kept);
        self.joined.retain(|contact| contact.key.bodies().map(Owner::Body).all(still));
        contacts.extend_from_slice(&self.joined);
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
            let Self { joined, index, .. } = self;
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
        if !(self.lists(world) && self.end == next && self.from == states) {
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
        let Self { proxies, pairs, poses, begin, between, meetings, met, .. } = self;
        between.clone_from(begin);
        self.index.clear();
        self.index.reserve(contacts.capacity());
        let mut look = Look {
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

    /// The deepest overlap of any two pieces where the bodies are at `states`, m, with the owners of
    /// both.
    pub(super) fn deepest(
        &mut self,
        world: &World,
        states: &[State],
    ) -> Option<(f64, Partner, Partner)> {
        let known = self.end == states && self.lists(world);
        if !known && !self.stand(world, states) {
            return None;
        }
        let Self { proxies, pairs, poses, scratch, touches, .. } = self;
        let mut deepest: Option<(f64, Partner, Partner)> = None;
        for pair in pairs {
            let [a, b] = [pair.proxies.0, pair.proxies.1].map(|at| proxies[at]);
            let pieces = (placed(world, poses, a), placed(world, poses, b));
            if !known {
                pair.gap = bound(pieces.0, pieces.1, &pair.hint);
                pair.is_bound = true;
            }
            if pair.is_bound && pair.gap < 0.0 {
                let hint = &mut pair.hint;
                pair.gap = manifold(pieces.0, pieces.1, 0.0, Side::A, hint, scratch, touches);
                pair.is_bound = false;
            }
            let depth = -pair.gap;
            if depth > 0.0 && deepest.is_none_or(|(known, ..)| depth > known) {
                deepest = Some((depth, a.owner.partner(), b.owner.partner()));
            }
        }
        deepest
    }

    /// Places the pieces at `states`. `false` where nothing can touch but the ground, or where there is not
    /// one state a body.
    fn stand(&mut self, world: &World, states: &[State]) -> bool {
        if !is_of(world, states) {
            return false;
        }
        let listed = self.lists(world);
        if listed && self.end == states {
            return true;
        }
        self.set_end(states);
        self.from.clear();
        if !listed {
            self.list(world);
        }
        self.begin.clone_from(&self.poses);
        self.ways.clear();
        self.ways.resize(states.len(), Way::STILL);
        self.fit_boxes(world, true);
        true
    }

    /// Places the pieces at `next`, on their ways from `states`. `false` as above.
    fn place(&mut self, world: &World, states: &[State], next: &[State]) -> bool {
        if !is_of(world, states) || next.len() != states.len() {
            return false;
        }
        let listed = self.lists(world);
        // What was looked at last is in its boxes.
        let begun = listed && (self.from == states || self.end == states);
        if self.from != states {
            if self.end == states {
                self.begin.clone_from(&self.poses);
            } else {
                self.begin.clear();
                self.begin.extend(states.iter().map(State::pose));
            }
            self.from.clear();
            self.from.extend_from_slice(states);
        }
        self.set_end(next);
        self.ways.clear();
        self.ways.extend(states.iter().zip(next).map(|(from, to)| Way::between(from, to)));
        if !listed {
            self.list(world);
        }
        self.fit_boxes(world, begun);
        true
    }

    fn set_end(&mut self, states: &[State]) {
        self.end.clear();
        self.end.extend_from_slice(states);
        self.poses.clear();
        self.poses.extend(states.iter().map(State::pose));
    }

    /// Finds the boxes and pairs anew where a piece leaves its box. `begun` tells that the starts of the
    /// ways are known to be inside.
    fn fit_boxes(&mut self, world: &World, begun: bool) {
        let is_inside = |index: usize| {
            (begun && self.is_near(index)) || {
                let around = self.around(world, index, begun);
                self.boxes[index].joined(&around) == self.boxes[index]
            }
        };
        if self.boxes.len() != self.bodies.len() || !(0..self.boxes.len()).all(is_inside) {
            self.search(world);
        }
    }

    /// Whether a piece has moved by less than the margin of its box since that was made: a point c by at
    /// most |r − r₀| + |A − A₀| |c|, and by the bulge of its way.
    fn is_near(&self, index: usize) -> bool {
        let body = self.bodies[index];
        let (pose, before, extent) =
            (&self.poses[body], &self.searched[body], &self.extents[index]);
        let moved = (pose.position - before.position).norm()
            + extent.arm * (pose.rotation - before.rotation).norm();
        moved + bulge(extent.arm, self.ways[body].angle()) <= MARGIN * extent.size
    }

    /// The box around the way of a piece of a body, or around its end alone if its start is known to be in a box
    /// that the end is held against.
    fn around(&self, world: &World, index: usize, begun: bool) -> Aabb {
        let proxy = self.proxies[index];
        let (piece, to) = placed(world, &self.poses, proxy);
        let body = self.bodies[index];
        let from = &self.begin[body];
        let around = if begun { Aabb::of(piece, to) } else { Aabb::swept(piece, from, to) };
        around.grown(bulge(self.extents[index].arm, self.ways[body].angle()))
    }

    /// Whether the pieces that are listed are those of the world.
    fn lists(&self, world: &World) -> bool {
        proxies_of(world).eq(self.proxies.iter().copied())
    }

    /// Lists the pieces of the world.
    fn list(&mut self, world: &World) {
        self.proxies.clear();
        self.boxes.clear();
        self.pairs.clear();
        self.start.clear();
        self.proxies.extend(proxies_of(world));
        // Where the bodies are plays no part.
        let poses = &self.poses;
        let extents = self.proxies.iter().map(|proxy| Extent::of(placed(world, poses, *proxy).0));
        self.extents.clear();
        self.extents.extend(extents);
        self.bodies.clear();
        self.bodies.extend(self.proxies.iter().map_while(|proxy| match proxy.owner {
            Owner::Body(index) => Some(index),
            Owner::Fixed(_) => None,
        }));
        let fixed =
            self.proxies[self.bodies.len()..].iter().map(|proxy| placed(world, poses, *proxy));
        self.boxes.extend(fixed.map(|(piece, pose)| Aabb::of(piece, pose)));
        self.sweep.set_fixed(&self.boxes);
        self.boxes.clear();
    }

    /// The broad phase: boxes around where the pieces are and were, and in between, and the pairs that
    /// share some of them. Pairs that were known keep their hints.
    fn search(&mut self, world: &World) {
        self.boxes.clear();
        self.searched.clone_from(&self.poses);
        for index in 0..self.bodies.len() {
            let around = self.around(world, index, false);
            self.boxes.push(around.grown(MARGIN * self.extents[index].size));
        }
        let Self { proxies, boxes, pairs, spare_pairs: spare, sweep, .. } = self;
        std::mem::swap(pairs, spare);
        pairs.clear();
        sweep.pairs(boxes, |i, j| {
            let owners = (proxies[i].owner, proxies[j].owner);
            let kept_apart = match owners {
                (Owner::Body(a), Owner::Body(b)) => !world.may_touch(a, b),
                _ => false,
            };
            if owners.0 != owners.1 && !kept_apart {
                let known = spare.binary_search_by(|pair| pair.proxies.cmp(&(i, j)));
                pairs.push(known.map_or_else(
                    |_| Neighbour {
                        proxies: (i, j),
                        hint: Hint::default(),
                        gap: f64::INFINITY,
                        is_bound: true,
                        kept: 0..0,
                    },
                    |place| spare[place].clone(),
                ));
            }
        });
    }
}

/// Whether `world` has two things whose pieces could touch. Where it has not, there is nothing to ask.
#[inline]
pub(super) fn has_pairs(world: &World) -> bool {
    world.bodies().len() + world.fixed().len() >= 2
}

/// Whether pieces of `world` can touch anything but the ground, and `states` has one state a body.
fn is_of(world: &World, states: &[State]) -> bool {
    let bodies = world.bodies();
    has_pairs(world)
        && states.len() == bodies.len()
        && bodies.iter().any(|body| !body.pieces().is_empty())
}

/// Notes that two owners met at the part `share` of the way.
fn meet(met: &mut [f64], owners: [Owner; 2], share: f64) {
    for owner in owners {
        if let Owner::Body(index) = owner {
            met[index] = met[index].min(share);
        }
    }
}

/// Where one of two owners met something first; ∞ if they did not.
fn has_met(met: &[f64], owners: [Owner; 2]) -> f64 {
    let of = |owner: Owner| match owner {
        Owner::Body(index) => met[index],
        Owner::Fixed(_) => f64::INFINITY,
    };
    of(owners[0]).min(of(owners[1]))
}
