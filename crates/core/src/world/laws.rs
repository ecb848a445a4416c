//! Contact laws: coefficients of the world, of bodies and of pairs.

use super::World;
use crate::error::{Error, in_range};
use crate::mechanics::RigidBody;
use crate::partner::{ContactLaw, Partner};

impl World {
    /// Returns this world with the coefficient `friction` for the pair of `body` and `partner`. It
    /// overrides their own coefficients. The last call for a pair counts.
    ///
    /// # Errors
    /// If the body or partner does not exist, if both are the same body, or if the coefficient is
    /// outside 0…10.
    pub fn with_friction_between(
        mut self,
        body: usize,
        partner: Partner,
        friction: f64,
    ) -> Result<Self, Error> {
        in_range("coefficient of friction", friction, 0.0, 10.0, "0 to 10")?;
        self.check_pair("pair with friction", body, partner)?;
        set(&mut self.pair_frictions, ordered(body, partner), friction);
        Ok(self)
    }

    /// Returns this world with the default coefficient `restitution`. Bodies and pairs with their
    /// own coefficient keep it.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the coefficient is outside 0…1.
    pub fn with_restitution(self, restitution: f64) -> Result<Self, Error> {
        in_range("coefficient of restitution", restitution, 0.0, 1.0, "0 to 1")?;
        Ok(Self { restitution, ..self })
    }

    /// Returns this world with the coefficient `restitution` for the pair of `body` and `partner`.
    /// It overrides their own coefficients. The last call for a pair counts.
    ///
    /// # Errors
    /// If the body or partner does not exist, if both are the same body, or if the coefficient is
    /// outside 0…1.
    pub fn with_restitution_between(
        mut self,
        body: usize,
        partner: Partner,
        restitution: f64,
    ) -> Result<Self, Error> {
        in_range("coefficient of restitution", restitution, 0.0, 1.0, "0 to 1")?;
        self.check_pair("pair with restitution", body, partner)?;
        set(&mut self.pair_restitutions, ordered(body, partner), restitution);
        Ok(self)
    }

    /// Returns this world with `speed` (m/s) instead of the default [rebound
    /// speed](World::rebound_speed).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the speed is outside 0…1000 m/s.
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
            Partner::Fixed(index) => index < self.fixed_count(),
            Partner::Body(other) => other < bodies && other != body,
        };
        if body < bodies && known {
            return Ok(());
        }
        let allowed = "a body and another body or fixed piece of the world";
        Err(Error::Count { field, count: body, allowed })
    }

    /// Refuses the ground and owners that do not exist.
    pub(super) fn check_owner(&self, field: &'static str, owner: Partner) -> Result<(), Error> {
        let (known, count) = match owner {
            Partner::Ground => (false, 0),
            Partner::Fixed(index) => (index < self.fixed_count(), index),
            Partner::Body(index) => (index < self.bodies().len(), index),
        };
        let allowed = "an index of a body or fixed collider";
        if known { Ok(()) } else { Err(Error::Count { field, count, allowed }) }
    }

    /// Friction coefficients of pairs.
    pub fn pair_frictions(&self) -> &[((usize, Partner), f64)] {
        &self.pair_frictions
    }

    /// Friction coefficient μ between `body` and `partner`: the pair's own, or the geometric mean
    ///
    /// ```text
    /// μ = √(μ_a μ_b)
    /// ```
    ///
    /// of both coefficients. The default of the world applies to the ground, and to bodies and
    /// pieces without their own coefficient.
    ///
    /// # Panics
    /// If the body or partner does not exist.
    pub fn friction_between(&self, body: usize, partner: Partner) -> f64 {
        if let Some(friction) = find_pair(&self.pair_frictions, body, partner) {
            return friction;
        }
        let own = |friction: Option<f64>| friction.unwrap_or(self.friction());
        let a = own(self.bodies()[body].friction());
        let b = match partner {
            Partner::Ground => self.friction(),
            Partner::Fixed(index) => own(self.fixed_friction(index)),
            Partner::Body(other) => own(self.bodies()[other].friction()),
        };
        if a == b { a } else { (a * b).sqrt() }
    }

    /// Restitution coefficient e between `body` and `partner`: the pair's own, or the geometric
    /// mean of both coefficients. The default of the world applies to the ground, to fixed pieces,
    /// and to bodies without their own coefficient.
    ///
    /// # Panics
    /// If the body or partner does not exist.
    pub fn restitution_between(&self, body: usize, partner: Partner) -> f64 {
        if let Some(restitution) = find_pair(&self.pair_restitutions, body, partner) {
            return restitution;
        }
        let own = |body: usize| self.bodies()[body].restitution().unwrap_or(self.restitution);
        let a = own(body);
        let b = partner.body().map_or(self.restitution, own);
        if a == b { a } else { (a * b).sqrt() }
    }

    /// Contact law between `body` and `partner`.
    ///
    /// # Panics
    /// If the body or partner does not exist.
    pub fn law_between(&self, body: usize, partner: Partner) -> ContactLaw {
        ContactLaw {
            friction: self.friction_between(body, partner),
            static_friction: self.static_friction_between(body, partner),
            restitution: self.restitution_between(body, partner),
            adhesion: 0.0,
        }
    }

    /// Default coefficient of restitution e; 0 unless set.
    pub fn restitution(&self) -> f64 {
        self.restitution
    }

    /// Restitution coefficients of pairs.
    pub fn pair_restitutions(&self) -> &[((usize, Partner), f64)] {
        &self.pair_restitutions
    }

    /// True if any coefficient of restitution is positive.
    pub fn has_restitution(&self) -> bool {
        let pairs = self.pair_restitutions.iter().map(|(_, restitution)| *restitution);
        let bodies = self.bodies().iter().filter_map(RigidBody::restitution);
        self.restitution > 0.0 || pairs.chain(bodies).any(|restitution| restitution > 0.0)
    }

    /// Approach speed below which a contact does not bounce (m/s). The default is
    ///
    /// ```text
    /// 2 |g| h,
    /// ```
    ///
    /// the speed of a bounce that lasts less than four steps. It vanishes with h.
    pub fn rebound_speed(&self) -> f64 {
        self.rebound_speed.unwrap_or_else(|| 2.0 * self.gravity().norm() * self.whole_step())
    }
}

/// Coefficients of pairs, sorted by pair.
pub(super) type PairLaws = Vec<((usize, Partner), f64)>;

/// Sets the value of `key` in a sorted list.
pub(super) fn set<K: Ord>(list: &mut Vec<(K, f64)>, key: K, value: f64) {
    match list.binary_search_by(|(known, _)| known.cmp(&key)) {
        Ok(place) => list[place].1 = value,
        Err(place) => list.insert(place, (key, value)),
    }
}

pub(super) fn find_pair(pairs: &PairLaws, body: usize, partner: Partner) -> Option<f64> {
    find_place(pairs, body, partner).map(|place| pairs[place].1)
}

/// Index of a pair in `pairs`, if it has a coefficient.
#[inline]
pub(super) fn find_place(pairs: &PairLaws, body: usize, partner: Partner) -> Option<usize> {
    if pairs.is_empty() {
        return None;
    }
    let pair = ordered(body, partner);
    pairs.binary_search_by(|(known, _)| known.cmp(&pair)).ok()
}

/// Canonical order of a pair: the body with the smaller index comes first.
pub(crate) fn ordered(body: usize, partner: Partner) -> (usize, Partner) {
    match partner {
        Partner::Body(other) if other < body => (other, Partner::Body(body)),
        _ => (body, partner),
    }
}
