//! Contacts between pieces: of bodies with each other, and with what is fixed.
//!
//! The broad phase is a sweep over boxes that are a little larger than what moves in them; its
//! pairs are kept until something leaves its box. The narrow phase is exact
//! ([`crate::geometry::manifold`]).
//!
//! A plane of a piece stops a point wherever it meets the plane, also beside the face that it is
//! of. So the features of a step are taken from where the pieces touch or overlap: at the step's
//! start, or at the end of what has been solved so far. What is merely near gives no contact.

use super::between::Between;
use super::passing::{meeting, travel};
use super::proxy::{Owner, Proxy, placed, proxies_of, size};
use super::{Contact, ContactKey, Partner};
use crate::geometry::{Aabb, Hint, Piece, Scratch, Side, Sweep, Touch, bound, manifold};
use crate::mechanics::{Pose, State};
use crate::world::World;
use nalgebra::Vector3;
use std::ops::Range;

/// Pieces touch where they are apart by no more than this part of the smaller one's reach:
/// rounding of a state, and drifts that no motion makes.
const TOUCH: f64 = 1e-9;
/// Corners of a touching face that are higher than this part of the reach do not come down in
/// the step; those that do are found after it.
const BAND: f64 = super::detection::CONTACT_BAND;
/// What is apart by no more than this part of the smaller one's reach nearly touches: its points do
/// not slide on in a step to where another feature would be.
const NEAR: f64 = 1e-5;
/// How much larger than its contents a box of the broad phase is, in parts of the reach.
const MARGIN: f64 = 0.1;
/// A pair that moves against each other by less than this part of the smaller one's reach in a step
/// passes nothing: pieces are thicker, or hardly so.
const PASSING: f64 = 0.02;
/// A second plane for the same features is another one from this angle's cosine on.
const SAME_PLANE: f64 = 0.999_999;
/// So many planes for the same features are enough: a step that turns a body through more of them
/// has its overlap reported, and comes to an end.
const MOST_PLANES: u32 = 8;
/// Face normals are parallel to this: cosine.
const PARALLEL: f64 = 0.999_55;

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

/// The pieces of a world near each other, and memory of the search.
#[derive(Debug, Clone, Default)]
pub(super) struct Neighbours {
    proxies: Vec<Proxy>,
    boxes: Vec<Aabb>,
    pairs: Vec<Neighbour>,
    /// Where the bodies are where the gaps were asked for last.
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
    /// Where the bodies are at the start of the step whose end is looked at.
    begin: Vec<Pose>,
    /// Where the bodies are where a fast one meets another within the step.
    between: Vec<Pose>,
    sweep: Sweep,
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
        if !self.place(world, states, states) {
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
            pair.gap = manifold(pieces.0, pieces.1, BAND * size, &mut pair.hint, scratch, touches);
            pair.is_bound = false;
            if pair.gap <= TOUCH * size && !shares_a_line_only(pieces, touches, size) {
                let between = Between { world, proxies: (a, b), at: poses, start: poses };
                kept.extend(touches.iter().filter_map(|touch| between.contact(touch, 0)));
            }
            pair.kept = first..kept.len();
        }
        contacts.extend_from_slice(kept);
        self.joined.retain(|contact| match contact.key.partner {
            Partner::Body(other) => {
                still(Owner::Body(contact.key.body)) && still(Owner::Body(other))
            }
            Partner::Ground | Partner::Fixed(_) => still(Owner::Body(contact.key.body)),
        });
        contacts.extend_from_slice(&self.joined);
    }

    /// Adds the contacts of the pieces that overlap by more than `depth` (m) where the bodies are at
    /// `next`, and that are not among the contacts. Returns whether there were any.
    pub(super) fn overlapping(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
        depth: f64,
        contacts: &mut Vec<Contact>,
    ) -> bool {
        let known = contacts.len();
        if !self.place(world, states, next) {
            return false;
        }
        let Self { proxies, pairs, poses, begin, between: between_poses, scratch, touches, .. } =
            self;
        // Not those of the last search for what touches: a step may be asked for by itself.
        begin.clear();
        begin.extend(states.iter().map(State::pose));
        let start: &[Pose] = begin;
        for pair in pairs {
            let [a, b] = [pair.proxies.0, pair.proxies.1].map(|at| proxies[at]);
            let pieces = (placed(world, poses, a), placed(world, poses, b));
            let sizes = (size(pieces.0.0), size(pieces.1.0));
            let reach = BAND * sizes.0.min(sizes.1);
            pair.gap = bound(pieces.0, pieces.1, &pair.hint);
            pair.is_bound = pair.gap >= -depth;
            if !pair.is_bound {
                pair.gap = manifold(pieces.0, pieces.1, reach, &mut pair.hint, scratch, touches);
            }
            let mut at = poses.as_slice();
            if pair.gap >= -depth {
                // Apart at the end; a thin or fast one may have been on the other side before.
                let travel = travel((a.owner, b.owner), (start, poses));
                if travel <= PASSING * sizes.0.min(sizes.1) {
                    continue;
                }
                between_poses.clone_from(poses);
                let (ends, memory) = ((states, next), (&mut pair.hint, &mut *scratch));
                if !meeting(world, (a, b), ends, travel, between_poses, memory) {
                    continue;
                }
                let pieces = (placed(world, between_poses, a), placed(world, between_poses, b));
                manifold(pieces.0, pieces.1, reach, &mut pair.hint, scratch, touches);
                at = between_poses.as_slice();
            }
            // What nearly touches at the start meets there, and not where it would have gone.
            let (before, mut is_of_end) = (contacts.len(), true);
            let was = (placed(world, start, a), placed(world, start, b));
            let near = NEAR * sizes.0.min(sizes.1);
            if bound(was.0, was.1, &pair.hint) <= near {
                is_of_end = false;
                if manifold(was.0, was.1, reach, &mut pair.hint, scratch, touches) <= near {
                    admit(&Between { world, proxies: (a, b), at: start, start }, touches, contacts);
                }
            }
            if contacts.len() == before {
                if !is_of_end {
                    let pieces = (placed(world, at, a), placed(world, at, b));
                    manifold(pieces.0, pieces.1, reach, &mut pair.hint, scratch, touches);
                }
                admit(&Between { world, proxies: (a, b), at, start }, touches, contacts);
            }
        }
        // A step that is looked at again finds what it found before.
        let found = &contacts[known..];
        self.joined.retain(|before| found.iter().all(|contact| contact.key != before.key));
        self.joined.extend_from_slice(found);
        contacts.len() > known
    }

    /// The deepest overlap of any two pieces where the bodies are at `states`, m, with the owners of
    /// both.
    pub(super) fn deepest(
        &mut self,
        world: &World,
        states: &[State],
    ) -> Option<(f64, Partner, Partner)> {
        let same = |(pose, state): (&Pose, &State)| *pose == state.pose();
        let known = self.poses.len() == states.len()
            && self.poses.iter().zip(states).all(same)
            && self.lists(world);
        if !known && !self.place(world, states, states) {
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
                pair.gap = manifold(pieces.0, pieces.1, 0.0, &mut pair.hint, scratch, touches);
                pair.is_bound = false;
            }
            let depth = -pair.gap;
            if depth > 0.0 && deepest.is_none_or(|(known, ..)| depth > known) {
                deepest = Some((depth, a.owner.partner(), b.owner.partner()));
            }
        }
        deepest
    }

    /// Places the pieces at `next`, and finds the pairs anew where a piece left its box. `false`
    /// where nothing can touch but the ground, or where there is not one state a body.
    fn place(&mut self, world: &World, states: &[State], next: &[State]) -> bool {
        let bodies = world.bodies().len();
        if bodies + world.fixed().len() < 2 || states.len() != bodies || next.len() != bodies {
            return false;
        }
        if world.bodies().iter().all(|body| body.pieces().is_empty()) {
            return false;
        }
        self.poses.clear();
        self.poses.extend(next.iter().map(State::pose));
        if !self.lists(world) {
            self.list(world);
        }
        let outside = self.proxies.iter().zip(&self.boxes).any(|(proxy, bounds)| {
            let (piece, pose) = placed(world, &self.poses, *proxy);
            let tight = Aabb::of(piece, pose);
            bounds.joined(&tight) != *bounds
        });
        if outside || self.boxes.is_empty() {
            self.search(world, states);
        }
        true
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
    }

    /// The broad phase: boxes around where the pieces are and were, and the pairs that share
    /// some of them. Pairs that were known keep their hints.
    fn search(&mut self, world: &World, states: &[State]) {
        self.boxes.clear();
        for proxy in &self.proxies {
            let (piece, pose) = placed(world, &self.poses, *proxy);
            let mut bounds = Aabb::of(piece, pose);
            if let Owner::Body(index) = proxy.owner {
                bounds = bounds.joined(&Aabb::of(piece, &states[index].pose()));
                bounds = bounds.grown(MARGIN * size(piece));
            }
            self.boxes.push(bounds);
        }
        let Self { proxies, boxes, pairs, spare_pairs: spare, sweep, .. } = self;
        std::mem::swap(pairs, spare);
        pairs.clear();
        sweep.pairs(boxes, |i, j| {
            let owners = (proxies[i].owner, proxies[j].owner);
            let movable = |owner| matches!(owner, Owner::Body(_));
            if owners.0 != owners.1 && (movable(owners.0) || movable(owners.1)) {
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

/// Adds the contacts of `touches` whose features have no plane yet.
fn admit(between: &Between<'_>, touches: &[Touch], contacts: &mut Vec<Contact>) {
    for touch in touches {
        let Some(contact) = between.contact(touch, 0) else { continue };
        if let Some(plane) = unknown_plane(&contact, contacts) {
            contacts.extend(between.contact(touch, plane));
        }
    }
}

/// The number of the plane for the features of `contact`, if `contacts` have none for them that is
/// as good as the same, and not too many others.
fn unknown_plane(contact: &Contact, contacts: &[Contact]) -> Option<u32> {
    let mut planes = 0;
    for known in contacts {
        let same = ContactKey { pair: contact.key.pair, ..known.key } == contact.key
            && known.key.pair.map(|pair| (pair.pieces, pair.feature))
                == contact.key.pair.map(|pair| (pair.pieces, pair.feature));
        if same {
            if known.normal().dot(&contact.normal()) >= SAME_PLANE {
                return None;
            }
            planes += 1;
        }
    }
    (planes < MOST_PLANES).then_some(planes)
}

/// Whether two faces lie in one plane but overlap in a line or a point only, to rounding: boxes on a
/// floor of tiles, where one reaches the next. Neither holds the other there.
fn shares_a_line_only(
    (a, b): ((&Piece, &Pose), (&Piece, &Pose)),
    touches: &[Touch],
    size: f64,
) -> bool {
    let Some(first) = touches.first() else { return true };
    let (owner, other) = match first.point_of {
        Side::A => (b, a),
        Side::B => (a, b),
    };
    // In the world.
    let normal = owner.1.rotation * first.normal;
    let faces = |(piece, pose): (&Piece, &Pose), normal: Vector3<f64>| {
        let normal = pose.rotation.tr_mul(&normal);
        piece.core().faces().iter().any(|face| face.normal.dot(&normal) >= PARALLEL)
    };
    if !faces(owner, normal) || !faces(other, -normal) {
        return false;
    }
    let points = || {
        touches.iter().map(|touch| {
            let (_, pose) = if touch.point_of == Side::A { a } else { b };
            pose.position + pose.rotation * touch.point
        })
    };
    let Some(from) = points().next() else { return true };
    let farthest = points()
        .map(|point| point - from)
        .max_by(|x, y| x.norm_squared().total_cmp(&y.norm_squared()));
    let Some(along) = farthest.and_then(|along| along.try_normalize(0.0)) else { return true };
    let width = points().map(|point| (point - from).cross(&along).norm()).fold(0.0, f64::max);
    width <= 1e-7 * size
}
