//! Exclusion of contacts between pairs, by bodies, and by collision groups.

use super::ordered;
use super::{GroupMasks, World};
use crate::error::Error;
use crate::partner::Partner;

/// Exclusions of contacts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Separations<'a> {
    /// Pairs, sorted.
    pub pairs: &'a [(usize, Partner)],
    /// Bodies without any contact, sorted.
    pub untouched: &'a [usize],
    /// Held flag of each body; empty if no body is held.
    pub held: &'a [bool],
    /// Collision groups, if any.
    pub groups: Option<&'a GroupMasks>,
}

/// Copy of the exclusions of a world.
#[derive(Debug, Clone, Default)]
pub(crate) struct KnownSeparations {
    pairs: Vec<(usize, Partner)>,
    untouched: Vec<usize>,
    held: Vec<bool>,
    groups: Option<GroupMasks>,
}

impl KnownSeparations {
    /// True if these are the exclusions `other`.
    pub(crate) fn are(&self, other: &Separations<'_>) -> bool {
        let Self { pairs, untouched, held, groups } = self;
        Separations { pairs, untouched, held, groups: groups.as_ref() } == *other
    }

    /// Copies the exclusions `other`.
    pub(crate) fn copy(&mut self, other: &Separations<'_>) {
        let Separations { pairs, untouched, held, groups } = *other;
        pairs.clone_into(&mut self.pairs);
        untouched.clone_into(&mut self.untouched);
        held.clone_into(&mut self.held);
        self.groups = groups.cloned();
    }
}

impl World {
    /// Returns this world with contacts between `body` and `partner` excluded. Coefficients of the
    /// pair stay.
    ///
    /// # Errors
    /// [`Error::Count`] if the body, the fixed piece or the ground does not exist, or if both are
    /// the same body.
    pub fn with_apart(mut self, body: usize, partner: Partner) -> Result<Self, Error> {
        self.check_pair("pair that does not touch", body, partner)?;
        for pairs in [&mut self.kept_apart, &mut self.apart] {
            insert(pairs, body, partner);
        }
        Ok(self)
    }

    /// Returns this world with all contacts of `body` excluded.
    ///
    /// # Errors
    /// [`Error::Count`] if the body does not exist.
    pub fn with_untouched(mut self, body: usize) -> Result<Self, Error> {
        if body >= self.bodies().len() {
            let allowed = "an index of a body";
            return Err(Error::Count { field: "body", count: body, allowed });
        }
        self.untouched.push(body);
        self.untouched.sort_unstable();
        self.untouched.dedup();
        Ok(self)
    }

    /// Pairs excluded with [`World::with_apart`].
    pub fn kept_apart(&self) -> &[(usize, Partner)] {
        &self.kept_apart
    }

    /// True if contacts between `body` and `partner` are considered. Contacts are excluded for held
    /// bodies, by joints, by [`World::with_untouched`], by [`World::with_apart`] and by
    /// [`World::with_groups`].
    #[inline]
    pub fn may_touch(&self, body: usize, partner: Partner) -> bool {
        let all_do = self.apart.is_empty()
            && self.untouched.is_empty()
            && self.held.is_empty()
            && self.groups.is_none();
        all_do || self.is_open(body, partner)
    }

    /// Slow path of [`World::may_touch`] for a world with exclusions.
    #[inline(never)]
    fn is_open(&self, body: usize, partner: Partner) -> bool {
        let is_apart = || self.apart.binary_search(&ordered(body, partner)).is_ok();
        let by_groups = || self.groups.as_ref().is_none_or(|all| all.may_touch(body, partner));
        self.touches(body)
            && partner.body().is_none_or(|body| self.touches(body))
            && by_groups()
            && !is_apart()
    }

    /// All exclusions.
    pub(crate) fn separations(&self) -> Separations<'_> {
        Separations {
            pairs: &self.apart,
            untouched: &self.untouched,
            held: &self.held,
            groups: self.groups.as_deref(),
        }
    }

    /// True if contacts of `body` are considered at all.
    pub(crate) fn touches(&self, body: usize) -> bool {
        !self.is_held(body) && self.untouched.binary_search(&body).is_err()
    }
}

/// Inserts a pair into the sorted list `pairs` unless it is already there.
fn insert(pairs: &mut Vec<(usize, Partner)>, body: usize, partner: Partner) {
    let pair = ordered(body, partner);
    if let Err(place) = pairs.binary_search(&pair) {
        pairs.insert(place, pair);
    }
}
