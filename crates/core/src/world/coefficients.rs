//! Coefficients of contact laws: of the world, of owners and of pairs.
//!
//! A pair has its own number, or the [combination](Coefficient::combined) of both owners' numbers. An owner
//! without its own has the world's.

use super::{Coefficient, Partner, World};
use crate::error::{Error, in_range};
use crate::partner::{ContactLaw, TurningFriction};

/// Coefficients of all laws, in the order of [`Coefficient::ALL`].
pub(super) type LawCoefficients = [Coefficients; Coefficient::ALL.len()];

/// Number of a coefficient, with its index among those of [`Coefficients`].
pub(super) type Indexed = (usize, f64);

/// Coefficients of one law. Their numbers are indexed in the order of the fields, owners in that of
/// [`Partner`]: fixed colliders, then bodies.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Coefficients {
    of_world: Option<f64>,
    /// Bodies and fixed colliders with their own coefficient, sorted.
    of_owners: Vec<(Partner, f64)>,
    /// Pairs with their own coefficient, sorted.
    of_pairs: Vec<((usize, Partner), f64)>,
}

impl World {
    /// Returns this world with a coefficient for the ground, and for bodies and fixed colliders without
    /// their own.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is above [`Coefficient::largest`] or negative, or if a static one is below
    /// the world's coefficient of friction.
    pub fn with_coefficient(mut self, law: Coefficient, value: f64) -> Result<Self, Error> {
        let value = checked(law, value, self.friction())?;
        self.coefficients[law as usize].of_world = Some(value);
        self.parameters.friction = self.friction();
        Ok(self)
    }

    /// Returns this world with the coefficient of a body or a fixed collider.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is above [`Coefficient::largest`] or negative, or if a static one is below
    /// the owner's coefficient of friction; [`Error::Count`] if the owner does not exist or is the ground.
    pub fn with_coefficient_of(
        mut self,
        law: Coefficient,
        owner: Partner,
        value: f64,
    ) -> Result<Self, Error> {
        self.check_owner("owner of a coefficient", owner)?;
        let kinetic = self.coefficients[Coefficient::Friction as usize].own(owner);
        let value = checked(law, value, kinetic.map_or(self.friction(), |(_, friction)| friction))?;
        set(&mut self.coefficients[law as usize].of_owners, owner, value);
        Ok(self)
    }

    /// Returns this world with the coefficient of the pair of `body` and `partner`. It overrides their own
    /// ones. The last call for a pair counts.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is above [`Coefficient::largest`] or negative, or if a static one is below
    /// the pair's coefficient of friction; [`Error::Count`] if the body or the partner does not exist, or if
    /// both are the same body.
    pub fn with_coefficient_between(
        mut self,
        law: Coefficient,
        body: usize,
        partner: Partner,
        value: f64,
    ) -> Result<Self, Error> {
        self.check_pair("pair with a coefficient", body, partner)?;
        let value = checked(law, value, self.friction_between(body, partner))?;
        set(&mut self.coefficients[law as usize].of_pairs, ordered(body, partner), value);
        Ok(self)
    }

    /// Owner, or pair, of the number at `index` of a [constant of coefficients](super::Constant); `None` for
    /// the world's.
    pub fn coefficient_owner(
        &self,
        constant: super::Constant,
        index: usize,
    ) -> Option<(Partner, Option<Partner>)> {
        let (law, range) = constant.numbers(self)?;
        self.coefficients(law).owner(range.start + index)
    }

    #[inline]
    pub(super) fn coefficients(&self, law: Coefficient) -> &Coefficients {
        &self.coefficients[law as usize]
    }

    /// True if the world, an owner or a pair has a coefficient.
    #[inline]
    pub(super) fn has(&self, law: Coefficient) -> bool {
        self.coefficients(law).len() > 0
    }

    /// Numbers of both owners; twice that of the pair, if it has its own.
    #[inline]
    pub(super) fn numbers_between(
        &self,
        law: Coefficient,
        body: usize,
        partner: Partner,
    ) -> [Option<Indexed>; 2] {
        let all = self.coefficients(law);
        match all.between(body, partner) {
            None => [Partner::Body(body), partner].map(|owner| all.own(owner).or(all.world())),
            pair => [pair; 2],
        }
    }

    /// Coefficient of a pair; 0 if there is none.
    #[inline]
    fn coefficient_between(&self, law: Coefficient, body: usize, partner: Partner) -> f64 {
        let Coefficients { of_world, of_owners, of_pairs } = self.coefficients(law);
        if of_owners.is_empty() && of_pairs.is_empty() {
            let number = of_world.unwrap_or(0.0);
            return law.combined(number, number);
        }
        let number = |number: Option<Indexed>| number.map_or(0.0, |(_, value)| value);
        let [a, b] = self.numbers_between(law, body, partner).map(number);
        law.combined(a, b)
    }

    /// Number of the pair, or the larger one of both, and its index; `None` if there is none.
    pub(crate) fn larger_between(
        &self,
        law: Coefficient,
        body: usize,
        partner: Partner,
    ) -> Option<Indexed> {
        let both = self.numbers_between(law, body, partner).into_iter().flatten();
        both.reduce(|a, b| if b.1 > a.1 { b } else { a })
    }

    /// Coefficient of friction μ between `body` and `partner`.
    #[inline]
    pub fn friction_between(&self, body: usize, partner: Partner) -> f64 {
        self.coefficient_between(Coefficient::Friction, body, partner)
    }

    /// Coefficient of restitution e between `body` and `partner`.
    #[inline]
    pub fn restitution_between(&self, body: usize, partner: Partner) -> f64 {
        self.coefficient_between(Coefficient::Restitution, body, partner)
    }

    /// Coefficients of turning friction between `body` and `partner`.
    #[inline]
    pub fn turning_friction_between(&self, body: usize, partner: Partner) -> TurningFriction {
        if !self.has_turning_friction() {
            return TurningFriction::NONE;
        }
        let law = |turning| self.coefficient_between(turning, body, partner);
        TurningFriction {
            rolling: law(Coefficient::RollingFriction),
            torsional: law(Coefficient::TorsionalFriction),
        }
    }

    /// Contact law between `body` and `partner`.
    pub fn law_between(&self, body: usize, partner: Partner) -> ContactLaw {
        ContactLaw {
            friction: self.friction_between(body, partner),
            static_friction: self.static_friction_between(body, partner),
            restitution: self.restitution_between(body, partner),
            adhesion: 0.0,
        }
    }

    /// Default coefficient of friction μ.
    pub fn friction(&self) -> f64 {
        self.coefficients(Coefficient::Friction).of_world.unwrap_or(0.0)
    }

    /// Default coefficient of restitution e; 0 unless set.
    pub fn restitution(&self) -> f64 {
        self.coefficients(Coefficient::Restitution).of_world.unwrap_or(0.0)
    }

    /// True if any coefficient of restitution is positive.
    pub fn has_restitution(&self) -> bool {
        self.coefficients(Coefficient::Restitution).values().any(|restitution| restitution > 0.0)
    }

    /// True if any coefficient of turning friction is set.
    #[inline]
    pub fn has_turning_friction(&self) -> bool {
        self.has(Coefficient::RollingFriction) || self.has(Coefficient::TorsionalFriction)
    }

    /// True if an adhesion is set.
    #[inline]
    pub fn has_adhesion(&self) -> bool {
        self.has(Coefficient::Adhesion)
    }

    /// Own coefficients of a body or fixed collider.
    pub fn coefficients_of(&self, owner: Partner) -> Vec<(Coefficient, f64)> {
        let own = |law| Some((law, self.coefficients(law).own(owner)?.1));
        Coefficient::ALL.into_iter().filter_map(own).collect()
    }

    /// Returns this world with `speed` (m/s) instead of the default [rebound
    /// speed](World::rebound_speed).
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if the speed is outside 0…1000 m/s.
    pub fn with_rebound_speed(self, speed: f64) -> Result<Self, Error> {
        in_range("rebound speed (m/s)", speed, 0.0, 1000.0, "0 to 1000")?;
        let mut world = Self { rebound_speed: Some(speed), ..self };
        world.prepare_joints();
        Ok(world)
    }

    /// Approach speed below which a contact or a stop of a joint does not bounce (m/s). The default is
    ///
    /// ```text
    /// 2 |g| h,
    /// ```
    ///
    /// the speed of a bounce that lasts less than four steps. It vanishes with h.
    pub fn rebound_speed(&self) -> f64 {
        self.rebound_speed.unwrap_or_else(|| 2.0 * self.gravity().norm() * self.whole_step())
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
}

/// Checks a coefficient. `kinetic` is the coefficient of friction of the same owner or pair.
pub(super) fn checked(law: Coefficient, value: f64, kinetic: f64) -> Result<f64, Error> {
    if law == Coefficient::StaticFriction && kinetic > 0.0 {
        return in_range(law.quantity(), value, kinetic, 10.0, "the coefficient of friction to 10");
    }
    let allowed = match law {
        Coefficient::Adhesion => "0 to 1e9",
        Coefficient::Restitution => "0 to 1",
        _ => "0 to 10",
    };
    in_range(law.quantity(), value, 0.0, law.largest(), allowed)
}

impl Coefficients {
    /// Coefficients with this one of the world alone.
    pub(super) fn for_world(value: f64) -> Self {
        Self { of_world: Some(value), ..Self::default() }
    }

    /// All numbers.
    pub(super) fn values(&self) -> impl Iterator<Item = f64> + '_ {
        let owners = self.of_owners.iter().map(|(_, value)| value);
        let pairs = self.of_pairs.iter().map(|(_, value)| value);
        self.of_world.iter().chain(owners).chain(pairs).copied()
    }

    pub(super) fn values_mut(&mut self) -> impl Iterator<Item = &mut f64> {
        let Self { of_world, of_owners, of_pairs } = self;
        let owners = of_owners.iter_mut().map(|(_, value)| value);
        of_world.iter_mut().chain(owners).chain(of_pairs.iter_mut().map(|(_, value)| value))
    }

    pub(super) fn len(&self) -> usize {
        self.ends()[3]
    }

    /// Ends of the numbers of the world, of fixed colliders, of bodies and of pairs.
    pub(super) fn ends(&self) -> [usize; 4] {
        let world = usize::from(self.of_world.is_some());
        let fixed = self.of_owners.partition_point(|(owner, _)| *owner < Partner::Body(0));
        let owners = world + self.of_owners.len();
        [world, world + fixed, owners, owners + self.of_pairs.len()]
    }

    /// Number of the world and its index.
    pub(super) fn world(&self) -> Option<Indexed> {
        self.of_world.map(|value| (0, value))
    }

    /// Own number of a body or fixed collider and its index.
    pub(super) fn own(&self, owner: Partner) -> Option<Indexed> {
        let place = self.of_owners.binary_search_by(|(known, _)| known.cmp(&owner)).ok()?;
        Some((usize::from(self.of_world.is_some()) + place, self.of_owners[place].1))
    }

    /// Own number of a pair and its index.
    #[inline]
    pub(super) fn between(&self, body: usize, partner: Partner) -> Option<Indexed> {
        if self.of_pairs.is_empty() {
            return None;
        }
        let pair = ordered(body, partner);
        let place = self.of_pairs.binary_search_by(|(known, _)| known.cmp(&pair)).ok()?;
        let first = usize::from(self.of_world.is_some()) + self.of_owners.len();
        Some((first + place, self.of_pairs[place].1))
    }

    /// True if pairs have their own numbers.
    pub(super) fn has_pairs(&self) -> bool {
        !self.of_pairs.is_empty()
    }

    /// Owner, or pair, of the number at `index`; `None` for the world's.
    fn owner(&self, index: usize) -> Option<(Partner, Option<Partner>)> {
        let index = index.checked_sub(usize::from(self.of_world.is_some()))?;
        match self.of_owners.get(index) {
            Some((owner, _)) => Some((*owner, None)),
            None => {
                let ((body, partner), _) = self.of_pairs.get(index - self.of_owners.len())?;
                Some((Partner::Body(*body), Some(*partner)))
            }
        }
    }

    /// Coefficients of the owners and pairs that `owner` and `pair` keep.
    pub(super) fn renumbered(
        &self,
        owner: impl Fn(Partner) -> Option<Partner>,
        pair: impl Fn(&(usize, Partner)) -> Option<(usize, Partner)>,
    ) -> Self {
        let owners = self.of_owners.iter();
        let of_owners = owners.filter_map(|(law, value)| Some((owner(*law)?, *value))).collect();
        let pairs = self.of_pairs.iter();
        let of_pairs = pairs.filter_map(|(law, value)| Some((pair(law)?, *value))).collect();
        Self { of_world: self.of_world, of_owners, of_pairs }
    }
}

/// Sets the value of `key` in a sorted list.
fn set<K: Ord>(list: &mut Vec<(K, f64)>, key: K, value: f64) {
    match list.binary_search_by(|(known, _)| known.cmp(&key)) {
        Ok(place) => list[place].1 = value,
        Err(place) => list.insert(place, (key, value)),
    }
}

/// Canonical order of a pair: the body with the smaller index comes first.
pub(crate) fn ordered(body: usize, partner: Partner) -> (usize, Partner) {
    match partner {
        Partner::Body(other) if other < body => (other, Partner::Body(body)),
        _ => (body, partner),
    }
}
