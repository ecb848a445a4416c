//! Contacts that are not where their pieces touch, and those that the next searches of the same step find
//! instead of them.

use super::super::Contact;
use super::super::collider::{placed, size};
use super::super::collision::BAND;
use super::super::contact_builder::ContactBuilder;
use super::super::contact_filter::{SAME_GAP, has_plane_of, unknown_plane};
use super::super::exposure::{ContactSearch, Exposure};
use super::super::owner::plane_of;
use super::Neighbours;
use crate::geometry::signed_distance;
use crate::mechanics::State;
use crate::world::World;

/// Contacts that a search leaves out, and those that it may add.
#[derive(Debug, Clone, Default)]
pub(crate) struct Replaced {
    pub(crate) excluded: Vec<Contact>,
    substitutes: Vec<Contact>,
    /// True if the search adds substitutes.
    pub(crate) has_substitutes: bool,
}

impl Replaced {
    pub(crate) fn is_empty(&self) -> bool {
        self.excluded.is_empty()
    }

    pub(crate) fn clear(&mut self) {
        self.excluded.clear();
        self.substitutes.clear();
    }
}

impl Neighbours {
    /// Leaves `misplaced` contacts out of the next searches. Their substitutes are the points in which the pieces
    /// are nearest to each other where the last step from `states` ended.
    pub(crate) fn replace(
        &mut self,
        world: &World,
        states: &[State],
        misplaced: &[(Contact, f64)],
    ) {
        let misplaced: Vec<_> = misplaced.iter().map(|(contact, _)| *contact).collect();
        let Self {
            memory,
            colliders,
            poses,
            begin,
            partners,
            placement,
            scratch,
            touches,
            replaced,
            ..
        } = self;
        replaced.excluded.extend_from_slice(&misplaced);
        replaced.substitutes.retain(|contact| !has_plane_of(&misplaced, contact));
        let mut done = Vec::new();
        for contact in &misplaced {
            // Each pair of pieces is examined once.
            let Some(sides) = partners.colliders_of(contact) else { continue };
            let numbers = sides.map(|(number, _)| number);
            let is_pair = |pair: [usize; 2]| pair == numbers || [pair[1], pair[0]] == numbers;
            let Some(pair) = memory.pairs.iter_mut().find(|pair| is_pair(pair.colliders)) else {
                continue;
            };
            if done.contains(&pair.colliders) {
                continue;
            }
            done.push(pair.colliders);
            let [a, b] = pair.colliders.map(|at| colliders.at(at));
            let both = [a, b].map(|collider| placed(world, poses, collider));
            let smaller = size(both[0].0).min(size(both[1].0));
            let hint = &mut pair.hint;
            // Nearest points at the end of the step. The pieces may be apart there.
            let distance = signed_distance(both[0], both[1], hint, scratch).distance.max(0.0);
            let reach = BAND * smaller + distance;
            let plane_of = plane_of(world, states, begin, a, b);
            let search = ContactSearch { reach, within: reach, plane_of, with_hidden: false };
            let exposure = Exposure { world, partners, colliders: [a, b], numbers: pair.colliders };
            let workspace = (&mut *scratch, &mut placement.exposure);
            exposure.contact_points(poses, &[begin, poses], search, hint, workspace, touches);
            let between =
                ContactBuilder { world, colliders: [a, b], at: poses, start: begin, states };
            // A substitute does not begin below a surface.
            let found = touches.iter().filter_map(|touch| between.contact(touch, 0));
            let found = found.filter(|contact| contact.gap >= -SAME_GAP * smaller);
            replaced.substitutes.extend(found);
        }
    }

    /// Replaces contacts in a list of those that touch.
    pub(crate) fn put_replaced(&mut self, world: &World, contacts: &mut Vec<Contact>) {
        let Self { replaced, index, .. } = self;
        contacts.retain(|contact| !has_plane_of(&replaced.excluded, contact));
        if !replaced.has_substitutes {
            return;
        }
        index.clear();
        for contact in &replaced.substitutes {
            if let Some(plane) = unknown_plane(world, contact, contacts, index) {
                let mut contact = *contact;
                contact.key.pair.iter_mut().for_each(|pair| pair.plane = plane);
                contacts.push(contact);
            }
        }
    }
}
