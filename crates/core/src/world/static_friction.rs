//! Static friction: coefficients of contacts that did not slip in the step before.

use super::coefficients::Coefficients;
use super::laws::find_pair;
use super::{Constant, Partner, World};
use crate::error::{Error, in_range};
use crate::mechanics::RigidBody;

/// Slip up to which a contact has its static coefficient, unless another one is set (m/s).
const STICK_SPEED: f64 = 1e-6;

const ABOVE_KINETIC: &str = "the coefficient of friction to 10";

/// Static coefficients of a world.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct StaticFrictions {
    pub(super) coefficients: Coefficients,
    stick_speed: Option<f64>,
}

impl StaticFrictions {
    /// These with other `coefficients`.
    pub(super) fn with(&self, coefficients: Coefficients) -> Self {
        Self { coefficients, ..self.clone() }
    }
}

impl World {
    /// Returns this world with a static coefficient of friction, for the ground and for bodies and pieces
    /// without their own coefficients.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is below the world's coefficient of friction or above 10.
    pub fn with_static_friction(mut self, friction: f64) -> Result<Self, Error> {
        let friction = checked(friction, self.friction())?;
        self.statics.coefficients.set_of_world(friction);
        Ok(self)
    }

    /// Returns this world with the static coefficient of friction of a body or a fixed collider.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is below the owner's coefficient of friction or above 10;
    /// [`Error::Count`] if the owner does not exist or is the ground.
    pub fn with_static_friction_of(mut self, owner: Partner, friction: f64) -> Result<Self, Error> {
        self.check_owner("owner of a static friction", owner)?;
        let kinetic = self.own_friction(owner).unwrap_or(self.friction());
        let friction = checked(friction, kinetic)?;
        self.statics.coefficients.set_of(owner, friction);
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
        self.statics.coefficients.set_between(body, partner, friction);
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
        !self.statics.coefficients.is_empty()
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
        let friction = match self.statics.coefficients.between(body, partner) {
            Some((_, friction)) => friction,
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
        let all = &self.statics.coefficients;
        let constant = |(index, friction)| (Constant::StaticFriction, index, friction);
        let own = all.own(owner).map(constant).or_else(|| self.own_friction_constant(owner));
        let of_world = || all.world().map(constant);
        own.or_else(of_world).unwrap_or((Constant::Friction, 0, self.friction()))
    }

    /// Static coefficient of a pair with its own one, as [`World::own_static`].
    pub(super) fn pair_static(
        &self,
        body: usize,
        partner: Partner,
    ) -> Option<(Constant, usize, f64)> {
        let (index, friction) = self.statics.coefficients.between(body, partner)?;
        Some((Constant::StaticFriction, index, friction))
    }

    /// Owner, or pair, of the static coefficient at `index` of [`Constant::StaticFriction`]; `None` for the
    /// world's.
    #[must_use]
    pub fn static_owner(&self, index: usize) -> Option<(Partner, Option<Partner>)> {
        self.statics.coefficients.owner(index)
    }

    /// Own coefficient of friction of a body or fixed collider.
    fn own_friction(&self, owner: Partner) -> Option<f64> {
        match owner {
            Partner::Ground => None,
            Partner::Fixed(index) => self.fixed_friction(index),
            Partner::Body(index) => self.bodies().get(index).and_then(RigidBody::friction),
        }
    }

    /// Sets the values of [`Constant::StaticFriction`].
    pub(super) fn set_static_frictions(&mut self, numbers: &[f64]) -> Result<(), Error> {
        for (own, number) in self.statics.coefficients.values_mut().zip(numbers) {
            *own = in_range("coefficient of static friction", *number, 0.0, 10.0, "0 to 10")?;
        }
        Ok(())
    }
}

fn checked(friction: f64, kinetic: f64) -> Result<f64, Error> {
    in_range("coefficient of static friction", friction, kinetic, 10.0, ABOVE_KINETIC)
}
