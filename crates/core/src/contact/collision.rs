//! Collisions of two pieces within a step: the features of their first overlap.
//!
//! The plane of a face stops a point wherever it meets the plane, even beside the face. A plane
//! that a point is behind at the start of the step pushes the point although nothing touches. So
//! the features of a pair come from its first overlap beyond rounding on the trajectories of the
//! step:
//!
//! - If the pair still overlaps at the end in the direction of the first overlap, the features at
//!   the end are used. All corners that come down are known there.
//! - Otherwise the features at the first overlap are used. Only the earliest collision of a body is
//!   added at once, because its force may prevent the others.
//! - If the contacts of a pair hold but another feature ends too deep, the features are used where
//!   that overlap begins.
//! - A predicted motion sinks into the known contacts. An overlap that is no deeper than that, along another
//!   direction, is left to the solution: a puck that sinks over a slot does not hit the side of the slot.
//! - If none of them is left and the solution makes the pair deeper, hidden features are used.
//!
//! A contact is rejected if its gap at the start is below the overlap of the pieces there. If this
//! rejects all contacts, the features that face each other at the start are used. Nothing crosses
//! the plane across their shortest line.

use super::collider::{Collider, Colliders, PieceExtent, PieceOwner, placed, size};
use super::contact_filter::{is_held, is_near_held, pieces};
use super::exposure::{ContactSearch, Exposure, ExposureScratch};
use super::key_index::PieceIndex;
use super::memory::Neighbour;
use super::owner::plane_of;
use super::partners::Partners;
use super::terrain_seams::is_triangle;
use super::{Contact, Partner};
use crate::geometry::{
    Advance, Hint, ManifoldPoint, Moving, PairScratch, Piece, distance_lower_bound, first_overlap,
    signed_distance, stays_clear, travel,
};
use crate::mechanics::trajectory::LARGEST_TURN;
use crate::mechanics::{Pose, State, Trajectory};
use crate::world::World;
use nalgebra::Vector3;

/// Height above which corners of a touching face do not come down in the step, as a fraction of the
/// reach. Corners that do are found after the step.
pub(super) const BAND: f64 = super::detection::CONTACT_BAND;
/// Distance up to which pieces nearly touch, as a fraction of the smaller reach. Their points do
/// not slide to another feature within a step. A smaller overlap on the trajectory is not a
/// collision: drift must not turn the shared edge of two tiles into an obstacle.
pub(super) const NEAR: f64 = 1e-5;
/// Same limit for thin pieces, as a fraction of the sum of both thicknesses.
const NEAR_OF_THIN: f64 = 1e-2;
/// Overlap allowed within a step to pieces whose contacts hold, as a fraction of the sum of both
/// thicknesses. The bulge of their rotation comes on top.
const DEEP: f64 = 0.1;
/// Cosine above which two directions are equal. A pair with equal directions at its first overlap
/// and at the end has met one side of a piece.
const SAME_DIRECTION: f64 = 0.9;
/// Number of bisections: a place on the trajectory is found to a fraction of 2⁻³⁰.
const BISECTIONS: u32 = 30;

/// Two colliders and the cached state of their pair.
pub(super) struct PairState<'a> {
    /// The colliders, the first one of a body.
    pub colliders: [Collider; 2],
    /// Numbers of the colliders.
    pub numbers: [usize; 2],
    pub hint: &'a mut Hint,
    /// Separation at the end (m); a lower bound if `is_bound`.
    pub gap: &'a mut f64,
    pub is_bound: &'a mut bool,
    /// True for polyhedra that touch at the start where other pieces hide all points.
    pub is_hidden: bool,
}

/// Search for collisions on the trajectories of one step.
pub(super) struct CollisionSearch<'a> {
    pub world: &'a World,
    pub states: &'a [State],
    /// Poses of the bodies at the start of the step.
    pub start: &'a [Pose],
    /// Poses of the bodies at the end of the step.
    pub end: &'a [Pose],
    pub trajectories: &'a [Trajectory],
    pub extents: &'a [PieceExtent],
    /// Overlap at the end up to which a pair has not collided (m).
    pub depth: f64,
    /// Workspace for poses on the trajectory. Only the poses of the two bodies are set.
    pub between: &'a mut [Pose],
    /// True if the end is a solution with the given contacts or near one, false if it is free flight.
    pub is_solved: bool,
    /// Overlap of each body with its known contacts at the end. Empty unless the end is
    /// [foreseen](Reached::Foreseen).
    pub sunk: &'a [Sunk],
    /// Contacts of the step, by their pieces.
    pub index: &'a mut PieceIndex,
    pub partners: &'a mut Partners,
    pub exposure: &'a mut ExposureScratch,
    pub scratch: &'a mut PairScratch,
    pub touches: &'a mut Vec<ManifoldPoint>,
    /// Contacts that are not added.
    pub excluded: &'a [Contact],
    /// True if all features of the pair that was examined last are hidden by other pieces.
    pub is_hidden: bool,
    /// True while hidden features count.
    pub with_hidden: bool,
    /// First pair whose collision the step passes or misses.
    pub missed: Option<[Partner; 2]>,
}

/// State at the end of a step in which contacts are searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Reached {
    /// Free flight.
    Free,
    /// Between free flight and the solution. The known contacts may be violated.
    Foreseen,
    /// The solution with the known contacts.
    Solved,
}

/// Deepest overlap of a body with its contacts.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Sunk {
    /// Overlap with the deepest contact (m).
    pub depth: f64,
    /// Normal of this contact (unit, world).
    pub normal: Vector3<f64>,
}

/// Place on the trajectory at which a pair is examined.
#[derive(Debug, Clone, Copy)]
pub(super) enum SamplePose {
    Start,
    /// The start, with unlimited reach for the features that face each other.
    StartFar,
    End,
    Intermediate,
}

impl SamplePose {
    pub(super) fn poses<'a>(
        self,
        start: &'a [Pose],
        end: &'a [Pose],
        between: &'a [Pose],
    ) -> &'a [Pose] {
        match self {
            Self::Start | Self::StartFar => start,
            Self::End => end,
            Self::Intermediate => between,
        }
    }
}

/// A pair that collides on its trajectory.
#[derive(Debug, Clone, Copy)]
pub(super) struct Collision {
    /// Index of the pair.
    pub pair: usize,
    /// Place of the collision, as a fraction of the trajectory.
    pub share: f64,
    /// True if the pair overlaps at the end.
    is_deep: bool,
    /// True if the pair overlaps deeply before the end, or has passed what it collided with.
    goes_through: bool,
    /// Overlap on the trajectory up to which the pair has not collided (m).
    fine: f64,
    /// Overlap at the end above which the pair lacks contacts (m).
    deep: f64,
    /// Separation at the start if the pieces overlap there (m, negative), otherwise 0.
    under: f64,
    /// Direction at the end, if the pair overlaps there.
    axis: Option<Vector3<f64>>,
}

impl CollisionSearch<'_> {
    /// True if a piece does not move in the step.
    fn stays(&self, collider: Collider) -> bool {
        match collider.owner {
            PieceOwner::Body(index) => self.start[index] == self.end[index],
            PieceOwner::Fixed(_) => true,
        }
    }

    /// True if a pair with a triangle of a terrain has so much room at the start that it does not
    /// collide. Its gap becomes a bound for the end.
    pub fn is_out_of_reach(&self, pair: &mut Neighbour, colliders: &Colliders) -> bool {
        let [number, other] = pair.colliders;
        let PieceOwner::Body(body) = colliders.at(number).owner else { return false };
        if !is_triangle(self.world, colliders.at(other)) {
            return false;
        }
        let trajectory = &self.trajectories[body];
        let arm = self.extents[number].arm;
        let least =
            pair.clearance.0 - trajectory.shift().norm() - arm * trajectory.angle().min(2.0);
        if least < -self.depth {
            return false;
        }
        (pair.gap, pair.is_bound) = (least, true);
        true
    }

    /// Finds the collision of a pair that its contacts do not prevent.
    ///
    /// A pair that nearly touches at the start collides there and not where it would have moved.
    /// Its contacts are added at once. A collision is returned only if there are none.
    pub fn find_collision(
        &mut self,
        index: usize,
        indices: [usize; 2],
        pair: &mut PairState<'_>,
        contacts: &mut Vec<Contact>,
    ) -> Option<Collision> {
        // A pair at rest whose exact gap shows no overlap has no collision.
        let [a, b] = pair.colliders;
        if !*pair.is_bound && *pair.gap >= -self.depth && self.stays(a) && self.stays(b) {
            return None;
        }
        // The gap within the step is at least the one at the end less the way of both pieces.
        let ends = (placed(self.world, self.end, a), placed(self.world, self.end, b));
        *pair.gap = distance_lower_bound(ends.0, ends.1, pair.hint);
        *pair.is_bound = true;
        let extents = [
            self.extents[indices[0]],
            match self.extents.get(indices[1]) {
                Some(extent) => *extent,
                None => PieceExtent::from_triangle(ends.1.0),
            },
        ];
        let moving = [self.moving(a, extents[0]), self.moving(b, extents[1])];
        if *pair.gap - travel(&moving[0], &moving[1]) >= -self.depth {
            return None;
        }
        // The direction of a rotation by several turns, or by most of one, is unknown.
        if moving[0].trajectory.angle().max(moving[1].trajectory.angle()) > LARGEST_TURN {
            self.miss(pair.colliders);
        }
        // If other pieces hide all that touches, as between the corners of a box on tiles, the solution shows
        // whether something is missing.
        if pair.is_hidden && !self.is_solved {
            return None;
        }
        // Depths: `fine` is ignored, `deep` and `passing` are beyond what contacts leave.
        let near = NEAR * extents[0].size.min(extents[1].size);
        // A tangent plane of a step leaves a gap by the curvature of both surfaces, as long as they do not part.
        let curved = [ends.0.0, ends.1.0].map(Piece::is_curved);
        let touching = if curved == [true; 2] { near.max(self.world.fall()) } else { near };
        let thick = extents[0].inner + extents[1].inner;
        let fine = self.depth.max(near.min(NEAR_OF_THIN * thick));
        let deep = fine + DEEP * thick;
        let passing = deep + moving[0].bulge() + moving[1].bulge();
        if *pair.gap < -self.depth {
            *pair.gap = self.touches(pair, SamplePose::End);
            *pair.is_bound = false;
        }
        let is_deep = *pair.gap < -self.depth;
        // The searches below move the hint.
        let axis = if is_deep { pair.hint.axis_from(ends.1.1) } else { None };
        let mut goes_through = !is_deep;
        if is_deep && !stays_clear(&moving[0], &moving[1], passing, pair.hint) {
            goes_through = self.first(&moving, passing, pair).is_some();
        } else if is_deep
            && *pair.gap >= self.least_gap(pair.colliders, contacts) - fine
            && self.knows(pair.colliders, contacts)
        {
            // Remaining overlap by rotation between planes that are all known, or planes of a terrain that do
            // not hold yet.
            return None;
        }
        if !is_deep {
            // Apart at the end. The pair may have been on the other side before.
            if stays_clear(&moving[0], &moving[1], fine, pair.hint) {
                return None;
            }
            let mut known = self.index.between(contacts, pieces([a, b]));
            let is_known = known.any(|place| is_near_held(self.world, &contacts[place], a, b));
            drop(known);
            // A pair without contacts is not held by anything.
            let most = if is_known { passing } else { fine };
            if is_known && stays_clear(&moving[0], &moving[1], most, pair.hint) {
                return None;
            }
            self.first(&moving, most, pair)?;
        }
        // Pairs that nearly touch at the start collide there.
        let was = (placed(self.world, self.start, a), placed(self.world, self.start, b));
        let (mut under, mut begins_near) = (0.0, false);
        if distance_lower_bound(was.0, was.1, pair.hint) <= touching {
            let gap = self.touches(pair, SamplePose::Start);
            under = gap.min(0.0);
            begins_near = gap <= touching;
            let before = contacts.len();
            let now = pair.hint.axis_from(was.1.1);
            if begins_near {
                if self.may_be_prevented(pair, fine, now) {
                    return None;
                }
                // A piece that slides to an edge level with it is beside the edge now, and ends above it.
                let ends_above = is_deep && *pair.gap >= -fine && !is_same(axis, now);
                if !(ends_above && self.admits_at_end(pair, under, contacts)) {
                    self.touches(pair, SamplePose::Start);
                    self.admit(pair.colliders, SamplePose::Start, f64::NEG_INFINITY, contacts);
                }
            }
            if contacts.len() > before {
                return None;
            }
        }
        // A pair that touched and ends no deeper has its features at the end.
        let is_shallow = begins_near && *pair.gap >= under - fine;
        let first =
            if is_deep && is_shallow { None } else { self.first(&moving, fine - under, pair) };
        let share = first.unwrap_or(1.0);
        let deep = deep - under;
        Some(Collision { pair: index, share, is_deep, goes_through, fine, deep, under, axis })
    }

    /// Adds the contacts of a pair that collides.
    ///
    /// If it `waits` for an earlier collision of one of its bodies, it is examined again after that
    /// one, because the force of the other may prevent it. This does not apply if it ends with the
    /// same features as at the collision.
    pub fn settle(
        &mut self,
        collision: &Collision,
        pair: &mut PairState<'_>,
        waits: bool,
        contacts: &mut Vec<Contact>,
    ) {
        let before = contacts.len();
        // A pair that passes or sinks lacks a contact. Round features get planes at the collision.
        self.place(pair.colliders, collision.share);
        self.touches(pair, SamplePose::Intermediate);
        let is_hidden_there = self.is_hidden;
        let now = pair.hint.axis_from(placed(self.world, self.between, pair.colliders[1]).1);
        if self.may_be_prevented(pair, collision.fine, collision.axis)
            || self.may_be_prevented(pair, collision.fine, now)
        {
            return;
        }
        if is_same(collision.axis, now) {
            // Same direction as at the collision: all corners that come down are known at the end.
            self.touches(pair, SamplePose::End);
            self.admit(pair.colliders, SamplePose::End, collision.under, contacts);
            if contacts.len() > before {
                return;
            }
            self.touches(pair, SamplePose::Intermediate);
        } else if waits {
            return;
        }
        if !self.admit(pair.colliders, SamplePose::Intermediate, collision.under, contacts) {
            // The rim of a flat end that is above a plate has no point there until a corner is.
            let is_shallow = *pair.gap >= collision.under - collision.fine;
            let is_last = collision.share >= 1.0 && is_shallow;
            if self.touches.is_empty() && (is_last || self.sinks(pair, collision.fine, |_| true)) {
                return;
            }
            self.touches(pair, SamplePose::StartFar);
            self.admit(pair.colliders, SamplePose::StartFar, f64::NEG_INFINITY, contacts);
        }
        if contacts.len() == before && collision.is_deep && collision.share < 1.0 {
            // Its contacts hold at the end, and another feature is too deep there.
            self.place_beside_known(collision, pair, contacts);
            self.touches(pair, SamplePose::Intermediate);
            self.admit(pair.colliders, SamplePose::Intermediate, collision.under, contacts);
            if contacts.len() == before {
                self.touches(pair, SamplePose::End);
                self.admit(pair.colliders, SamplePose::End, collision.under, contacts);
            }
        }
        let passes = collision.goes_through && !is_hidden_there;
        if contacts.len() > before || !passes && *pair.gap >= -collision.deep {
            return;
        }
        self.place(pair.colliders, collision.share);
        self.touches(pair, SamplePose::Intermediate);
        self.admit_planes_of_round(pair.colliders, collision.under, contacts);
        if contacts.len() == before {
            self.miss(pair.colliders);
        }
    }

    /// Adds hidden contact points of a pair that a solution without missing contacts leaves deeper than it
    /// began.
    ///
    /// The cones of normals describe pieces that are large against their overlap. At a small corner they may
    /// hide the points of all pieces, although the body touches there.
    pub fn admit_hidden(
        &mut self,
        collision: &Collision,
        pair: &mut PairState<'_>,
        contacts: &mut Vec<Contact>,
    ) {
        let [a, b] = pair.colliders;
        // The depth of a known contact is an error of the solution. It does not show that one is missing.
        let bodies = [a, b].map(|collider| collider.owner.partner().body());
        let is_of_pair =
            |contact: &&Contact| contact.key.bodies().any(|body| bodies.contains(&Some(body)));
        let known = contacts.iter().filter(is_of_pair);
        let gap_at_end = |contact: &Contact| {
            let other = contact.key.partner.body().map(|body| &self.end[body]);
            contact.gap_at(&self.end[contact.key.body], other)
        };
        let least = known.map(gap_at_end).fold(collision.under, f64::min);
        if *pair.gap >= least - collision.fine {
            return;
        }
        self.with_hidden = true;
        self.place(pair.colliders, collision.share);
        for at in [SamplePose::Intermediate, SamplePose::End] {
            let before = contacts.len();
            self.touches(pair, at);
            self.admit(pair.colliders, at, collision.under, contacts);
            if contacts.len() > before {
                break;
            }
        }
        self.with_hidden = false;
    }

    /// Records that the step misses the collision of a pair.
    fn miss(&mut self, colliders: [Collider; 2]) {
        self.missed.get_or_insert(colliders.map(|collider| collider.owner.partner()));
    }

    /// Sets the poses of a pair where it begins to overlap deeper than its contacts allow, by
    /// bisection.
    ///
    /// The contacts hold at the end. On the trajectory, where a rotation carries a point off the
    /// chord, the pieces are moved apart by the overlap of their deepest contact.
    fn place_beside_known(
        &mut self,
        collision: &Collision,
        pair: &mut PairState<'_>,
        contacts: &[Contact],
    ) {
        let (mut clear, mut met) = (0.0, 1.0);
        for _ in 0..BISECTIONS {
            let share = 0.5 * (clear + met);
            self.place(pair.colliders, share);
            self.lift(pair.colliders, contacts);
            let [a, b] = pair.colliders;
            let pieces = (placed(self.world, self.between, a), placed(self.world, self.between, b));
            let distance = signed_distance(pieces.0, pieces.1, pair.hint, self.scratch).distance;
            if distance < collision.under - collision.fine {
                met = share;
            } else {
                clear = share;
            }
        }
        self.place(pair.colliders, met);
        self.lift(pair.colliders, contacts);
    }

    /// Moves a pair apart by the overlap of its deepest contact at the current poses.
    fn lift(&mut self, colliders: [Collider; 2], contacts: &[Contact]) {
        let mut lift: Option<(usize, Vector3<f64>, f64)> = None;
        let known = self.index.between(contacts, pieces(colliders)).map(|place| &contacts[place]);
        let [a, b] = colliders;
        for contact in known.filter(|contact| is_held(self.world, contact, a, b)) {
            let a = &self.between[contact.key.body];
            let b = match contact.key.partner {
                Partner::Body(other) => Some(&self.between[other]),
                Partner::Fixed(_) | Partner::Ground => None,
            };
            let gap = contact.gap_at(a, b);
            if gap < lift.map_or(0.0, |(.., least)| least) {
                let normal = contact.features.frame.column(2);
                let normal = b.map_or(normal.into_owned(), |pose| pose.rotation * normal);
                lift = Some((contact.key.body, normal, gap));
            }
        }
        if let Some((body, normal, gap)) = lift {
            self.between[body].position -= normal * gap;
        }
    }

    /// Least gap at the end of the known contacts with a triangle (m), at most 0. 0 for another pair.
    fn least_gap(&mut self, colliders: [Collider; 2], contacts: &[Contact]) -> f64 {
        if !is_triangle(self.world, colliders[1]) {
            return 0.0;
        }
        let known = self.index.between(contacts, pieces(colliders)).map(|place| &contacts[place]);
        known.map(|contact| contact.gap_at(&self.end[contact.key.body], None)).fold(0.0, f64::min)
    }

    /// First fraction of the trajectory at which a pair overlaps by `depth` (m).
    fn first(
        &mut self,
        moving: &[Moving<'_>; 2],
        depth: f64,
        pair: &mut PairState<'_>,
    ) -> Option<f64> {
        match first_overlap(&moving[0], &moving[1], depth, pair.hint, self.scratch) {
            Advance::Clear => None,
            Advance::Met(share) => Some(share),
            Advance::GaveUp(share) => {
                self.miss(pair.colliders);
                Some(share)
            }
        }
    }

    fn moving<'b>(&self, collider: Collider, extent: PieceExtent) -> Moving<'b>
    where
        Self: 'b,
    {
        let (piece, from) = placed(self.world, self.start, collider);
        let (_, to) = placed(self.world, self.end, collider);
        let trajectory = match collider.owner {
            PieceOwner::Body(index) => &self.trajectories[index],
            PieceOwner::Fixed(_) => &Trajectory::STILL,
        };
        Moving { piece, trajectory, ends: (from, to), arm: extent.arm }
    }

    /// Sets the poses of a pair at the fraction `share` of its trajectory.
    fn place(&mut self, colliders: [Collider; 2], share: f64) {
        for collider in colliders {
            if let PieceOwner::Body(index) = collider.owner {
                let is_end = share >= 1.0;
                let pose =
                    if is_end { self.end[index] } else { self.trajectories[index].at(share) };
                self.between[index] = pose;
            }
        }
    }

    /// Finds the geometric contact points of a pair. Returns the gap (m).
    fn touches(&mut self, pair: &mut PairState<'_>, at: SamplePose) -> f64 {
        let [a, b] = pair.colliders;
        let world = self.world;
        let poses = at.poses(self.start, self.end, self.between);
        let pieces = (placed(world, poses, a), placed(world, poses, b));
        let mut reach = BAND * size(pieces.0.0).min(size(pieces.1.0));
        if matches!(at, SamplePose::StartFar) {
            reach += signed_distance(pieces.0, pieces.1, pair.hint, self.scratch).distance.max(0.0);
        }
        let plane_of = plane_of(world, self.states, self.start, a, b);
        self.partners.list_around(world, pair.numbers);
        let of =
            Exposure { world, partners: self.partners, colliders: [a, b], numbers: pair.numbers };
        let moments = [self.start, self.end];
        let workspace = (&mut *self.scratch, &mut *self.exposure);
        let with_hidden = self.with_hidden;
        let search = ContactSearch { reach, within: reach, plane_of, with_hidden };
        let (gap, is_hidden) =
            of.contact_points(poses, &moments, search, pair.hint, workspace, self.touches);
        self.is_hidden = is_hidden;
        gap
    }

    /// Adds the contacts of a pair at the end of the step. Returns false if none of them fits its start.
    fn admits_at_end(
        &mut self,
        pair: &mut PairState<'_>,
        under: f64,
        contacts: &mut Vec<Contact>,
    ) -> bool {
        self.touches(pair, SamplePose::End);
        self.admit(pair.colliders, SamplePose::End, under, contacts)
    }

    /// True if the forces at the known contacts may prevent that a pair collides along `axis` (unit,
    /// world): a body of the pair [sinks](Self::sinks) along another direction.
    fn may_be_prevented(
        &self,
        pair: &PairState<'_>,
        fine: f64,
        axis: Option<Vector3<f64>>,
    ) -> bool {
        let Some(axis) = axis else { return false };
        self.sinks(pair, fine, |normal| axis.dot(normal).abs() < SAME_DIRECTION)
    }

    /// True if a body of the pair sinks into a contact with such a normal (unit, world), at least as deep as the
    /// pair overlaps at the end, to `fine` (m).
    fn sinks(
        &self,
        pair: &PairState<'_>,
        fine: f64,
        is_such: impl Fn(&Vector3<f64>) -> bool,
    ) -> bool {
        let is_deep = |sunk: &Sunk| {
            sunk.depth > 0.0 && sunk.depth + fine >= -*pair.gap && is_such(&sunk.normal)
        };
        let owners = pair.colliders.iter().map(|collider| collider.owner.partner());
        owners.filter_map(Partner::body).any(|body| self.sunk.get(body).is_some_and(is_deep))
    }
}

/// True if two directions (unit, world) are known and the same.
fn is_same(one: Option<Vector3<f64>>, other: Option<Vector3<f64>>) -> bool {
    matches!((one, other), (Some(one), Some(other)) if one.dot(&other) >= SAME_DIRECTION)
}
