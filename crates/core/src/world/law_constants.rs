//! Constants of contact laws: coefficients of bodies, fixed pieces and pairs.

use super::coefficients::Coefficients;
use super::laws::find_place;
use super::{Coefficient, Constant, Partner, World};
use crate::error::{Error, in_range};
use crate::mechanics::RigidBody;

/// Gradient of a contact coefficient: two entries of constant, index and derivative.
pub(crate) type LawSlopes = [(Constant, usize, f64); 2];

impl World {
    /// Gradients ∂μ, of its kinetic and its static part, and ∂e of the contacts between `body` and `partner`
    /// with respect to their constants, with this [share](crate::contact::Contact::static_share) of the
    /// static coefficient. The gradient of the geometric mean √(a b) is
    ///
    /// ```text
    /// ½ √(b/a) by a,   ½ √(a/b) by b.
    /// ```
    ///
    /// It is 1 if both are the same number, and 0 with respect to a number that is 0.
    pub(crate) fn law_slopes(&self, body: usize, partner: Partner, share: f64) -> [LawSlopes; 3] {
        let owners = [Partner::Body(body), partner];
        let kinetic = match find_place(&self.pair_frictions, body, partner) {
            Some(pair) => [(Constant::PairFriction, pair, 1.0); 2],
            None => {
                let of_world = (Constant::Friction, 0, self.friction());
                owners.map(|owner| self.own_friction_constant(owner).unwrap_or(of_world))
            }
        };
        let of_static = match self.pair_static(body, partner) {
            _ if share == 0.0 => kinetic,
            Some(pair) => [pair; 2],
            None => owners.map(|owner| self.own_static(owner)),
        };
        let restitutions = match find_place(&self.pair_restitutions, body, partner) {
            Some(pair) => [(Constant::PairRestitution, pair, 1.0); 2],
            None => {
                let of_world = (Constant::Restitution, 0, self.restitution);
                let of_body = |index| {
                    let constant = Constant::BodyRestitution;
                    own(self.bodies(), index, RigidBody::restitution, constant)
                };
                let other = partner.body().and_then(of_body);
                [of_body(body).unwrap_or(of_world), other.unwrap_or(of_world)]
            }
        };
        let shared = |of, share: f64| mean_slopes(of).map(|(of, k, slope)| (of, k, share * slope));
        [shared(kinetic, 1.0 - share), shared(of_static, share), mean_slopes(restitutions)]
    }

    /// Own coefficient of friction of a body or fixed collider: its constant, its index in the constant, and
    /// its value.
    pub(super) fn own_friction_constant(&self, owner: Partner) -> Option<(Constant, usize, f64)> {
        match owner {
            Partner::Ground => None,
            Partner::Fixed(index) => {
                let all: Vec<_> = self.fixed_frictions().collect();
                own(&all, index, |friction| *friction, Constant::FixedFriction)
            }
            Partner::Body(index) => {
                own(self.bodies(), index, RigidBody::friction, Constant::BodyFriction)
            }
        }
    }

    /// Sets the coefficients in `given`.
    pub(super) fn set_laws<'a>(
        &mut self,
        given: impl Fn(Constant) -> Option<&'a [f64]>,
    ) -> Result<(), Error> {
        let numbers = |constant| given(constant).unwrap_or(&[]).iter().copied();
        let bodies = &mut self.parameters.bodies;
        let own = bodies.iter_mut().filter(|body| body.friction().is_some());
        for (body, number) in own.zip(numbers(Constant::BodyFriction)) {
            *body = body.clone().with_friction(number)?;
        }
        let own = bodies.iter_mut().filter(|body| body.restitution().is_some());
        for (body, number) in own.zip(numbers(Constant::BodyRestitution)) {
            *body = body.clone().with_restitution(number)?;
        }
        let fixed = self.fixed.iter_mut().map(|piece| &mut piece.friction);
        let fixed = fixed.chain(self.terrains.iter_mut().map(|terrain| &mut terrain.friction));
        let fixed = fixed.filter_map(Option::as_mut);
        let frictions = fixed.zip(numbers(Constant::FixedFriction));
        let pairs = self.pair_frictions.iter_mut().map(|(_, own)| own);
        for (own, number) in frictions.chain(pairs.zip(numbers(Constant::PairFriction))) {
            in_range("coefficient of friction", number, 0.0, 10.0, "0 to 10")?;
            *own = number;
        }
        let pairs = self.pair_restitutions.iter_mut().map(|(_, own)| own);
        for (own, number) in pairs.zip(numbers(Constant::PairRestitution)) {
            in_range("coefficient of restitution", number, 0.0, 1.0, "0 to 1")?;
            *own = number;
        }
        for coefficient in Coefficient::ALL {
            self.set_coefficients(
                coefficient,
                given(Constant::Coefficient(coefficient)).unwrap_or(&[]),
            )?;
        }
        self.set_friction_factors(given(Constant::FrictionFactor).unwrap_or(&[]))
    }
}

/// Own coefficient of `all[index]`: its constant, its index in the constant, and its value.
fn own<T>(
    all: &[T],
    index: usize,
    of: impl Fn(&T) -> Option<f64>,
    constant: Constant,
) -> Option<(Constant, usize, f64)> {
    let value = of(&all[index])?;
    let place = all[..index].iter().filter(|before| of(before).is_some()).count();
    Some((constant, place, value))
}

/// Derivatives of the geometric mean of two numbers.
fn mean_slopes([a, b]: [(Constant, usize, f64); 2]) -> LawSlopes {
    let slope = |own: f64, other: f64| if own > 0.0 { 0.5 * (other / own).sqrt() } else { 0.0 };
    let (by_a, by_b) =
        if (a.0, a.1) == (b.0, b.1) { (1.0, 0.0) } else { (slope(a.2, b.2), slope(b.2, a.2)) };
    [(a.0, a.1, by_a), (b.0, b.1, by_b)]
}

impl Constant {
    /// True for constants of bodies', fixed pieces' and pairs' own coefficients.
    pub fn is_of_laws(self) -> bool {
        matches!(
            self,
            Self::Coefficient(_)
                | Self::FrictionFactor
                | Self::BodyFriction
                | Self::BodyRestitution
                | Self::FixedFriction
                | Self::PairFriction
                | Self::PairRestitution
        )
    }

    /// Values of a contact-law constant.
    pub(super) fn law_values(self, world: &World) -> Vec<f64> {
        let bodies = world.bodies().iter();
        let of_pairs =
            |pairs: &super::laws::PairLaws| pairs.iter().map(|(_, value)| *value).collect();
        match self {
            Self::Coefficient(of) => {
                world.coefficients(of).map_or(Vec::new(), |all| all.values().collect())
            }
            Self::FrictionFactor => {
                world.friction_axes().iter().map(|(_, axis)| axis.factor).collect()
            }
            Self::BodyFriction => bodies.filter_map(RigidBody::friction).collect(),
            Self::BodyRestitution => bodies.filter_map(RigidBody::restitution).collect(),
            Self::FixedFriction => world.fixed_frictions().flatten().collect(),
            Self::PairFriction => of_pairs(&world.pair_frictions),
            Self::PairRestitution => of_pairs(&world.pair_restitutions),
            _ => Vec::new(),
        }
    }

    /// Number of values of a contact-law constant.
    pub(super) fn law_width(self, world: &World) -> usize {
        let bodies = world.bodies().iter();
        match self {
            Self::Coefficient(of) => world.coefficients(of).map_or(0, Coefficients::len),
            Self::FrictionFactor => world.friction_axes().len(),
            Self::BodyFriction => bodies.filter_map(RigidBody::friction).count(),
            Self::BodyRestitution => bodies.filter_map(RigidBody::restitution).count(),
            Self::FixedFriction => world.fixed_frictions().flatten().count(),
            Self::PairFriction => world.pair_frictions.len(),
            Self::PairRestitution => world.pair_restitutions.len(),
            _ => 0,
        }
    }
}
