//! Rolling and torsional resistance: coefficients of the moments of contacts.

use super::coefficients::Coefficients;
use super::{Constant, Partner, World};
use crate::error::{Error, in_range};
use crate::partner::{Turning, TurningFriction};

impl World {
    /// Returns this world with a coefficient of turning friction (m), for the ground and for bodies and
    /// fixed colliders without their own.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is outside 0…10 m.
    pub fn with_turning_friction(mut self, turning: Turning, friction: f64) -> Result<Self, Error> {
        self.turning_mut(turning).set_of_world(checked(turning, friction)?);
        Ok(self)
    }

    /// Returns this world with the coefficient of turning friction (m) of a body or a fixed collider.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is outside 0…10 m; [`Error::Count`] if the owner does not exist or
    /// is the ground.
    pub fn with_turning_friction_of(
        mut self,
        turning: Turning,
        owner: Partner,
        friction: f64,
    ) -> Result<Self, Error> {
        self.check_owner("owner of a turning friction", owner)?;
        self.turning_mut(turning).set_of(owner, checked(turning, friction)?);
        Ok(self)
    }

    /// Returns this world with the coefficient of turning friction (m) of the pair of `body` and `partner`.
    ///
    /// # Errors
    /// [`Error::OutOfRange`] if it is outside 0…10 m; those of [`World::with_friction_between`].
    pub fn with_turning_friction_between(
        mut self,
        turning: Turning,
        body: usize,
        partner: Partner,
        friction: f64,
    ) -> Result<Self, Error> {
        self.check_pair("pair with turning friction", body, partner)?;
        self.turning_mut(turning).set_between(body, partner, checked(turning, friction)?);
        Ok(self)
    }

    /// True if any coefficient of turning friction is set.
    #[must_use]
    #[inline]
    pub fn has_turning_friction(&self) -> bool {
        self.turning.is_some()
    }

    pub(super) fn turning(&self, turning: Turning) -> Option<&Coefficients> {
        self.turning.as_ref().map(|both| &both[turning as usize])
    }

    fn turning_mut(&mut self, turning: Turning) -> &mut Coefficients {
        &mut self.turning.get_or_insert_default()[turning as usize]
    }

    /// Coefficients of turning friction between `body` and `partner`: the pair's own, or the larger one of
    /// both. The world's apply to the ground, and to bodies and colliders without their own.
    #[must_use]
    #[inline]
    pub fn turning_friction_between(&self, body: usize, partner: Partner) -> TurningFriction {
        if self.turning.is_none() {
            return TurningFriction::NONE;
        }
        let of = |turning| self.turning_between(turning, body, partner).map_or(0.0, |(_, own)| own);
        TurningFriction { rolling: of(Turning::Rolling), torsional: of(Turning::Torsional) }
    }

    /// Number that applies between `body` and `partner`, and its index; `None` if there is none.
    pub(crate) fn turning_between(
        &self,
        turning: Turning,
        body: usize,
        partner: Partner,
    ) -> Option<(usize, f64)> {
        let all = self.turning(turning)?;
        all.between(body, partner).or_else(|| {
            let own = |owner| all.own(owner).or(all.world());
            let both = [own(Partner::Body(body)), own(partner)].into_iter().flatten();
            both.reduce(|a, b| if b.1 > a.1 { b } else { a })
        })
    }

    /// Owner, or pair, of the coefficient at `index` of [`Turning::constant`]; `None` for the world's.
    #[must_use]
    pub fn turning_owner(
        &self,
        turning: Turning,
        index: usize,
    ) -> Option<(Partner, Option<Partner>)> {
        self.turning(turning)?.owner(index)
    }

    /// Sets the values of [`Turning::constant`].
    pub(super) fn set_turning_frictions(
        &mut self,
        turning: Turning,
        numbers: &[f64],
    ) -> Result<(), Error> {
        let Some(both) = &mut self.turning else { return Ok(()) };
        for (own, number) in both[turning as usize].values_mut().zip(numbers) {
            *own = checked(turning, *number)?;
        }
        Ok(())
    }
}

impl Turning {
    /// Constant with the coefficients.
    #[must_use]
    pub fn constant(self) -> Constant {
        match self {
            Self::Rolling => Constant::RollingFriction,
            Self::Torsional => Constant::TorsionalFriction,
        }
    }
}

fn checked(turning: Turning, friction: f64) -> Result<f64, Error> {
    let field = match turning {
        Turning::Rolling => "coefficient of rolling friction (m)",
        Turning::Torsional => "coefficient of torsional friction (m)",
    };
    in_range(field, friction, 0.0, 10.0, "0 to 10")
}
