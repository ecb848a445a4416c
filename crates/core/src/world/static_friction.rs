//! Static friction: coefficients of contacts that did not slip in the step before.

use super::coefficients::Coefficients;
use super::laws::find_pair;
use super::{Coefficient, Constant, Partner, World};
use crate::error::{Error, in_range};

/// Slip up to which a contact has its static coefficient, unless another one is set (m/s).
const STICK_SPEED: f64 = 1e-6;

const STATIC: Constant = Constant::Coefficient(Coefficient::StaticFriction);

impl World {
    /// Returns this world with the slip up to which a contact has its static coefficient (m/s), instead of
    /// 10⁻⁶ m/s.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] outside 0…1000 m/s.
    pub fn with_stick_speed(mut self, speed: f64) -> Result<Self, Error> {
        self.stick_speed = Some(in_range("stick speed (m/s)", speed, 0.0, 1000.0, "0 to 1000")?);
        Ok(self)
    }

    /// Slip up to which a contact has its static coefficient (m/s).
    #[must_use]
    pub fn stick_speed(&self) -> f64 {
        self.stick_speed.unwrap_or(STICK_SPEED)
    }

    /// True if any static coefficient is set.
    #[must_use]
    pub fn has_static_friction(&self) -> bool {
        self.has(Coefficient::StaticFriction)
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
        let friction = match self.pair_static(body, partner) {
            Some((.., friction)) => friction,
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
        let all = self.coefficients(Coefficient::StaticFriction);
        let constant = |(index, friction)| (STATIC, index, friction);
        let own = all.and_then(|all| all.own(owner)).map(constant);
        let own = own.or_else(|| self.own_friction_constant(owner));
        let of_world = || all.and_then(Coefficients::world).map(constant);
        own.or_else(of_world).unwrap_or((Constant::Friction, 0, self.friction()))
    }

    /// Static coefficient of a pair with its own one, as [`World::own_static`].
    pub(super) fn pair_static(
        &self,
        body: usize,
        partner: Partner,
    ) -> Option<(Constant, usize, f64)> {
        let all = self.coefficients(Coefficient::StaticFriction)?;
        let (index, friction) = all.between(body, partner)?;
        Some((STATIC, index, friction))
    }
}
