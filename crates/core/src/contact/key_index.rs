//! Index of the contacts of a list by their keys.
//!
//! A linear search for every contact has quadratic cost. This index is a hash table with chains:
//! each contact is in the chain of its hash, in the order of the list. Keys are compared exactly,
//! so results equal a search over the list and do not depend on the hash.

use super::{ContactKey, Partner};

/// Marks a missing contact.
const NONE: u32 = u32::MAX;
/// Smallest size of the table.
const FEWEST_SLOTS: usize = 16;

/// Owner and index of a piece; the index of a contact point if the key has no pieces.
pub(super) type KeyEnd = (Partner, usize);

/// Index of the contacts of a list by key, with reusable buffers. It adds contacts at the first
/// query, so a list without queries costs nothing.
///
/// All queries between two calls of [`KeyIndex::clear`] must be about one list, which may grow at
/// its end. Queries about another list may miss contacts, but they never return a wrong key.
#[derive(Debug, Clone, Default)]
pub struct KeyIndex(Chains);

/// Index of the contacts of a list by their two pieces; ground contacts are indexed by their point.
#[derive(Debug, Clone, Default)]
pub(super) struct PieceIndex(Chains);

#[derive(Debug, Clone, Default)]
struct Chains {
    /// First and last contact of each chain. The number of chains is a power of two.
    chains: Vec<(u32, u32)>,
    /// Hash of every indexed contact, and the next one in its chain.
    links: Vec<(u32, u32)>,
}

impl KeyIndex {
    /// An empty index.
    pub fn new() -> Self {
        Self::default()
    }

    /// Clears the index.
    pub fn clear(&mut self) {
        self.0.links.clear();
    }

    /// Reserves space for this number of contacts.
    #[inline]
    pub fn reserve(&mut self, contacts: usize) {
        self.0.reserve(contacts);
    }

    /// Index of the contact `key` in `contacts`.
    ///
    /// The first index to try is `near`, which mostly matches because contacts keep their order
    /// from step to step. Of several matches the result is the first from `near` on, or else the
    /// first.
    #[inline(always)]
    pub fn place<T: AsRef<ContactKey>>(
        &mut self,
        contacts: &[T],
        key: &ContactKey,
        near: usize,
    ) -> Option<usize> {
        match contacts.get(near) {
            Some(contact) if contact.as_ref() == key => Some(near),
            _ => self.place_elsewhere(contacts, key, near),
        }
    }

    #[cold]
    #[inline(never)]
    fn place_elsewhere<T: AsRef<ContactKey>>(
        &mut self,
        contacts: &[T],
        key: &ContactKey,
        near: usize,
    ) -> Option<usize> {
        let mut before = None;
        self.0.list(contacts, hash_of_key);
        for place in
            self.0.chain_of(hash_of_key(key)).filter(|place| contacts[*place].as_ref() == key)
        {
            if place >= near {
                return Some(place);
            }
            before = before.or(Some(place));
        }
        before
    }

    /// Contact `key` in `contacts`, found like [`KeyIndex::place`].
    #[inline(always)]
    pub fn find<'a, T: AsRef<ContactKey>>(
        &mut self,
        contacts: &'a [T],
        key: &ContactKey,
        near: usize,
    ) -> Option<&'a T> {
        match contacts.get(near) {
            Some(contact) if contact.as_ref() == key => Some(contact),
            _ => self.place_elsewhere(contacts, key, near).map(|place| &contacts[place]),
        }
    }
}

impl PieceIndex {
    pub(super) fn clear(&mut self) {
        self.0.links.clear();
    }

    pub(super) fn reserve(&mut self, contacts: usize) {
        self.0.reserve(contacts);
    }

    /// Indices of the contacts between two pieces in either order, ascending in `contacts`.
    /// Contacts of other pieces with the same hash may be among them.
    pub(super) fn between<T: AsRef<ContactKey>>(
        &mut self,
        contacts: &[T],
        ends: [KeyEnd; 2],
    ) -> impl Iterator<Item = usize> + use<'_, T> {
        self.0.list(contacts, |key| hash_of_ends(ends_of(key)));
        self.0.chain_of(hash_of_ends(ends))
    }
}

impl Chains {
    #[inline]
    fn reserve(&mut self, contacts: usize) {
        if contacts > self.chains.len() {
            self.grow(contacts);
        }
    }

    #[cold]
    fn grow(&mut self, contacts: usize) {
        let slots = contacts.next_power_of_two().max(FEWEST_SLOTS);
        self.links.reserve(slots - self.links.len());
        self.chains.resize(slots, (NONE, NONE));
        self.chains.fill((NONE, NONE));
        for place in 0..self.links.len() {
            self.chain(place);
        }
    }

    /// Indices of the contacts in the chain of a hash.
    fn chain_of(&self, hash: u32) -> impl Iterator<Item = usize> {
        let known = |place: u32| (place != NONE).then_some(place as usize);
        // Without links the chains belong to a cleared list.
        let first =
            if self.links.is_empty() { NONE } else { self.chains[slot(hash, self.chains.len())].0 };
        std::iter::successors(known(first), move |place| known(self.links[*place].1))
    }

    /// Adds the contacts that are not indexed yet.
    fn list<T: AsRef<ContactKey>>(&mut self, contacts: &[T], hash: impl Fn(&ContactKey) -> u32) {
        if contacts.len() < self.links.len() {
            self.links.clear();
        }
        if self.links.len() == contacts.len() {
            return;
        }
        if self.links.is_empty() {
            self.chains.fill((NONE, NONE));
        }
        self.reserve(contacts.len());
        for contact in &contacts[self.links.len()..] {
            self.links.push((hash(contact.as_ref()), NONE));
            self.chain(self.links.len() - 1);
        }
    }

    /// Appends an indexed contact to its chain.
    fn chain(&mut self, place: usize) {
        let slots = self.chains.len();
        let (hash, next) = &mut self.links[place];
        *next = NONE;
        let (first, last) = &mut self.chains[slot(*hash, slots)];
        let (before, this) = (*last, place as u32);
        *last = this;
        if before == NONE {
            *first = this;
        } else {
            self.links[before as usize].1 = this;
        }
    }
}

fn slot(hash: u32, slots: usize) -> usize {
    hash as usize & (slots - 1)
}

/// Piece `number` of an owner in the index. The triangles of a terrain are one piece: contacts at the
/// seam of two are compared.
pub(super) fn end_of(owner: Partner, number: usize) -> KeyEnd {
    (owner, if matches!(owner, Partner::Fixed(_)) { 0 } else { number })
}

/// The two pieces of a contact, see [`end_of`].
pub(super) fn ends_of(key: &ContactKey) -> [KeyEnd; 2] {
    let (first, second) = key.pair.map_or((key.point, 0), |pair| pair.pieces);
    [(Partner::Body(key.body), first), end_of(key.partner, second)]
}

fn hash_of_key(key: &ContactKey) -> u32 {
    upper(scattered(sum_of_ends(ends_of(key)).wrapping_add(key.point as u64)))
}

/// Hash of two pieces, equal for both orders.
fn hash_of_ends(ends: [KeyEnd; 2]) -> u32 {
    upper(sum_of_ends(ends))
}

fn sum_of_ends([a, b]: [KeyEnd; 2]) -> u64 {
    let number = |(owner, part): KeyEnd| {
        let owner = match owner {
            Partner::Ground => 0,
            Partner::Fixed(index) => 2 * index as u64 + 1,
            Partner::Body(index) => 2 * index as u64 + 2,
        };
        scattered(scattered(owner).wrapping_add(part as u64))
    };
    number(a).wrapping_add(number(b))
}

fn upper(number: u64) -> u32 {
    (number >> 32) as u32
}

/// Mixes a number so that its upper half depends on all digits. It takes the fractional part of the
/// product with the golden ratio, Knuth's multiplicative hash, and folds in the upper half in
/// between.
fn scattered(number: u64) -> u64 {
    const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;
    let product = number.wrapping_add(1).wrapping_mul(GOLDEN);
    (product ^ (product >> 32)).wrapping_mul(GOLDEN)
}

#[cfg(test)]
#[path = "tests/key_index.rs"]
mod tests;
