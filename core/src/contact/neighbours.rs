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
use super::meeting::{BAND, Look, Meeting};
use super::memory::{Memory, NOWHERE, Neighbour};
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
    extents: Vec<Extent>,
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
        let still = |owner: Owner| match owner {
            Owner::Fixed(_) => true,
            Owner::Body(index) => before.get(index) == Some(&poses[index]),
        };
        for (index, pair) in pairs.iter_mut().enumerate() {
            let [a, b] = [pair.proxies.0, pair.proxies.1].map(|at| proxies[at]);
            if still(a.owner) && still(b.owner) {
                continue;
            }
            let first = moved.len();
            let pieces = (placed(world, poses, a), placed(world, poses, b));
            let size = size(pieces.0.0).min(size(pieces.1.0));
            let plane_of = plane_of(world, states, poses, (a, b));
            let hint = &mut pair.hint;
            pair.gap = manifold(pieces.0, pieces.1, BAND * size, plane_of, hint, scratch, touches);
            // Seen from the plane's side, to a last bit of its own.
            pair.is_bound = true;
            if pair.gap <= TOUCH * size && !shares_a_line_only(pieces, touches, size) {
                let between = Between { world, proxies: (a, b), at: poses, start: poses };
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
        joined.retain(|contact| contact.key.bodies().map(Owner::Body).all(still));
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

    /// Of the overlaps of two pieces where the bodies are at `states` that are deeper than what is `allowed`
    /// of theirs (m) the deepest.
    pub(super) fn deepest(
        &mut self,
        world: &World,
        states: &[State],
        allowed: impl Fn([(Partner, Extent); 2]) -> f64,
    ) -> Option<Overlap> {
        let known = self.memory.end == states && self.lists(world);
        if !known && !self.stand(world, states) {
            return None;
        }
        let Self { memory, proxies, extents, poses, scratch, touches, .. } = self;
        let mut deepest: Option<Overlap> = None;
        for pair in &mut memory.pairs {
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
            if depth > deepest.map_or(0.0, |known| known.depth) {
                let extents = (extents[pair.proxies.0], extents[pair.proxies.1]);
                let between = (a.owner.partner(), b.owner.partner());
                let allowed = allowed([(between.0, extents.0), (between.1, extents.1)]);
                if depth > allowed {
                    deepest = Some(Overlap { depth, allowed, between });
                }
            }
        }
        deepest
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
        if !is_of(world, &self.memory.end) {
            // Nothing was searched.
            self.proxies.clear();
            return;
        }
        set_poses(&mut self.poses, &self.memory.end);
        set_poses(&mut self.begin, &self.memory.from);
        if !self.lists(world) {
            self.list_pieces(world);
        }
    }

    /// Places the pieces at `states`. `false` where nothing can touch but the ground, or where there is not
    /// one state a body.
    fn stand(&mut self, world: &World, states: &[State]) -> bool {
        if !is_of(world, states) {
            return false;
        }
        let listed = self.lists(world);
        if listed && self.memory.end == states {
            return true;
        }
        self.set_end(states);
        self.memory.from.clear();
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
        let Self { memory: Memory { from, end, .. }, begin, poses, .. } = self;
        let begun = listed && (*from == states || *end == states);
        if *from != states {
            if *end == states {
                begin.clone_from(poses);
            } else {
                set_poses(begin, states);
            }
            from.clear();
            from.extend_from_slice(states);
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
        self.memory.end.clear();
        self.memory.end.extend_from_slice(states);
        std::mem::swap(&mut self.poses, &mut self.spare_poses);
        set_poses(&mut self.poses, states);
        // Separations were asked for where the bodies were.
        let Self { memory: Memory { pairs, .. }, proxies, poses, spare_poses: before, .. } = self;
        if poses != before {
            let stays = |at: usize| match proxies[at].owner {
                Owner::Body(index) => before.get(index) == Some(&poses[index]),
                Owner::Fixed(_) => true,
            };
            for pair in pairs.iter_mut().filter(|pair| !pair.is_bound) {
                pair.is_bound = !(stays(pair.proxies.0) && stays(pair.proxies.1));
            }
        }
    }

    /// Finds the boxes and pairs anew where a piece leaves its box. `begun` tells that the starts of the
    /// ways are known to be inside.
    fn fit_boxes(&mut self, world: &World, begun: bool) {
        let is_inside = |index: usize| {
            (begun && self.is_near(index)) || {
                let (known, around) = (&self.memory.boxes[index], self.around(world, index, begun));
                known.joined(&around) == *known
            }
        };
        let boxes = self.memory.boxes.len();
        if boxes != self.bodies.len() || !(0..boxes).all(is_inside) {
            self.search(world);
        }
    }

    /// Whether a piece has moved by less than the margin of its box since that was made: a point c by at
    /// most |r − r₀| + |A − A₀| |c|, and by the bulge of its way.
    fn is_near(&self, index: usize) -> bool {
        let body = self.bodies[index];
        let (pose, before, extent) =
            (&self.poses[body], &self.memory.searched[body], &self.extents[index]);
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
        self.memory.boxes.clear();
        self.memory.pairs.clear();
        self.memory.start.clear();
        self.list_pieces(world);
    }

    /// Makes all that follows from the world alone.
    fn list_pieces(&mut self, world: &World) {
        self.proxies.clear();
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
        let fixed: Vec<_> = fixed.map(|(piece, pose)| Aabb::of(piece, pose)).collect();
        self.sweep.set_fixed(&fixed);
    }

    /// The broad phase: boxes around where the pieces are and were, and in between, and the pairs that
    /// share some of them. Pairs that were known keep their hints.
    fn search(&mut self, world: &World) {
        self.memory.boxes.clear();
        self.memory.searched.clone_from(&self.poses);
        for index in 0..self.bodies.len() {
            let around = self.around(world, index, false);
            self.memory.boxes.push(around.grown(MARGIN * self.extents[index].size));
        }
        let Self { memory, proxies, spare_pairs: spare, sweep, .. } = self;
        let Memory { boxes, pairs, .. } = memory;
        std::mem::swap(pairs, spare);
        pairs.clear();
        sweep.pairs(boxes, |i, j| {
            let owners = (proxies[i].owner, proxies[j].owner);
            let kept_apart = match owners {
                (Owner::Body(a), Owner::Body(b)) => !world.may_touch(a, Partner::Body(b)),
                (Owner::Body(body), Owner::Fixed(fixed))
                | (Owner::Fixed(fixed), Owner::Body(body)) => {
                    !world.may_touch(body, Partner::Fixed(fixed))
                }
                (Owner::Fixed(_), Owner::Fixed(_)) => true,
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

/// Makes `poses` those of `states`.
fn set_poses(poses: &mut Vec<Pose>, states: &[State]) {
    poses.clear();
    poses.extend(states.iter().map(State::pose));
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
