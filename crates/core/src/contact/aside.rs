//! Contacts of bodies at rest, which steps set aside.
//!
//! While a body rests, its contacts and their forces stay the same to the last bit. A step sets them aside after
//! the first one with the same bodies at rest: it neither detects, solves nor certifies them, and puts them back into
//! its lists in their order. If anything touches one of these bodies, the step is taken again with all contacts.

use super::{Contact, Partner};

/// Contacts that a step sets aside.
#[derive(Debug, Clone, Default)]
pub(crate) struct AsideContacts {
    /// Bodies at rest in the last step with all contacts, and their contacts in the order of the search.
    bodies: Vec<bool>,
    contacts: Vec<Contact>,
    /// True in a step that sets them aside.
    is_active: bool,
    /// True if a body at rest is touched.
    pub(super) is_touched: bool,
    /// For each contact at the start of the step up to the last one set aside, true if it is. `count` of them are.
    order: Vec<bool>,
    count: usize,
}

impl AsideContacts {
    /// Begins a step in which `bodies` rest. Returns true if it sets their contacts aside.
    pub(super) fn begin(&mut self, bodies: &[bool]) -> bool {
        self.is_active = !bodies.is_empty() && self.bodies == bodies;
        self.is_active
    }

    /// Sets nothing aside any more.
    pub(super) fn end(&mut self) {
        self.is_active = false;
    }

    pub(super) fn forget(&mut self) {
        self.end();
        self.bodies.clear();
    }

    /// Keeps the contacts of the `bodies` that rested in a step with these contacts.
    pub(super) fn remember(&mut self, bodies: &[bool], contacts: &[Contact]) {
        if bodies.is_empty() {
            self.bodies.clear();
            return;
        }
        bodies.clone_into(&mut self.bodies);
        self.contacts.clear();
        self.contacts.extend(contacts.iter().filter(|contact| bodies[contact.key.body]));
    }

    /// Flags of the bodies whose contacts are set aside; empty without any.
    #[inline]
    pub(super) fn bodies(&self) -> &[bool] {
        if self.is_active { &self.bodies } else { &[] }
    }

    pub(super) fn begin_search(&mut self) {
        (self.is_touched, self.count) = (false, 0);
        self.order.clear();
    }

    /// Sets the ground contacts of `body` aside, behind the `others`. Returns false if it does not rest.
    #[inline]
    pub(super) fn takes_ground_of(&mut self, body: usize, others: usize) -> bool {
        if self.bodies().get(body) != Some(&true) {
            return false;
        }
        self.take_ground_of(body, others);
        true
    }

    #[cold]
    fn take_ground_of(&mut self, body: usize, others: usize) {
        let is_on_ground =
            |contact: &&Contact| (contact.key.body, contact.key.partner) == (body, Partner::Ground);
        let ground = self.contacts[self.count..].iter().take_while(is_on_ground).count();
        self.take(ground, others);
    }

    /// Sets a contact of two pieces aside, behind the `others`. Returns false if its bodies do not rest, or if it
    /// was another one in the last step.
    #[cold]
    pub(super) fn takes(&mut self, contact: &Contact, others: usize) -> bool {
        let rests = |body: usize| self.bodies().get(body) == Some(&true);
        if !contact.key.bodies().any(rests) {
            return false;
        }
        let is_same = self.contacts.get(self.count).is_some_and(|known| {
            (&known.key, &known.features) == (&contact.key, &contact.features)
        });
        self.is_touched |= !is_same;
        self.take(usize::from(is_same), others);
        is_same
    }

    fn take(&mut self, count: usize, others: usize) {
        self.order.resize(others + self.count, false);
        self.count += count;
        self.order.resize(others + self.count, true);
    }

    /// Ends the search for contacts at the start of a step.
    pub(super) fn end_search(&mut self) {
        self.is_touched |= self.count != self.contacts.len();
    }

    /// Notes new contacts, which touch a body at rest or not.
    #[cold]
    pub(super) fn note(&mut self, new: &[Contact]) {
        let rests = |body: usize| self.bodies().get(body) == Some(&true);
        self.is_touched |= new.iter().any(|contact| contact.key.bodies().any(rests));
    }

    /// Number of contacts set aside.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Puts the contacts set aside back among the `others`, which ends the step for them.
    pub(super) fn put_back(&mut self, others: &mut Vec<Contact>, spare: &mut Vec<Contact>) {
        self.merge(self.contacts.iter(), others, spare);
        self.end();
    }

    /// Puts entries of the contacts set aside back into a list that has one for each of the others.
    pub(super) fn merge<'a, T: Copy + 'a>(
        &self,
        mut aside: impl Iterator<Item = &'a T>,
        list: &mut Vec<T>,
        spare: &mut Vec<T>,
    ) {
        std::mem::swap(list, spare);
        list.clear();
        list.reserve(spare.len() + self.count);
        let mut others = spare.iter();
        for &is_aside in &self.order {
            list.extend(if is_aside { aside.next() } else { others.next() });
        }
        list.extend(others);
    }
}
