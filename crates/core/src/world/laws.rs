//! The laws of contact between the bodies and what they touch: those of the world, of bodies, and of pairs.

use super::World;
use super::partner::{ContactLaw, Partner};
use crate::error::{Error, in_range};
use crate::mechanics::RigidBody;

impl World {
    /// This world with a coefficient of `friction` between body `body` and `partner`, whatever
    /// their own are. The last word on a pair counts.
    ///
    /// # Errors
    /// A body or fixed piece that is not there, a body with itself, a coefficient outside 0…10.
    pub fn with_friction_between(
        mut self,
        body: usize,
        partner: Partner,
        friction: f64,
    ) -> Result<Self, Error> {
        in_range("coefficient of friction", friction, 0.0, 10.0, "0 to 10")?;
        self.check_pair("pair with friction", body, partner)?;
        set_pair(&mut self.pair_frictions, body, partner, friction);
        Ok(self)
    }

    /// This world with a coefficient of `restitution`, of everything that has none of its own.
    ///
    /// # Errors
    /// A coefficient outside 0…1.
    pub fn with_restitution(self, restitution: f64) -> Result<Self, Error> {
        in_range("coefficient of restitution", restitution, 0.0, 1.0, "0 to 1")?;
        Ok(Self { restitution, ..self })
    }

    /// This world with a coefficient of `restitution` between body `body` and `partner`, as
    /// [`World::with_friction_between`].
    ///
    /// # Errors
    /// A body or fixed piece that is not there, a body with itself, a coefficient outside 0…1.
    pub fn with_restitution_between(
        mut self,
        body: usize,
        partner: Partner,
        restitution: f64,
    ) -> Result<Self, Error> {
        in_range("coefficient of restitution", restitution, 0.0, 1.0, "0 to 1")?;
        self.check_pair("pair with restitution", body, partner)?;
        set_pair(&mut self.pair_restitutions, body, partner, restitution);
        Ok(self)
    }

    /// This world with `speed` (m/s) in place of the usual [rebound speed](World::rebound_speed).
    ///
    /// # Errors
    /// A speed outside 0…1000 m/s.
    pub fn with_rebound_speed(self, speed: f64) -> Result<Self, Error> {
        in_range("rebound speed (m/s)", speed, 0.0, 1000.0, "0 to 1000")?;
        Ok(Self { rebound_speed: Some(speed), ..self })
    }

    pub(super) fn check_pair(
        &self,
        field: &'static str,
        body: usize,
        partner: Partner,
    ) -> Result<(), Error> {
        let bodies = self.bodies().len();
        let known = match partner {
            Partner::Ground => self.ground().is_some(),
            Partner::Fixed(index) => index < self.fixed.len(),
            Partner::Body(other) => other < bodies && other != body,
        };
        if body < bodies && known {
            return Ok(());
        }
        let allowed = "a pair of a body and another body or a fixed thing of the world";
        Err(Error::Count { field, count: body, allowed })
    }

    /// The coefficients of friction that were given for pairs.
    #[must_use]
    pub fn pair_frictions(&self) -> &[((usize, Partner), f64)] {
        &self.pair_frictions
    }

    /// μ between body `body` and `partner`: what was given for the pair, or the geometric mean
    ///
    /// ```text
    /// μ = √(μ_a μ_b)
    /// ```
    ///
    /// of the coefficients of both, the world's where a body or piece has none of its own. The
    /// ground has the world's.
    ///
    /// # Panics
    /// If there is no such body or partner.
    #[must_use]
    pub fn friction_between(&self, body: usize, partner: Partner) -> f64 {
        if let Some(friction) = find_pair(&self.pair_frictions, body, partner) {
            return friction;
        }
        let own = |friction: Option<f64>| friction.unwrap_or(self.friction());
        let a = own(self.bodies()[body].friction());
        let b = match partner {
            Partner::Ground => self.friction(),
            Partner::Fixed(index) => own(self.fixed[index].friction),
            Partner::Body(other) => own(self.bodies()[other].friction()),
        };
        if a == b { a } else { (a * b).sqrt() }
    }

    /// e between body `body` and `partner`: what was given for the pair, or the geometric mean of
    /// the coefficients of both, as [`World::friction_between`]. Ground and fixed pieces have the
    /// world's.
    ///
    /// # Panics
    /// If there is no such body or partner.
    #[must_use]
    pub fn restitution_between(&self, body: usize, partner: Partner) -> f64 {
        if let Some(restitution) = find_pair(&self.pair_restitutions, body, partner) {
            return restitution;
        }
        let own = |body: usize| self.bodies()[body].restitution().unwrap_or(self.restitution);
        let a = own(body);
        let b = partner.body().map_or(self.restitution, own);
        if a == b { a } else { (a * b).sqrt() }
    }

    /// The law of contact between body `body` and `partner`.
    ///
    /// # Panics
    /// If there is no such body or partner.
    #[must_use]
    pub fn law_between(&self, body: usize, partner: Partner) -> ContactLaw {
        ContactLaw {
            friction: self.friction_between(body, partner),
            restitution: self.restitution_between(body, partner),
        }
    }

    /// e of everything that has none of its own; 0 unless it was given.
    #[must_use]
    pub fn restitution(&self) -> f64 {
        self.restitution
    }

    /// The coefficients of restitution that were given for pairs.
    #[must_use]
    pub fn pair_restitutions(&self) -> &[((usize, Partner), f64)] {
        &self.pair_restitutions
    }

    /// Whether anything bounces.
    #[must_use]
    pub fn has_restitution(&self) -> bool {
        let pairs = self.pair_restitutions.iter().map(|(_, restitution)| *restitution);
        let bodies = self.bodies().iter().filter_map(RigidBody::restitution);
        self.restitution > 0.0 || pairs.chain(bodies).any(|restitution| restitution > 0.0)
    }

    /// The speed, m/s, below which a contact that arrives does not bounce: what was given, or
    ///
    /// ```text
    /// 2 |g| h,
    /// ```
    ///
    /// below which a bounce would be over within four steps. It vanishes with h.
    #[must_use]
    pub fn rebound_speed(&self) -> f64 {
        self.rebound_speed.unwrap_or_else(|| 2.0 * self.gravity().norm() * self.time_step())
    }

    /// The rebound speed that was given, m/s, if one was.
    #[must_use]
    pub fn given_rebound_speed(&self) -> Option<f64> {
        self.rebound_speed
    }
}

/// Coefficients that were given for pairs, in ascending order of the pairs.
pub(super) type PairLaws = Vec<((usize, Partner), f64)>;

pub(super) fn set_pair(pairs: &mut PairLaws, body: usize, partner: Partner, value: f64) {
    let pair = ordered(body, partner);
    match pairs.binary_search_by(|(known, _)| known.cmp(&pair)) {
        Ok(place) => pairs[place].1 = value,
        Err(place) => pairs.insert(place, (pair, value)),
    }
}

pub(super) fn find_pair(pairs: &PairLaws, body: usize, partner: Partner) -> Option<f64> {
    find_place(pairs, body, partner).map(|place| pairs[place].1)
}

/// Where a pair stands among those that were given a coefficient.
#[inline]
pub(super) fn find_place(pairs: &PairLaws, body: usize, partner: Partner) -> Option<usize> {
    if pairs.is_empty() {
        return None;
    }
    let pair = ordered(body, partner);
    pairs.binary_search_by(|(known, _)| known.cmp(&pair)).ok()
}

/// The same for both orders of a pair.
pub(super) fn ordered(body: usize, partner: Partner) -> (usize, Partner) {
    match partner {
        Partner::Body(other) if other < body => (other, Partner::Body(body)),
        _ => (body, partner),
    }
}
