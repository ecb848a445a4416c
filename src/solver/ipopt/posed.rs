//! Choice of the contacts in the program, and repeated solves with contacts that were missing.
//!
//! A candidate that moves sideways without force leaves the program without a feasible optimum
//! (docs/formulation.md, section 8). The program therefore poses only the candidates that free
//! flight closes, and clamps the others. If the result penetrates at another candidate, that one is
//! added and the step is solved again. An open contact without force obeys the contact law, posed
//! or not. A step without posed contacts is free flight. The tutorial poses all candidates and
//! solves once.

use tumble_core::contact::{Contact, ContactKey};
use tumble_core::mechanics::State;

/// Indices of the candidates in the program, ascending.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct PosedContacts(Vec<usize>);

impl PosedContacts {
    /// Selects the candidates for which `takes_part` is true.
    pub(super) fn new(
        candidates: &[Contact],
        mut takes_part: impl FnMut(usize, &Contact) -> bool,
    ) -> Self {
        let taken = candidates.iter().enumerate().filter(|(at, contact)| takes_part(*at, contact));
        Self(taken.map(|(at, _)| at).collect())
    }

    /// Indices of the candidates.
    pub(super) fn indices(&self) -> &[usize] {
        &self.0
    }

    /// Contact keys of the selected candidates.
    pub(super) fn keys(&self, candidates: &[Contact]) -> Vec<ContactKey> {
        self.0.iter().map(|&index| candidates[index].key).collect()
    }

    pub(super) fn has(&self, index: usize) -> bool {
        self.0.binary_search(&index).is_ok()
    }
}

/// Gap φ⁺ of a contact at the state `next`, m.
pub(super) fn gap(contact: &Contact, next: &State) -> f64 {
    contact.gap_at(&next.pose(), None)
}
