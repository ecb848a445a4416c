//! Which bodies and contacts of a step its program has.

use tumble_core::contact::{Contact, ContactKey};

/// The bodies and contacts that take part, indices of the world and of the candidates, both in
/// ascending order.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct PosedProgram {
    pub(super) bodies: Vec<usize>,
    pub(super) contacts: Vec<usize>,
}

impl PosedProgram {
    /// The candidates of which `takes_part` is true, and their bodies.
    pub(super) fn of(
        candidates: &[Contact],
        mut takes_part: impl FnMut(usize, &Contact) -> bool,
    ) -> Self {
        let taken = candidates.iter().enumerate().filter(|(at, contact)| takes_part(*at, contact));
        let (mut bodies, mut contacts) = (Vec::new(), Vec::new());
        for (index, contact) in taken {
            contacts.push(index);
            bodies.extend(contact.key.bodies());
        }
        bodies.sort_unstable();
        bodies.dedup();
        Self { bodies, contacts }
    }

    pub(super) fn has(&self, index: usize) -> bool {
        self.contacts.binary_search(&index).is_ok()
    }

    /// Which features touch.
    pub(super) fn keys(&self, candidates: &[Contact]) -> Vec<ContactKey> {
        self.contacts.iter().map(|&index| candidates[index].key).collect()
    }
}
