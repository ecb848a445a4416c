//! Contacts between pieces: of bodies with each other and with fixed pieces.
//!
//! The broad phase is a sweep over slightly enlarged boxes. Its pairs are kept until a piece leaves
//! its box. The narrow phase is exact ([`crate::geometry::manifold`]).
//!
//! The plane of a face stops a point wherever it meets the plane, even beside the face. So a step
//! uses only the features of pieces that touch, at the start of the step or on the trajectory to the
//! end of the current solution ([`super::collision`]). Pieces that are only near have no contact.

mod pairs;
mod places;
pub(super) mod replaced;
mod sinking;

use super::collider::{Colliders, PieceExtent, PieceOwner, placed, size};
use super::collision::{BAND, Collision, CollisionSearch, Reached, Sunk};
use super::contact_builder::ContactBuilder;
use super::exposure::{ContactSearch, Exposure};
use super::key_index::{PieceIndex, ends_of};
use super::memory::{Memory, NOWHERE, Neighbour};
use super::owner::plane_of;
use super::partners::Partners;
use super::placement::{KnownErrors, PlacementCheck, PlacementScratch};
use super::shared_edge::{meet_at_a_corner, shares_a_line_only};
use super::terrain_seams::{is_triangle, same_contact};
use super::{Contact, Partner};
use crate::geometry::{
    ManifoldPoint, PairScratch, PieceSide, Sweep, distance_lower_bound, manifold,
};
use crate::mechanics::{Pose, State, Trajectory};
use crate::world::{KnownSeparations, World};
use pairs::MOST_PAIRS;
use places::set_poses;
use replaced::Replaced;
use std::ops::Range;

/// Distance up to which pieces touch, as a fraction of the smaller reach. It covers the rounding of
/// states and numerical drift.
const TOUCH: f64 = 1e-9;
/// Difference below which two collisions are simultaneous, as a fraction of the trajectory.
const SAME_TIME: f64 = 1e-9;
/// Overlap that is ignored when the final solution of a solver is checked, as a fraction of the
/// world's reach. Solvers leave overlaps of this size.
const LOOKED_AGAIN: f64 = 1e-6;

/// Number of pairs of a crowded search whose overlap is computed.
const MOST_OF_CROWD: usize = 1000;

/// Overlap of two pieces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overlap {
    /// Depth (m).
    pub depth: f64,
    /// Allowed depth (m).
    pub allowed: f64,
    /// Owners of the pieces. A fixed owner is the second.
    pub between: (Partner, Partner),
}

/// Pairs of near pieces in a world, and the state of the search.
#[derive(Debug, Clone, Default)]
pub(super) struct Neighbours {
    memory: Box<Memory>,
    /// True if the following fields were computed from the memory.
    is_known: bool,
    colliders: Colliders,
    extents: Vec<PieceExtent>,
    /// Body of each box.
    bodies: Vec<usize>,
    /// Poses of the bodies at `end`.
    poses: Vec<Pose>,
    spare_poses: Vec<Pose>,
    /// Poses of the bodies at `from`.
    begin: Vec<Pose>,
    /// Trajectories of the bodies between these poses.
    trajectories: Vec<Trajectory>,
    /// Spare buffers, swapped with the poses of the start, their contacts and the pairs.
    spare_start: Vec<Pose>,
    spare_contacts: Vec<Contact>,
    /// New contacts of pairs that have moved.
    moved: Vec<Contact>,
    /// Index of each moved pair, and its range in `moved`.
    moved_pairs: Vec<(usize, Range<usize>)>,
    spare_pairs: Vec<Neighbour>,
    /// Triangles of a terrain near a piece.
    triangles: Vec<usize>,
    /// Poses of two bodies at their collision within the step.
    between: Vec<Pose>,
    /// Pairs that collide within the step.
    collisions: Vec<Collision>,
    /// First collision of each body, as a fraction of the trajectory.
    met: Vec<f64>,
    /// Overlap of each body with its known contacts in a prediction.
    sunk: Vec<Sunk>,
    /// First pair whose collision the step passes or misses.
    missed: Option<[Partner; 2]>,
    pub(super) replaced: Replaced,
    /// True if no two pieces may touch.
    is_apart: bool,
    /// Separations of the world that `is_apart` was computed for.
    separations: KnownSeparations,
    sweep: Sweep,
    /// Contacts of the step, by their pieces.
    index: PieceIndex,
    /// The pairs, by collider.
    partners: Partners,
    placement: PlacementScratch,
    known_errors: KnownErrors,
    scratch: PairScratch,
    touches: Vec<ManifoldPoint>,
}

impl Neighbours {
    /// Adds the contacts of the pieces that touch with the bodies at `states`.
    pub(super) fn touching(
        &mut self,
        world: &World,
        states: &[State],
        contacts: &mut Vec<Contact>,
    ) {
        self.missed = None;
        if !self.stand(world, states) {
            return;
        }
        self.partners.update(world, &self.colliders, &self.memory.pairs);
        if self.memory.start != self.poses {
            std::mem::swap(&mut self.memory.start, &mut self.spare_start);
            self.memory.start.clone_from(&self.poses);
            self.find_moved(world, states);
            self.replace_moved();
            // Contacts that the last step added stay while their bodies do.
            let Self { memory, spare_start: before, poses, .. } = self;
            let stays = |body| is_still(PieceOwner::Body(body), before, poses);
            memory.added.retain(|contact| contact.key.bodies().all(stays));
        }
        contacts.extend_from_slice(&self.memory.pair_contacts);
        contacts.extend_from_slice(&self.memory.added);
    }

    /// Finds the contacts of all pairs that have moved, or whose surroundings have.
    fn find_moved(&mut self, world: &World, states: &[State]) {
        let Self {
            memory,
            colliders,
            extents,
            poses,
            spare_start: before,
            partners,
            placement,
            scratch,
            touches,
            moved,
            moved_pairs,
            ..
        } = self;
        let exposure = &mut placement.exposure;
        moved.clear();
        moved_pairs.clear();
        let still = |owner: PieceOwner| is_still(owner, before, poses);
        // First contact of the current piece with its terrains, and how far the piece has moved.
        let mut piece = usize::MAX;
        let mut first_of_piece = 0;
        let mut moved_by = 0.0;
        for (index, pair) in memory.pairs.iter_mut().enumerate() {
            let [a, b] = pair.colliders.map(|number| colliders.at(number));
            if still(a.owner) && still(b.owner) && partners.are_all(pair.colliders, still) {
                continue;
            }
            let first = moved.len();
            // A terrain has many triangles near a piece. A bound on the clearance excludes most of them.
            let is_triangle = is_triangle(world, b);
            if is_triangle {
                if piece != pair.colliders[0] {
                    (piece, first_of_piece) = (pair.colliders[0], first);
                    moved_by = displacement(a.owner, extents[piece].arm, before, poses);
                }
                pair.clearance.0 -= moved_by;
                if pair.clearance.0 > TOUCH * extents[piece].size {
                    (pair.gap, pair.is_bound) = (pair.clearance.0, true);
                    if !pair.contacts.is_empty() {
                        moved_pairs.push((index, first..first));
                    }
                    continue;
                }
            }
            let pieces = (placed(world, poses, a), placed(world, poses, b));
            let size = size(pieces.0.0).min(size(pieces.1.0));
            let plane_of = plane_of(world, states, poses, a, b);
            let hint = &mut pair.hint;
            partners.list_around(world, pair.colliders);
            if pair.gap <= TOUCH * size {
                // It touched before. Most other pieces near a body are never touched.
                partners.list_hidden(world, pair.colliders);
            }
            let exposed = Exposure { world, partners, colliders: [a, b], numbers: pair.colliders };
            let reach = BAND * size;
            let within = TOUCH * size;
            let search = ContactSearch { reach, within, plane_of, with_hidden: false };
            let workspace = (&mut *scratch, &mut *exposure);
            pair.gap = exposed.contact_points(poses, &[poses], search, hint, workspace, touches).0;
            // The gap was computed from the plane's side. Other calls may differ in the last bit.
            pair.is_bound = true;
            let between =
                ContactBuilder { world, colliders: [a, b], at: poses, start: poses, states };
            if is_triangle {
                pair.clearance.0 = pair.gap;
                let touches = touches.iter().filter(|_| pair.gap <= TOUCH * size);
                for contact in touches.filter_map(|touch| between.contact(touch, 0)) {
                    let known = &moved[first_of_piece..];
                    if !known.iter().any(|known| same_contact(world, known, &contact)) {
                        moved.push(contact);
                    }
                }
            } else if pair.gap <= TOUCH * size
                && !shares_a_line_only(pieces.0, pieces.1, touches, size)
                && !meet_at_a_corner(pieces.0, pieces.1, touches, within)
            {
                moved.extend(touches.iter().filter_map(|touch| between.contact(touch, 0)));
            }
            moved_pairs.push((index, first..moved.len()));
        }
    }

    /// Puts the contacts of moved pairs in the place of their last ones, in the order of the pairs.
    fn replace_moved(&mut self) {
        let Self { memory, moved, moved_pairs, spare_contacts: last, .. } = self;
        let Memory { pairs, pair_contacts, .. } = &mut **memory;
        // Pairs may have been added or removed.
        let is_whole =
            pairs.iter().map(|pair| pair.contacts.len()).sum::<usize>() == pair_contacts.len();
        let has_same_count =
            |(pair, new): &(usize, Range<usize>)| pairs[*pair].contacts.len() == new.len();
        if is_whole && moved_pairs.iter().all(has_same_count) {
            for (pair, new) in &*moved_pairs {
                pair_contacts[pairs[*pair].contacts.clone()].copy_from_slice(&moved[new.clone()]);
            }
            return;
        }
        std::mem::swap(pair_contacts, last);
        pair_contacts.clear();
        let mut moved_pairs = moved_pairs.iter().peekable();
        for (index, pair) in pairs.iter_mut().enumerate() {
            let first = pair_contacts.len();
            pair_contacts.extend_from_slice(
                match moved_pairs.next_if(|(pair, _)| *pair == index) {
                    Some((_, new)) => &moved[new.clone()],
                    None => &last[pair.contacts.clone()],
                },
            );
            pair.contacts = first..pair_contacts.len();
        }
    }

    /// Adds the missing contacts of pieces that overlap by more than `depth` (m) with the bodies at
    /// `next`, or that pass through each other on the trajectory there. `reached` describes `next`. Returns
    /// true if there were any.
    pub(super) fn overlapping(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
        depth: f64,
        reached: Reached,
        contacts: &mut Vec<Contact>,
    ) -> bool {
        let known = contacts.len();
        self.look(world, states, next, depth, reached, contacts);
        // A repeated search of the same step finds the same contacts again.
        if contacts.len() > known {
            let Self { memory, index, .. } = self;
            memory.added.retain(|before| {
                let mut same = index.between(contacts, ends_of(&before.key));
                !same.any(|place| place >= known && contacts[place].key == before.key)
            });
            memory.added.extend_from_slice(&contacts[known..]);
        }
        contacts.len() > known
    }

    /// True if the step `states` → `next` misses a collision in spite of its contacts. A pair
    /// passes through each other, overlaps deeply, or rotates too far to decide.
    pub(super) fn missed_pair(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
        contacts: &mut Vec<Contact>,
    ) -> Option<[Partner; 2]> {
        let Memory { end, from, .. } = &*self.memory;
        if !(self.lists(world) && end == next && from == states) {
            let known = contacts.len();
            let depth = LOOKED_AGAIN * world.reach();
            self.look(world, states, next, depth, Reached::Foreseen, contacts);
            contacts.truncate(known);
        }
        self.missed
    }

    /// Adds the missing contacts, and records whether the step misses a collision.
    fn look(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
        depth: f64,
        reached: Reached,
        contacts: &mut Vec<Contact>,
    ) {
        self.missed = None;
        if !self.place(world, states, next) {
            return;
        }
        let known = contacts.len();
        let Self { memory, colliders, poses, begin, between, collisions, met, sunk, .. } = self;
        let pairs = &mut memory.pairs;
        self.partners.update(world, colliders, pairs);
        between.clone_from(begin);
        met.clear();
        met.resize(states.len(), f64::INFINITY);
        sunk.clear();
        if reached == Reached::Foreseen {
            sunk.resize(states.len(), Sunk::default());
            sink(contacts, poses, met, sunk);
        }
        self.index.clear();
        self.index.reserve(contacts.capacity());
        let mut look = CollisionSearch {
            world,
            states,
            start: begin,
            end: poses,
            trajectories: &self.trajectories,
            extents: &self.extents,
            depth,
            between,
            is_solved: reached != Reached::Free,
            sunk,
            index: &mut self.index,
            partners: &mut self.partners,
            exposure: &mut self.placement.exposure,
            scratch: &mut self.scratch,
            touches: &mut self.touches,
            excluded: &self.replaced.excluded,
            is_hidden: false,
            with_hidden: false,
            missed: None,
        };
        // Pairs that touch now get their contacts at once. The others are collected with their times.
        collisions.clear();
        let is_from_start = colliders.has_terrains() && *look.start == memory.start[..];
        for (index, pair) in pairs.iter_mut().enumerate() {
            if is_from_start && look.is_out_of_reach(pair, colliders) {
                continue;
            }
            let (before, at) = (contacts.len(), pair.colliders);
            collisions.extend(look.find_collision(
                index,
                at,
                &mut pair.looked(colliders),
                contacts,
            ));
            if contacts.len() > before {
                meet(met, pair.owners(colliders), 0.0);
            }
        }
        // In the order of the collisions: the force on a body may prevent later ones.
        collisions
            .sort_unstable_by(|x, y| x.share.total_cmp(&y.share).then_with(|| x.pair.cmp(&y.pair)));
        for collision in &*collisions {
            let (before, pair) = (contacts.len(), &mut pairs[collision.pair]);
            let owners = pair.owners(colliders);
            let waits = has_met(met, owners) < collision.share - SAME_TIME;
            look.settle(collision, &mut pair.looked(colliders), waits, contacts);
            if contacts.len() > before {
                meet(met, owners, collision.share);
            }
        }
        // A pair that the solution leaves overlapping may have hidden points only.
        if reached == Reached::Solved && contacts.len() == known {
            for collision in collisions {
                let mut pair = pairs[collision.pair].looked(colliders);
                look.admit_hidden(collision, &mut pair, contacts);
            }
        }
        // A crowded search leaves pairs out, whose collisions are missed.
        self.missed = look.missed.or_else(|| self.crowded());
    }

    /// A pair of the last search if it was crowded: it ended at [`MOST_PAIRS`] pairs.
    pub(super) fn crowded(&self) -> Option<[Partner; 2]> {
        let last = self.memory.pairs.get(MOST_PAIRS - 1)?;
        Some(last.owners(&self.colliders).map(PieceOwner::partner))
    }

    /// Deepest overlap of two pieces with the bodies at `states`, among the first `most` that are
    /// deeper than `allowed` (m) for their pair.
    pub(super) fn deepest(
        &mut self,
        world: &World,
        states: &[State],
        most: usize,
        allowed: impl Fn([(Partner, PieceExtent); 2]) -> f64,
    ) -> Option<Overlap> {
        let (mut deepest, mut count): (Option<Overlap>, _) = (None, 0);
        self.each_depth(world, states, |depth, sides| {
            if depth > 0.0 {
                let allowed = allowed(sides);
                count += usize::from(depth > allowed);
                if depth > deepest.map_or(allowed, |known| known.depth.max(allowed)) {
                    deepest = Some(Overlap { depth, allowed, between: (sides[0].0, sides[1].0) });
                }
            }
            count < most
        });
        deepest
    }

    /// All overlaps deeper than `least` (m), the deepest first.
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
            true
        });
        overlaps.sort_by(|a, b| b.depth.total_cmp(&a.depth));
        overlaps
    }

    /// Visits the pairs of near pieces with the bodies at `states`. `visit` gets their depth (m,
    /// negative if they are apart), owners and extents, and returns false to end the visit. It also
    /// ends at the first [`MOST_OF_CROWD`] pairs of a crowded search.
    fn each_depth(
        &mut self,
        world: &World,
        states: &[State],
        mut visit: impl FnMut(f64, [(Partner, PieceExtent); 2]) -> bool,
    ) {
        let known = self.memory.end == states && self.lists(world);
        if !known && !self.stand(world, states) {
            return;
        }
        let Self { memory, colliders, extents, poses, scratch, touches, .. } = self;
        let mut goes_on = true;
        let most = if memory.pairs.len() < MOST_PAIRS { usize::MAX } else { MOST_OF_CROWD };
        for (index, pair) in memory.pairs.iter_mut().enumerate() {
            if !goes_on || index >= most {
                // A lower bound without work.
                (pair.gap, pair.is_bound) = (f64::NEG_INFINITY, true);
                continue;
            }
            let [a, b] = pair.colliders.map(|at| colliders.at(at));
            // Most triangles near a body are apart from it.
            if known && pair.gap >= 0.0 && is_triangle(world, b) {
                continue;
            }
            let pieces = (placed(world, poses, a), placed(world, poses, b));
            if !known {
                pair.gap = distance_lower_bound(pieces.0, pieces.1, &pair.hint);
                pair.is_bound = true;
            }
            // The exact depth is computed only where the bound leaves it open.
            if pair.is_bound && pair.gap < 0.0 {
                let hint = &mut pair.hint;
                pair.gap = manifold(pieces.0, pieces.1, 0.0, PieceSide::A, hint, scratch, touches);
                pair.is_bound = false;
            }
            let extents = pair.colliders.map(|at| match extents.get(at) {
                Some(extent) => *extent,
                None => PieceExtent::from_triangle(pieces.1.0),
            });
            let sides = [(a.owner.partner(), extents[0]), (b.owner.partner(), extents[1])];
            goes_on = visit(-pair.gap, sides);
        }
    }

    /// Largest error of the placement of a loaded contact in the step `states` → `next` (eq. 18g) (m).
    /// NaN if a contact names pieces that do not exist, or if there is not one state per body. `visit` gets
    /// the contacts that are not where their pieces touch, with their error (m).
    pub(super) fn placement_error<'c>(
        &mut self,
        world: &World,
        states: &[State],
        next: &[State],
        loaded: impl Iterator<Item = &'c Contact>,
        visit: impl FnMut(&Contact, f64),
    ) -> f64 {
        let Memory { end, from, .. } = &*self.memory;
        let is_placed = self.lists(world) && end == next && from == states;
        if !is_placed && !self.place(world, states, next) {
            return f64::NAN;
        }
        let Self { memory, colliders, poses, begin, partners, placement, known_errors, .. } = self;
        partners.update(world, colliders, &memory.pairs);
        let check = PlacementCheck { world, partners, start: begin, end: poses };
        known_errors.largest(&check, loaded, placement, visit)
    }

    /// Applies `change` to the state of the search after bodies were added, removed or held.
    /// `world` is the changed world.
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

    /// Continues from `memory`, which must fit `world` ([`Memory::fits`]).
    pub(super) fn exchange_memory(&mut self, world: &World, memory: &mut Box<Memory>) {
        std::mem::swap(&mut self.memory, memory);
        if std::mem::replace(&mut self.is_known, true) {
            return;
        }
        if self.memory.start.is_empty() && self.memory.end.is_empty() {
            // There was no search yet.
            self.colliders.clear();
            return;
        }
        // Same as a change of bodies that requests a new search.
        self.change(world, |_| ());
    }

    /// Moves the state that the next search continues from to `memory`.
    pub(super) fn return_memory(&mut self, memory: &mut Box<Memory>) {
        std::mem::swap(&mut self.memory, memory);
    }

    /// Marks the fields derived from the memory as unknown, before another memory.
    pub(super) fn forget(&mut self) {
        self.is_known = false;
    }
}

/// True if `world` has at least two objects whose pieces could touch.
#[inline]
pub(super) fn has_pairs(world: &World) -> bool {
    world.bodies().len() + world.fixed_count() >= 2
}

/// True if an owner has the same pose in both lists.
fn is_still(owner: PieceOwner, before: &[Pose], poses: &[Pose]) -> bool {
    match owner {
        PieceOwner::Fixed(_) => true,
        PieceOwner::Body(index) => before.get(index) == Some(&poses[index]),
    }
}

/// Bound on the displacement of a piece's points from one pose to another (m). `arm` is the largest
/// distance of the points from the centre of mass (m).
fn displacement(owner: PieceOwner, arm: f64, from: &[Pose], to: &[Pose]) -> f64 {
    let PieceOwner::Body(index) = owner else { return 0.0 };
    let (Some(from), Some(to)) = (from.get(index), to.get(index)) else { return f64::INFINITY };
    (to.position - from.position).norm() + arm * (to.rotation - from.rotation).norm()
}

/// Records how deep the bodies at `poses` are in their contacts. The forces there may prevent other
/// collisions, so each of these bodies has met something at the start.
fn sink(contacts: &[Contact], poses: &[Pose], met: &mut [f64], sunk: &mut [Sunk]) {
    for contact in contacts {
        let other = contact.key.partner.body().map(|body| &poses[body]);
        let depth = -contact.gap_at(&poses[contact.key.body], other);
        let normal = contact.features.frame.column(2);
        let normal = other.map_or(normal.into_owned(), |pose| pose.rotation * normal);
        for body in contact.key.bodies() {
            met[body] = 0.0;
            if depth > sunk[body].depth {
                sunk[body] = Sunk { depth, normal };
            }
        }
    }
}

/// Records that two owners collided at the fraction `share` of the trajectory.
fn meet(met: &mut [f64], owners: [PieceOwner; 2], share: f64) {
    for owner in owners {
        if let PieceOwner::Body(index) = owner {
            met[index] = met[index].min(share);
        }
    }
}

/// First collision of one of two owners, as a fraction of the trajectory; ∞ if there is none.
fn has_met(met: &[f64], owners: [PieceOwner; 2]) -> f64 {
    let first = |owner: PieceOwner| match owner {
        PieceOwner::Body(index) => met[index],
        PieceOwner::Fixed(_) => f64::INFINITY,
    };
    first(owners[0]).min(first(owners[1]))
}
