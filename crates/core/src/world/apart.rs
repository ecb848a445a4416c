//! Who touches whom.

use super::World;
use super::laws::ordered;
use super::partner::Partner;
use crate::error::Error;

impl World {
    /// This world, in which the body `body` and `partner` do not touch each other. What was said of pairs stays.
    ///
    /// # Errors
    /// A body or fixed piece that is not there, a ground where there is none, a body with itself.
    pub fn with_apart(mut self, body: usize, partner: Partner) -> Result<Self, Error> {
        self.check_pair("pair that does not touch", body, partner)?;
        for pairs in [&mut self.kept_apart, &mut self.apart] {
            insert(pairs, body, partner);
        }
        Ok(self)
    }

    /// This world, in which the body `body` touches nothing.
    ///
    /// # Errors
    /// A body that is not there.
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

    /// The pairs of which [`World::with_apart`] says that they do not touch.
    #[must_use]
    pub fn kept_apart(&self) -> &[(usize, Partner)] {
        &self.kept_apart
    }

    /// Whether the body `body` and `partner` may touch each other: whether both touch anything, no body of them is
    /// held, and neither a joint nor [`World::with_apart`] keeps them from it.
    #[must_use]
    #[inline]
    pub fn may_touch(&self, body: usize, partner: Partner) -> bool {
        let all_do = self.apart.is_empty() && self.untouched.is_empty() && self.held.is_empty();
        all_do || self.is_open(body, partner)
    }

    /// The same where some do not touch.
    #[inline(never)]
    fn is_open(&self, body: usize, partner: Partner) -> bool {
        let is_apart = || self.apart.binary_search(&ordered(body, partner)).is_ok();
        self.touches(body) && partner.body().is_none_or(|body| self.touches(body)) && !is_apart()
    }

    /// What keeps pairs from touching each other: pairs, bodies that touch nothing, and whether each body is held.
    pub(crate) fn separations(&self) -> (&[(usize, Partner)], &[usize], &[bool]) {
        (&self.apart, &self.untouched, &self.held)
    }

    /// Whether the body `body` may touch anything.
    pub(crate) fn touches(&self, body: usize) -> bool {
        !self.is_held(body) && self.untouched.binary_search(&body).is_err()
    }
}

/// Inserts the pair of a body and a partner into pairs in order, unless it is there.
fn insert(pairs: &mut Vec<(usize, Partner)>, body: usize, partner: Partner) {
    let pair = ordered(body, partner);
    if let Err(place) = pairs.binary_search(&pair) {
        pairs.insert(place, pair);
    }
}
