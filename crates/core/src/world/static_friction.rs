//! Static friction: coefficients of contacts that did not slip in the step before.

use super::laws::{PairLaws, find_pair, find_place, set_pair};
use super::{Constant, Partner, World};
use crate::error::{Error, in_range};
use crate::mechanics::RigidBody;

/// Slip up to which a contact has its static coefficient, unless another one is set (m/s).
const STICK_SPEED: f64 = 1e-6;

const ABOVE_KINETIC: &str = "the coefficient of friction to 10";

/// Static coefficients of a world.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct StaticFrictions {
    of_world: Option<f64>,
    /// Bodies and fixed pieces with their own coefficient, sorted.
    of_owners: Vec<(Partner, f64)>,
    of_pairs: PairLaws,
    stick_speed: Option<f64>,
}

impl StaticFrictions {
    /// All coefficients: of the world, of owners, of pairs.
    fn values(&self) -> impl Iterator<Item = &f64> {
        let owners = self.of_owners.iter().map(|(_, friction)| friction);
        self.of_world.iter().chain(owners).chain(self.of_pairs.iter().map(|(_, friction)| friction))
    }

    fn values_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        let Self { of_world, of_owners, of_pairs, .. } = self;
        let owners = of_owners.iter_mut().map(|(_, friction)| friction);
        of_world.iter_mut().chain(owners).chain(of_pairs.iter_mut().map(|(_, friction)| friction))
    }

    /// Coefficients of the owners and pairs that `renumbered` keeps.
    pub(super) fn renumbered(
        &self,
        owner: impl Fn(Partner) -> Option<Partner>,
        pairs: impl Fn(&PairLaws) -> PairLaws,
    ) -> Self {
        let owners = self.of_owners.iter();
        let of_owners = owners.filter_map(|(of, friction)| Some((owner(*of)?, *friction)));
        Self { of_owners: of_owners.collect(), of_pairs: pairs(&self.of_pairs), ..self.clone() }
    }
}

impl World {
    /// Returns this world with a static coefficient of friction, for the ground and for bodies and pieces
    /// without their own coefficients.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is below the world's coefficient of friction or above 10.
    pub fn with_static_friction(mut self, friction: f64) -> Result<Self, Error> {
        self.statics.of_world = Some(checked(friction, self.friction())?);
        Ok(self)
    }

    /// Returns this world with the static coefficient of friction of a body or a fixed collider.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is below the owner's coefficient of friction or above 10;
    /// [`Error::Count`] if the owner does not exist or is the ground.
    pub fn with_static_friction_of(mut self, owner: Partner, friction: f64) -> Result<Self, Error> {
        let (known, count) = match owner {
            Partner::Ground => (false, 0),
            Partner::Fixed(index) => (index < self.fixed_count(), index),
            Partner::Body(index) => (index < self.bodies().len(), index),
        };
        if !known {
            let allowed = "an index of a body or fixed collider";
            return Err(Error::Count { field: "owner of a static friction", count, allowed });
        }
        let kinetic = self.own_friction(owner).unwrap_or(self.friction());
        let friction = checked(friction, kinetic)?;
        let owners = &mut self.statics.of_owners;
        match owners.binary_search_by(|(known, _)| known.cmp(&owner)) {
            Ok(place) => owners[place].1 = friction,
            Err(place) => owners.insert(place, (owner, friction)),
        }
        Ok(self)
    }

    /// Returns this world with the static coefficient of friction of the pair of `body` and `partner`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is below the pair's coefficient of friction or above 10; those of
    /// [`World::with_friction_between`].
    pub fn with_static_friction_between(
        mut self,
        body: usize,
        partner: Partner,
        friction: f64,
    ) -> Result<Self, Error> {
        self.check_pair("pair with static friction", body, partner)?;
        let kinetic = self.friction_between(body, partner);
        let field = "static coefficient of a pair";
        let friction = in_range(field, friction, kinetic, 10.0, ABOVE_KINETIC)?;
        set_pair(&mut self.statics.of_pairs, body, partner, friction);
        Ok(self)
    }

    /// Returns this world with the slip up to which a contact has its static coefficient (m/s), instead of
    /// 10⁻⁶ m/s.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] outside 0…1000 m/s.
    pub fn with_stick_speed(mut self, speed: f64) -> Result<Self, Error> {
        self.statics.stick_speed =
            Some(in_range("stick speed (m/s)", speed, 0.0, 1000.0, "0 to 1000")?);
        Ok(self)
    }

    /// Slip up to which a contact has its static coefficient (m/s).
    #[must_use]
    pub fn stick_speed(&self) -> f64 {
        self.statics.stick_speed.unwrap_or(STICK_SPEED)
    }

    /// True if any static coefficient is set.
    #[must_use]
    pub fn has_static_friction(&self) -> bool {
        self.statics.values().next().is_some()
    }

    /// Static coefficient of friction between `body` and `partner` if it is above the kinetic one: the pair's
    /// own, or the geometric mean of both. A body or piece without a static coefficient has its own
    /// coefficient of friction, then the world's static one, then the world's.
    ///
    /// # Panics
    /// If the body or partner does not exist.
    #[must_use]
    pub fn static_friction_between(&self, body: usize, partner: Partner) -> Option<f64> {
        if !self.has_static_friction() {
            return None;
        }
        let kinetic = self.friction_between(body, partner);
        let friction = match find_pair(&self.statics.of_pairs, body, partner) {
            Some(friction) => friction,
            None if find_pair(&self.pair_frictions, body, partner).is_some() => kinetic,
            None => {
                let [a, b] = [Partner::Body(body), partner].map(|owner| self.own_static(owner).2);
                if a == b { a } else { (a * b).sqrt() }
            }
        };
        (friction > kinetic).then_some(friction)
    }

    /// Static coefficient of an owner: its constant, its index in the constant, and its value.
    pub(super) fn own_static(&self, owner: Partner) -> (Constant, usize, f64) {
        let StaticFrictions { of_world, of_owners, .. } = &self.statics;
        if let Ok(place) = of_owners.binary_search_by(|(known, _)| known.cmp(&owner)) {
            let index = usize::from(of_world.is_some()) + place;
            return (Constant::StaticFriction, index, of_owners[place].1);
        }
        match (self.own_friction_constant(owner), of_world) {
            (Some(own), _) => own,
            (None, Some(friction)) => (Constant::StaticFriction, 0, *friction),
            (None, None) => (Constant::Friction, 0, self.friction()),
        }
    }

    /// Static coefficient of a pair with its own one, as [`World::own_static`].
    pub(super) fn pair_static(
        &self,
        body: usize,
        partner: Partner,
    ) -> Option<(Constant, usize, f64)> {
        let StaticFrictions { of_world, of_owners, of_pairs, .. } = &self.statics;
        let place = find_place(of_pairs, body, partner)?;
        let index = usize::from(of_world.is_some()) + of_owners.len() + place;
        Some((Constant::StaticFriction, index, of_pairs[place].1))
    }

    /// Owner, or pair, of the static coefficient at `index` of [`Constant::StaticFriction`]; `None` for the
    /// world's.
    #[must_use]
    pub fn static_owner(&self, index: usize) -> Option<(Partner, Option<Partner>)> {
        let StaticFrictions { of_world, of_owners, of_pairs, .. } = &self.statics;
        let index = index.checked_sub(usize::from(of_world.is_some()))?;
        match of_owners.get(index) {
            Some((owner, _)) => Some((*owner, None)),
            None => {
                let ((body, partner), _) = of_pairs.get(index - of_owners.len())?;
                Some((Partner::Body(*body), Some(*partner)))
            }
        }
    }

    /// Own coefficient of friction of a body or fixed collider.
    fn own_friction(&self, owner: Partner) -> Option<f64> {
        match owner {
            Partner::Ground => None,
            Partner::Fixed(index) => self.fixed_friction(index),
            Partner::Body(index) => self.bodies().get(index).and_then(RigidBody::friction),
        }
    }

    /// Values of [`Constant::StaticFriction`].
    pub(super) fn static_frictions(&self) -> Vec<f64> {
        self.statics.values().copied().collect()
    }

    /// Sets the values of [`Constant::StaticFriction`].
    pub(super) fn set_static_frictions(&mut self, numbers: &[f64]) -> Result<(), Error> {
        for (own, number) in self.statics.values_mut().zip(numbers) {
            *own = in_range("coefficient of static friction", *number, 0.0, 10.0, "0 to 10")?;
        }
        Ok(())
    }
}

fn checked(friction: f64, kinetic: f64) -> Result<f64, Error> {
    in_range("coefficient of static friction", friction, kinetic, 10.0, ABOVE_KINETIC)
}
