//! Coefficients of one contact law: of the world, of owners and of pairs.

use super::Partner;
use super::laws::{PairLaws, find_place, ordered, set};

/// Coefficients of the world, of bodies and fixed colliders, and of pairs. Their numbers are indexed in
/// this order.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Coefficients {
    of_world: Option<f64>,
    /// Bodies and fixed colliders with their own coefficient, sorted.
    of_owners: Vec<(Partner, f64)>,
    of_pairs: PairLaws,
}

impl Coefficients {
    pub(super) fn set_of_world(&mut self, value: f64) {
        self.of_world = Some(value);
    }

    pub(super) fn set_of(&mut self, owner: Partner, value: f64) {
        set(&mut self.of_owners, owner, value);
    }

    pub(super) fn set_between(&mut self, body: usize, partner: Partner, value: f64) {
        set(&mut self.of_pairs, ordered(body, partner), value);
    }

    /// All numbers.
    pub(super) fn values(&self) -> impl Iterator<Item = f64> + '_ {
        let owners = self.of_owners.iter().map(|(_, value)| value);
        self.of_world
            .iter()
            .chain(owners)
            .chain(self.of_pairs.iter().map(|(_, value)| value))
            .copied()
    }

    pub(super) fn values_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        let Self { of_world, of_owners, of_pairs } = self;
        let owners = of_owners.iter_mut().map(|(_, value)| value);
        of_world.iter_mut().chain(owners).chain(of_pairs.iter_mut().map(|(_, value)| value))
    }

    pub(super) fn len(&self) -> usize {
        usize::from(self.of_world.is_some()) + self.of_owners.len() + self.of_pairs.len()
    }

    pub(super) fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of the world and its index.
    pub(super) fn world(&self) -> Option<(usize, f64)> {
        self.of_world.map(|value| (0, value))
    }

    /// Own number of a body or fixed collider and its index.
    pub(super) fn own(&self, owner: Partner) -> Option<(usize, f64)> {
        let place = self.of_owners.binary_search_by(|(known, _)| known.cmp(&owner)).ok()?;
        Some((usize::from(self.of_world.is_some()) + place, self.of_owners[place].1))
    }

    /// Own number of a pair and its index.
    pub(super) fn between(&self, body: usize, partner: Partner) -> Option<(usize, f64)> {
        let place = find_place(&self.of_pairs, body, partner)?;
        let first = usize::from(self.of_world.is_some()) + self.of_owners.len();
        Some((first + place, self.of_pairs[place].1))
    }

    /// Owner, or pair, of the number at `index`; `None` for the world's.
    pub(super) fn owner(&self, index: usize) -> Option<(Partner, Option<Partner>)> {
        let index = index.checked_sub(usize::from(self.of_world.is_some()))?;
        match self.of_owners.get(index) {
            Some((owner, _)) => Some((*owner, None)),
            None => {
                let ((body, partner), _) = self.of_pairs.get(index - self.of_owners.len())?;
                Some((Partner::Body(*body), Some(*partner)))
            }
        }
    }

    /// Coefficients of the owners and pairs that `owner` and `pairs` keep.
    pub(super) fn renumbered(
        &self,
        owner: impl Fn(Partner) -> Option<Partner>,
        pairs: impl Fn(&PairLaws) -> PairLaws,
    ) -> Self {
        let owners = self.of_owners.iter();
        let of_owners = owners.filter_map(|(of, value)| Some((owner(*of)?, *value))).collect();
        Self { of_world: self.of_world, of_owners, of_pairs: pairs(&self.of_pairs) }
    }
}
