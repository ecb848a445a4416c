//! Admission of the geometric contact points of a pair as contacts: those with a plane that is not
//! known yet.

use super::collider::{Collider, placed, size};
use super::collision::{CollisionSearch, SamplePose};
use super::contact_builder::ContactBuilder;
use super::key_index::{KeyEnd, PieceIndex, end_of, ends_of};
use super::terrain_seams::{is_coplanar, is_triangle, same_contact};
use super::{Contact, ContactKey, Curved, Partner};
use crate::geometry::Feature;
use crate::world::World;

/// Tolerance for a contact's gap at the start below the overlap of the pieces there, as a fraction
/// of the smaller reach. Faces that differ by less are equal ([`manifold`](crate::geometry::manifold())).
pub(super) const SAME_GAP: f64 = 1e-7;
/// Cosine above which two planes for the same features are equal.
const SAME_PLANE: f64 = 0.999_999;
/// Largest number of planes for the same features. If a step rotates a body through more of them,
/// its overlap is reported and the step ends.
const MOST_PLANES: u32 = 8;

impl CollisionSearch<'_> {
    /// Adds planes for the round features that were found last on the trajectory.
    ///
    /// A fast body can pass through the side of a round piece although it begins and ends outside.
    /// A plane stops it.
    pub(super) fn admit_planes_of_round(
        &mut self,
        colliders: [Collider; 2],
        under: f64,
        contacts: &mut Vec<Contact>,
    ) {
        let least = under - self.same_gap(colliders);
        let (world, start, states) = (self.world, self.start, self.states);
        let between = ContactBuilder { world, colliders, at: self.between, start, states };
        for touch in &*self.touches {
            if !matches!(touch.feature, Feature::Round(..)) {
                continue;
            }
            let same_contact = |contact: &&Contact| {
                is_between(&contact.key, colliders[0], colliders[1])
                    && contact.key.pair.is_some_and(|pair| pair.feature == touch.feature)
            };
            let ends = pieces(colliders);
            let planes = self.index.between(contacts, ends).map(|place| &contacts[place]);
            let planes = planes.filter(same_contact).count() as u32;
            let Some(contact) = between.contact(touch, planes.max(1)) else { continue };
            let known = self.index.between(contacts, ends).map(|place| &contacts[place]);
            let is_known = known.filter(same_contact).any(|known| {
                known.features.curved.is_none()
                    && known.normal().dot(&contact.normal()) >= SAME_PLANE
            });
            let is_new = !is_known && !has_plane_of(self.excluded, &contact);
            if contact.gap >= least && is_new && planes < MOST_PLANES {
                contacts.push(contact);
            }
        }
    }

    /// Tolerance of gaps at the start below the overlap there (m).
    fn same_gap(&self, colliders: [Collider; 2]) -> f64 {
        let size = |collider| size(placed(self.world, self.start, collider).0);
        SAME_GAP * size(colliders[0]).min(size(colliders[1]))
    }

    /// True if all geometric contact points found last, at the end, have their planes among
    /// `contacts`.
    pub(super) fn knows(&mut self, colliders: [Collider; 2], contacts: &[Contact]) -> bool {
        let (world, start, states) = (self.world, self.start, self.states);
        let between = ContactBuilder { world, colliders, at: self.end, start, states };
        let mut found = self.touches.iter().filter_map(|touch| between.contact(touch, 0));
        found.all(|contact| unknown_plane(world, &contact, contacts, self.index).is_none())
    }

    /// Adds the geometric contact points found last whose features have no plane yet and whose gap
    /// at the start is at least `under` (m). Returns true if there is any such gap, with a new or a
    /// known plane.
    ///
    /// In free flight a pair with contacts gets no other plane: its contacts may prevent the overlap.
    pub(super) fn admit(
        &mut self,
        colliders: [Collider; 2],
        at: SamplePose,
        under: f64,
        contacts: &mut Vec<Contact>,
    ) -> bool {
        let least = under - self.same_gap(colliders);
        let (world, start, states) = (self.world, self.start, self.states);
        let poses = at.poses(start, self.end, self.between);
        let between = ContactBuilder { world, colliders, at: poses, start, states };
        let mut fits = false;
        for touch in &*self.touches {
            let Some(contact) = between.contact(touch, 0) else { continue };
            if contact.gap < least || has_plane_of(self.excluded, &contact) {
                continue;
            }
            fits = true;
            if !self.is_solved && has_another_plane(colliders, &contact, contacts, self.index) {
                continue;
            }
            if let Some(plane) = unknown_plane(world, &contact, contacts, self.index) {
                contacts.extend(between.contact(touch, plane));
            }
        }
        fits
    }
}

/// Identifiers of the two pieces in the index of contacts.
pub(super) fn pieces(colliders: [Collider; 2]) -> [KeyEnd; 2] {
    colliders.map(|collider| end_of(collider.owner.partner(), collider.piece))
}

/// True if a contact is between two given pieces.
fn is_between(key: &ContactKey, a: Collider, b: Collider) -> bool {
    let Some(features) = key.pair else { return false };
    let owners = (Partner::Body(key.body), key.partner);
    let of = |collider: Collider, owner: Partner, piece: usize| {
        collider.owner.partner() == owner && collider.piece == piece
    };
    let (first, second) = features.pieces;
    (of(a, owners.0, first) && of(b, owners.1, second))
        || (of(b, owners.0, first) && of(a, owners.1, second))
}

/// True if a contact is between two given pieces, or between the first one and the terrain of the
/// second. A body on a terrain is held by contacts with some of the triangles that it touches.
pub(super) fn is_near_held(world: &World, contact: &Contact, a: Collider, b: Collider) -> bool {
    let key = &contact.key;
    is_between(key, a, b)
        || is_triangle(world, b)
            && (Partner::Body(key.body), key.partner) == (a.owner.partner(), b.owner.partner())
            && key.pair.is_some_and(|pair| pair.pieces.0 == a.piece)
}

/// True if a contact is between two given pieces, or its plane contains the second one, a triangle.
pub(super) fn is_held(world: &World, contact: &Contact, a: Collider, b: Collider) -> bool {
    is_between(&contact.key, a, b) || is_triangle(world, b) && is_coplanar(world, contact, a, b)
}

/// True unless two contacts of an ellipsoid are too far apart on it for one of them.
fn reaches(known: &Contact, other: &Contact) -> bool {
    match (&known.features.curved, &other.features.curved) {
        (Some(Curved::Ellipsoid(known)), Some(Curved::Ellipsoid(other))) => {
            known.reaches(&other.toward)
        }
        _ => true,
    }
}

/// True if a pair has contacts, all with other normals than `contact`.
fn has_another_plane(
    colliders: [Collider; 2],
    contact: &Contact,
    contacts: &[Contact],
    index: &mut PieceIndex,
) -> bool {
    let known = index.between(contacts, pieces(colliders)).map(|place| &contacts[place]);
    let mut known = known.peekable();
    // The normal of a contact points to its body, either of the two.
    let along = |known: &Contact| {
        if known.key.body == contact.key.body { known.normal() } else { -known.normal() }
    };
    known.peek().is_some() && known.all(|known| along(known).dot(&contact.normal()) < SAME_PLANE)
}

/// True if both contacts have the same features, in one or in two planes.
fn has_same_features(known: &Contact, other: &Contact) -> bool {
    let features = |contact: &Contact| contact.key.pair.map(|pair| (pair.pieces, pair.feature));
    ContactKey { pair: other.key.pair, ..known.key } == other.key
        && features(known) == features(other)
}

/// True if the list has a contact with the features and the plane of `contact`.
pub(super) fn has_plane_of(list: &[Contact], contact: &Contact) -> bool {
    let is_same = |known: &Contact| {
        has_same_features(known, contact) && known.normal().dot(&contact.normal()) >= SAME_PLANE
    };
    list.iter().any(is_same)
}

/// Number of the plane for the features of `contact`. `None` if `contacts` have an equal plane for
/// them, or too many others.
pub(super) fn unknown_plane(
    world: &World,
    contact: &Contact,
    contacts: &[Contact],
    index: &mut PieceIndex,
) -> Option<u32> {
    let mut planes = 0;
    let between = index.between(contacts, ends_of(&contact.key));
    for known in between.map(|place| &contacts[place]) {
        if same_contact(world, known, contact) {
            return None;
        }
        if has_same_features(known, contact) {
            if known.normal().dot(&contact.normal()) >= SAME_PLANE && reaches(known, contact) {
                return None;
            }
            planes += 1;
        }
    }
    (planes < MOST_PLANES).then_some(planes)
}
