//! Coefficients of contact laws: of the world, of owners and of pairs.

use super::laws::{PairLaws, find_place, ordered, set};
use super::{Coefficient, Partner, World};
use crate::error::{Error, in_range};
use crate::mechanics::RigidBody;

impl World {
    /// Returns this world with a coefficient for the ground, and for bodies and fixed colliders without
    /// their own.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is outside 0…10 or, for an adhesion, 0…10⁹ N, or if a static one is below
    /// the world's coefficient of friction.
    pub fn with_coefficient(mut self, of: Coefficient, value: f64) -> Result<Self, Error> {
        let value = checked(of, value, self.friction())?;
        self.coefficients_mut(of).of_world = Some(value);
        Ok(self)
    }

    /// Returns this world with the coefficient of a body or a fixed collider.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is outside 0…10 or, for an adhesion, 0…10⁹ N, or if a static one is below
    /// the owner's coefficient of friction; [`Error::Count`] if the owner does not exist or is the ground.
    pub fn with_coefficient_of(
        mut self,
        of: Coefficient,
        owner: Partner,
        value: f64,
    ) -> Result<Self, Error> {
        self.check_owner("owner of a coefficient", owner)?;
        let value = checked(of, value, self.own_friction(owner).unwrap_or(self.friction()))?;
        set(&mut self.coefficients_mut(of).of_owners, owner, value);
        Ok(self)
    }

    /// Returns this world with the coefficient of the pair of `body` and `partner`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is outside 0…10 or, for an adhesion, 0…10⁹ N, or if a static one is below
    /// the pair's coefficient of friction; those of [`World::with_friction_between`].
    pub fn with_coefficient_between(
        mut self,
        of: Coefficient,
        body: usize,
        partner: Partner,
        value: f64,
    ) -> Result<Self, Error> {
        self.check_pair("pair with a coefficient", body, partner)?;
        let value = checked(of, value, self.friction_between(body, partner))?;
        set(&mut self.coefficients_mut(of).of_pairs, ordered(body, partner), value);
        Ok(self)
    }

    /// Owner, or pair, of the number at `index` of [`Constant::Coefficient`](super::Constant::Coefficient);
    /// `None` for the world's.
    pub fn coefficient_owner(
        &self,
        of: Coefficient,
        index: usize,
    ) -> Option<(Partner, Option<Partner>)> {
        self.coefficients(of)?.owner(index)
    }

    /// `None` if the world has no coefficients of any law.
    #[inline]
    pub(super) fn coefficients(&self, of: Coefficient) -> Option<&Coefficients> {
        self.coefficients.as_ref().map(|all| &all[of as usize])
    }

    /// True if the world, an owner or a pair has a coefficient.
    #[inline]
    pub(super) fn has(&self, of: Coefficient) -> bool {
        self.coefficients(of).is_some_and(|all| all.len() > 0)
    }

    fn coefficients_mut(&mut self, of: Coefficient) -> &mut Coefficients {
        &mut self.coefficients.get_or_insert_default()[of as usize]
    }

    /// Sets the values of [`Constant::Coefficient`](super::Constant::Coefficient).
    pub(super) fn set_coefficients(
        &mut self,
        of: Coefficient,
        numbers: &[f64],
    ) -> Result<(), Error> {
        let Some(all) = &mut self.coefficients else { return Ok(()) };
        for (own, number) in all[of as usize].values_mut().zip(numbers) {
            *own = checked(of, *number, 0.0)?;
        }
        Ok(())
    }

    /// Own coefficient of friction of a body or fixed collider.
    fn own_friction(&self, owner: Partner) -> Option<f64> {
        match owner {
            Partner::Ground => None,
            Partner::Fixed(index) => self.fixed_friction(index),
            Partner::Body(index) => self.bodies().get(index).and_then(RigidBody::friction),
        }
    }
}

/// Checks a coefficient. `kinetic` is the coefficient of friction of the same owner or pair.
fn checked(of: Coefficient, value: f64, kinetic: f64) -> Result<f64, Error> {
    if of == Coefficient::StaticFriction && kinetic > 0.0 {
        return in_range(of.quantity(), value, kinetic, 10.0, "the coefficient of friction to 10");
    }
    let allowed = if of == Coefficient::Adhesion { "0 to 1e9" } else { "0 to 10" };
    in_range(of.quantity(), value, 0.0, of.largest(), allowed)
}

/// Coefficients of all laws, in the order of [`Coefficient::ALL`].
pub(super) type LawCoefficients = [Coefficients; Coefficient::ALL.len()];

/// Coefficients of one law: of the world, of bodies and fixed colliders, and of pairs. Their numbers are indexed in
/// this order.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Coefficients {
    of_world: Option<f64>,
    /// Bodies and fixed colliders with their own coefficient, sorted.
    of_owners: Vec<(Partner, f64)>,
    of_pairs: PairLaws,
}

impl Coefficients {
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
