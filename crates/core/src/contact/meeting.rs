//! What two pieces meet with within a step: the features of the place where they first do.
//!
//! A plane of a piece stops a point wherever it meets the plane, also beside the face that it is of; and
//! a plane that a point is behind at the step's start pushes it although nothing touches. So what two
//! pieces meet with is decided at the first place on the way of the step, turning and moving together,
//! where they overlap by more than rounding:
//!
//! * if they end overlapped in the direction in which they met there, the features are those of the end,
//!   where all corners that come down are known;
//! * otherwise those of that place, of which only the earliest meeting of a body is taken at once: with
//!   its force the body may never come to the others;
//! * where the contacts that a pair has hold and another feature ends too deep, those of the place where
//!   that begins.
//!
//! No contact is taken whose gap at the start is below what the pieces overlap there; where that leaves
//! none, the features that face each other at the start are taken, across whose shortest line nothing is.

use super::between::Between;
use super::key_index::{KeyEnd, PieceIndex, ends_of};
use super::owner::plane_of;
use super::proxy::{PieceExtent, PieceOwner, Proxy, placed, size};
use super::{Contact, ContactKey, Partner};
use crate::geometry::{
    Advance, Feature, Hint, Moving, PairScratch, Touch, bound, first_overlap, manifold, separation,
    stays_clear, travel,
};
use crate::mechanics::way::LARGEST_TURN;
use crate::mechanics::{Pose, State, Way};
use crate::world::World;
use nalgebra::Vector3;

/// Corners of a touching face that are higher than this part of the reach do not come down in
/// the step; those that do are found after it.
pub(super) const BAND: f64 = super::detection::CONTACT_BAND;
/// What is apart by no more than this part of the smaller one's reach nearly touches: its points do
/// not slide on in a step to where another feature would be. What overlaps by less on its way has not
/// met yet: a drift must not make a step of the seam between two tiles.
pub(super) const NEAR: f64 = 1e-5;
/// The same in parts of both thicknesses, for what is thin.
const NEAR_OF_THIN: f64 = 1e-2;
/// Pieces that have contacts and hold overlap on their ways by no more than this part of both
/// thicknesses, beside what their turns carry points off the chord.
const DEEP: f64 = 0.1;
/// The gap of a contact at the start is not below what the pieces overlap there by more than this part of
/// the smaller one's reach: faces that differ by less are equals ([`manifold`]).
const SAME_GAP: f64 = 1e-7;
/// Directions of a larger cosine are one: a pair that meets and ends in them has met one side of a piece.
const SAME_WAY: f64 = 0.9;
/// A second plane for the same features is another one from this angle's cosine on.
const SAME_PLANE: f64 = 0.999_999;
/// So many planes for the same features are enough: a step that turns a body through more of them
/// has its overlap reported, and comes to an end.
const MOST_PLANES: u32 = 8;
/// A place on the way is found to the 2⁻³⁰th part of it.
const BISECTIONS: u32 = 30;

/// Two pieces and what is known of them.
pub(super) struct Looked<'a> {
    /// The pieces, the first one of a body.
    pub proxies: [Proxy; 2],
    pub hint: &'a mut Hint,
    /// The separation at the end, m, a bound from below if `is_bound`.
    pub gap: &'a mut f64,
    pub is_bound: &'a mut bool,
}

/// One look at the ways of a step.
pub(super) struct Sweeping<'a> {
    pub world: &'a World,
    pub states: &'a [State],
    /// Where the bodies are at both ends.
    pub start: &'a [Pose],
    pub end: &'a [Pose],
    pub ways: &'a [Way],
    pub extents: &'a [PieceExtent],
    /// What overlaps by no more at the end has not met, m.
    pub depth: f64,
    /// Memory for poses on the way: those of the two bodies that are looked at are set.
    pub between: &'a mut [Pose],
    /// The contacts of the step, by their pieces.
    pub index: &'a mut PieceIndex,
    pub scratch: &'a mut PairScratch,
    pub touches: &'a mut Vec<Touch>,
    /// Whether something was passed or left out.
    pub passed: bool,
}

/// Where the bodies are where a pair is looked at.
#[derive(Debug, Clone, Copy)]
enum MeetingPlace {
    Start,
    /// The same, for what faces each other there however far that is.
    StartFar,
    End,
    Between,
}

impl MeetingPlace {
    fn of<'a>(self, start: &'a [Pose], end: &'a [Pose], between: &'a [Pose]) -> &'a [Pose] {
        match self {
            Self::Start | Self::StartFar => start,
            Self::End => end,
            Self::Between => between,
        }
    }
}

/// A pair that meets on its way.
#[derive(Debug, Clone, Copy)]
pub(super) struct Meeting {
    /// The index of the pair.
    pub pair: usize,
    /// Where: the part of the way.
    pub share: f64,
    /// Whether the pair ends overlapped, and whether it overlaps deep before, or ends clear of what it has
    /// met.
    is_deep: bool,
    goes_through: bool,
    /// What overlaps by no more on the way has not met yet, m.
    fine: f64,
    /// What ends overlapped by more has contacts too few, m.
    deep: f64,
    /// What the pieces overlap at the start, m, negative; 0 where they do not.
    under: f64,
    /// The direction at the end, of what ends overlapped.
    axis: Option<Vector3<f64>>,
}

impl Sweeping<'_> {
    /// Whether a piece is where it was.
    fn stays(&self, proxy: Proxy) -> bool {
        match proxy.owner {
            PieceOwner::Body(index) => self.start[index] == self.end[index],
            PieceOwner::Fixed(_) => true,
        }
    }

    /// Where a pair meets whose contacts do not see to it. What nearly touches at the start meets there, and
    /// not where it would have gone: its contacts join at once, and it meets again only if there are none.
    pub fn meeting(
        &mut self,
        index: usize,
        indices: [usize; 2],
        pair: &mut Looked<'_>,
        contacts: &mut Vec<Contact>,
    ) -> Option<Meeting> {
        let [a, b] = pair.proxies;
        if !*pair.is_bound && *pair.gap >= -self.depth && self.stays(a) && self.stays(b) {
            return None;
        }
        let ends = (placed(self.world, self.end, a), placed(self.world, self.end, b));
        *pair.gap = bound(ends.0, ends.1, pair.hint);
        *pair.is_bound = true;
        let extents = indices.map(|index| self.extents[index]);
        let moving = [self.moving(a, extents[0]), self.moving(b, extents[1])];
        if *pair.gap - travel(&moving[0], &moving[1]) >= -self.depth {
            return None;
        }
        // Of more turns than one, or of most of one, there is no telling which way it went.
        self.passed |= moving[0].way.angle().max(moving[1].way.angle()) > LARGEST_TURN;
        let near = NEAR * extents[0].size.min(extents[1].size);
        let thick = extents[0].inner + extents[1].inner;
        let fine = self.depth.max(near.min(NEAR_OF_THIN * thick));
        let deep = fine + DEEP * thick;
        let passing = deep + moving[0].bulge() + moving[1].bulge();
        if *pair.gap < -self.depth {
            *pair.gap = self.touches(pair, MeetingPlace::End);
            *pair.is_bound = false;
        }
        let is_deep = *pair.gap < -self.depth;
        let mut goes_through = !is_deep;
        if is_deep && !stays_clear(&moving[0], &moving[1], passing, pair.hint) {
            goes_through = self.first(&moving, passing, pair.hint).is_some();
        } else if is_deep && *pair.gap >= -fine && self.knows(pair.proxies, contacts) {
            // What a turn leaves between planes that are all known.
            return None;
        }
        if !is_deep {
            // Apart at the end; it may have been on the other side before.
            if stays_clear(&moving[0], &moving[1], fine, pair.hint) {
                return None;
            }
            let mut known = self.index.between(contacts, pieces([a, b]));
            let is_known = known.any(|place| is_between(&contacts[place].key, a, b));
            drop(known);
            // What has no contact yet, nothing holds.
            let most = if is_known { passing } else { fine };
            if is_known && stays_clear(&moving[0], &moving[1], most, pair.hint) {
                return None;
            }
            self.first(&moving, most, pair.hint)?;
        }
        let axis = if is_deep { pair.hint.axis_from(ends.0.1) } else { None };
        let was = (placed(self.world, self.start, a), placed(self.world, self.start, b));
        let (mut under, mut begins_near) = (0.0, false);
        if bound(was.0, was.1, pair.hint) <= near {
            let gap = self.touches(pair, MeetingPlace::Start);
            under = gap.min(0.0);
            begins_near = gap <= near;
            let before = contacts.len();
            if begins_near {
                self.admit(pair.proxies, MeetingPlace::Start, f64::NEG_INFINITY, contacts);
            }
            if contacts.len() > before {
                return None;
            }
        }
        // What touched and ends no deeper than that has its features there.
        let is_shallow = begins_near && *pair.gap >= under - fine;
        let first = match is_deep && is_shallow {
            true => None,
            false => self.first(&moving, fine - under, pair.hint),
        };
        let share = first.unwrap_or(1.0);
        let deep = deep - under;
        Some(Meeting { pair: index, share, is_deep, goes_through, fine, deep, under, axis })
    }

    /// Adds the contacts of a pair that meets. If it `waits` for another one, which met one of its bodies
    /// before, it is looked at again after that, unless it ends with what it meets with: with the force of
    /// the other it may never come there.
    pub fn settle(
        &mut self,
        meeting: &Meeting,
        pair: &mut Looked<'_>,
        waits: bool,
        contacts: &mut Vec<Contact>,
    ) {
        let before = contacts.len();
        self.place(pair.proxies, meeting.share);
        self.touches(pair, MeetingPlace::Between);
        if self.is_same_way(meeting, pair) {
            // With what it met, only farther on: all corners that come down are known there.
            self.touches(pair, MeetingPlace::End);
            self.admit(pair.proxies, MeetingPlace::End, meeting.under, contacts);
            if contacts.len() > before {
                return;
            }
            self.touches(pair, MeetingPlace::Between);
        } else if waits {
            return;
        }
        if !self.admit(pair.proxies, MeetingPlace::Between, meeting.under, contacts) {
            self.touches(pair, MeetingPlace::StartFar);
            self.admit(pair.proxies, MeetingPlace::StartFar, f64::NEG_INFINITY, contacts);
        }
        if contacts.len() == before && meeting.is_deep && meeting.share < 1.0 {
            // Its contacts hold at the end, where another feature is too deep.
            self.place_beside_known(meeting, pair, contacts);
            self.touches(pair, MeetingPlace::Between);
            self.admit(pair.proxies, MeetingPlace::Between, meeting.under, contacts);
            if contacts.len() == before {
                self.touches(pair, MeetingPlace::End);
                self.admit(pair.proxies, MeetingPlace::End, meeting.under, contacts);
            }
        }
        if contacts.len() > before || !meeting.goes_through && *pair.gap >= -meeting.deep {
            return;
        }
        self.place(pair.proxies, meeting.share);
        self.touches(pair, MeetingPlace::Between);
        self.admit_planes_of_round(pair.proxies, meeting.under, contacts);
        self.passed |= contacts.len() == before;
    }

    /// Sets the poses of a pair at a place where it begins to overlap by more than its contacts see, by
    /// bisection: they hold at the end, and on the way, where a turn carries a point off the chord, the
    /// pieces are moved apart by what they lack.
    fn place_beside_known(
        &mut self,
        meeting: &Meeting,
        pair: &mut Looked<'_>,
        contacts: &[Contact],
    ) {
        let (mut clear, mut met) = (0.0, 1.0);
        for _ in 0..BISECTIONS {
            let share = 0.5 * (clear + met);
            self.place(pair.proxies, share);
            self.lift(pair.proxies, contacts);
            let [a, b] = pair.proxies;
            let pieces = (placed(self.world, self.between, a), placed(self.world, self.between, b));
            let distance = separation(pieces.0, pieces.1, pair.hint, self.scratch).distance;
            if distance < meeting.under - meeting.fine {
                met = share;
            } else {
                clear = share;
            }
        }
        self.place(pair.proxies, met);
        self.lift(pair.proxies, contacts);
    }

    /// Moves a pair apart by what the contact of it that is deepest on the way lacks there.
    fn lift(&mut self, proxies: [Proxy; 2], contacts: &[Contact]) {
        let mut lift: Option<(usize, Vector3<f64>, f64)> = None;
        let known = self.index.between(contacts, pieces(proxies)).map(|place| &contacts[place]);
        for contact in known.filter(|contact| is_between(&contact.key, proxies[0], proxies[1])) {
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

    /// The first place where a pair overlaps by `depth` (m).
    fn first(&mut self, moving: &[Moving<'_>; 2], depth: f64, hint: &mut Hint) -> Option<f64> {
        match first_overlap(&moving[0], &moving[1], depth, hint, self.scratch) {
            Advance::Clear => None,
            Advance::Met(share) => Some(share),
            Advance::GaveUp(share) => {
                self.passed = true;
                Some(share)
            }
        }
    }

    fn moving<'b>(&self, proxy: Proxy, extent: PieceExtent) -> Moving<'b>
    where
        Self: 'b,
    {
        let (piece, from) = placed(self.world, self.start, proxy);
        let (_, to) = placed(self.world, self.end, proxy);
        let way = match proxy.owner {
            PieceOwner::Body(index) => &self.ways[index],
            PieceOwner::Fixed(_) => &Way::STILL,
        };
        Moving { piece, way, ends: (from, to), arm: extent.arm }
    }

    /// Sets the poses of a pair at a part of its way.
    fn place(&mut self, proxies: [Proxy; 2], share: f64) {
        for proxy in proxies {
            if let PieceOwner::Body(index) = proxy.owner {
                let is_end = share >= 1.0;
                let pose = if is_end { self.end[index] } else { self.ways[index].at(share) };
                self.between[index] = pose;
            }
        }
    }

    /// Finds the touches of a pair. Returns the gap, m.
    fn touches(&mut self, pair: &mut Looked<'_>, at: MeetingPlace) -> f64 {
        let [a, b] = pair.proxies;
        let (world, poses) = (self.world, at.of(self.start, self.end, self.between));
        let pieces = (placed(world, poses, a), placed(world, poses, b));
        let mut reach = BAND * size(pieces.0.0).min(size(pieces.1.0));
        if matches!(at, MeetingPlace::StartFar) {
            reach += separation(pieces.0, pieces.1, pair.hint, self.scratch).distance.max(0.0);
        }
        let plane_of = plane_of(world, self.states, self.start, a, b);
        manifold(pieces.0, pieces.1, reach, plane_of, pair.hint, self.scratch, self.touches)
    }

    /// Adds the planes of the round features that were found last on the way. What moves far in a step goes
    /// through the side of what is round, although it begins and ends outside; a plane stops it.
    fn admit_planes_of_round(
        &mut self,
        proxies: [Proxy; 2],
        under: f64,
        contacts: &mut Vec<Contact>,
    ) {
        let least = under - self.same_gap(proxies);
        let (world, start) = (self.world, self.start);
        let between = Between { world, proxies, at: self.between, start };
        for touch in &*self.touches {
            if !matches!(touch.feature, Feature::Round(..)) {
                continue;
            }
            let is_same = |contact: &&Contact| {
                is_between(&contact.key, proxies[0], proxies[1])
                    && contact.key.pair.is_some_and(|pair| pair.feature == touch.feature)
            };
            let ends = pieces(proxies);
            let planes = self.index.between(contacts, ends).map(|place| &contacts[place]);
            let planes = planes.filter(is_same).count() as u32;
            let Some(contact) = between.contact(touch, planes.max(1)) else { continue };
            let known = self.index.between(contacts, ends).map(|place| &contacts[place]);
            let is_known = known.filter(is_same).any(|known| {
                known.features.curved.is_none()
                    && known.normal().dot(&contact.normal()) >= SAME_PLANE
            });
            if contact.gap >= least && !is_known && planes < MOST_PLANES {
                contacts.push(contact);
            }
        }
    }

    /// What gaps at the start may be below what overlaps there, m.
    fn same_gap(&self, proxies: [Proxy; 2]) -> f64 {
        let size = |proxy| size(placed(self.world, self.start, proxy).0);
        SAME_GAP * size(proxies[0]).min(size(proxies[1]))
    }

    /// Whether all touches of the end, which were found last, have their planes among `contacts`.
    fn knows(&mut self, proxies: [Proxy; 2], contacts: &[Contact]) -> bool {
        let (world, start) = (self.world, self.start);
        let between = Between { world, proxies, at: self.end, start };
        let mut found = self.touches.iter().filter_map(|touch| between.contact(touch, 0));
        found.all(|contact| unknown_plane(&contact, contacts, self.index).is_none())
    }

    /// Whether a pair has the same direction on its way as at its end.
    fn is_same_way(&self, meeting: &Meeting, pair: &Looked<'_>) -> bool {
        let (_, pose) = placed(self.world, self.between, pair.proxies[0]);
        let axes = (meeting.axis, pair.hint.axis_from(pose));
        matches!(axes, (Some(end), Some(now)) if end.dot(&now) >= SAME_WAY)
    }

    /// Adds the contacts of the touches that were found last whose features have no plane yet, and whose
    /// gap at the start is not below `under` (m). Returns whether any is like that, old or new.
    fn admit(
        &mut self,
        proxies: [Proxy; 2],
        at: MeetingPlace,
        under: f64,
        contacts: &mut Vec<Contact>,
    ) -> bool {
        let least = under - self.same_gap(proxies);
        let (world, start) = (self.world, self.start);
        let between = Between { world, proxies, at: at.of(start, self.end, self.between), start };
        let mut fits = false;
        for touch in &*self.touches {
            let Some(contact) = between.contact(touch, 0) else { continue };
            if contact.gap < least {
                continue;
            }
            fits = true;
            if let Some(plane) = unknown_plane(&contact, contacts, self.index) {
                contacts.extend(between.contact(touch, plane));
            }
        }
        fits
    }
}

/// What a contact of two pieces is between.
fn pieces(proxies: [Proxy; 2]) -> [KeyEnd; 2] {
    proxies.map(|proxy| (proxy.owner.partner(), proxy.piece))
}

/// Whether a contact is one of two pieces.
fn is_between(key: &ContactKey, a: Proxy, b: Proxy) -> bool {
    let Some(features) = key.pair else { return false };
    let owners = (Partner::Body(key.body), key.partner);
    let of = |proxy: Proxy, owner: Partner, piece: usize| {
        proxy.owner.partner() == owner && proxy.piece == piece
    };
    let (first, second) = features.pieces;
    (of(a, owners.0, first) && of(b, owners.1, second))
        || (of(b, owners.0, first) && of(a, owners.1, second))
}

/// The number of the plane for the features of `contact`, if `contacts` have none for them that is
/// as good as the same, and not too many others.
fn unknown_plane(contact: &Contact, contacts: &[Contact], index: &mut PieceIndex) -> Option<u32> {
    let mut planes = 0;
    let between = index.between(contacts, ends_of(&contact.key));
    for known in between.map(|place| &contacts[place]) {
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
