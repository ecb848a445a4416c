//! Bodies and contacts in the program of a step.

use tumble_core::contact::{Contact, ContactKey};

/// Indices of the bodies of the world and of the candidates in the program, both ascending.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct PosedProgram {
    pub(super) bodies: Vec<usize>,
    pub(super) contacts: Vec<usize>,
}

impl PosedProgram {
    /// Selects the candidates for which `takes_part` is true, and their bodies.
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

    /// Contact keys of the selected candidates.
    pub(super) fn keys(&self, candidates: &[Contact]) -> Vec<ContactKey> {
        self.contacts.iter().map(|&index| candidates[index].key).collect()
    }
}
