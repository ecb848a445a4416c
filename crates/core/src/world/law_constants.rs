//! Constants of contact laws: coefficients of the world, bodies, fixed pieces and pairs.

use super::coefficients::{Indexed, checked};
use super::constants::ConstantValue;
use super::{Coefficient, Constant, Partner, World};
use crate::error::Error;
use std::ops::Range;

/// Gradient of a contact coefficient: two entries of constant, index and derivative.
pub(crate) type LawSlopes = [(Constant, usize, f64); 2];

/// Number of a constant: the constant, the index there, and the number.
pub(super) type Slot = (Constant, usize, f64);

/// Constants of parts of a coefficient. The parts are the world, fixed colliders, bodies and pairs.
const PARTS: [(Constant, Coefficient, usize); 8] = [
    (Constant::Friction, Coefficient::Friction, 0),
    (Constant::FixedFriction, Coefficient::Friction, 1),
    (Constant::BodyFriction, Coefficient::Friction, 2),
    (Constant::PairFriction, Coefficient::Friction, 3),
    (Constant::Restitution, Coefficient::Restitution, 0),
    (Constant::FixedRestitution, Coefficient::Restitution, 1),
    (Constant::BodyRestitution, Coefficient::Restitution, 2),
    (Constant::PairRestitution, Coefficient::Restitution, 3),
];

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
        let slots = |law| {
            let numbers = self.numbers_between(law, body, partner);
            numbers.map(|number| self.slot(law, number.unwrap_or_default()))
        };
        let kinetic = slots(Coefficient::Friction);
        let of_static = match self.pair_static(body, partner) {
            _ if share == 0.0 => kinetic,
            Some(pair) => [pair; 2],
            None => [Partner::Body(body), partner].map(|owner| self.own_static(owner)),
        };
        let shared =
            |law, share: f64| mean_slopes(law).map(|(law, k, slope)| (law, k, share * slope));
        let restitution = mean_slopes(slots(Coefficient::Restitution));
        [shared(kinetic, 1.0 - share), shared(of_static, share), restitution]
    }

    /// Place of a number of a coefficient among the constants.
    pub(super) fn slot(&self, law: Coefficient, (index, value): Indexed) -> Slot {
        let ends = self.coefficients(law).ends();
        let mut parts = PARTS.iter().filter(|(_, known, _)| *known == law);
        match parts.find(|(.., part)| index < ends[*part]) {
            Some((constant, _, part)) => (*constant, index - start(&ends, *part), value),
            None => (Constant::Coefficient(law), index, value),
        }
    }

    /// Sets the coefficients in `given`.
    pub(super) fn set_laws(&mut self, given: &[ConstantValue<'_>]) -> Result<(), Error> {
        for (constant, numbers) in given {
            if *constant == Constant::FrictionFactor {
                self.set_friction_factors(numbers)?;
            }
            let Some((law, range)) = constant.numbers(self) else { continue };
            let all = self.coefficients[law as usize].values_mut();
            for (own, number) in all.skip(range.start).zip(*numbers) {
                *own = checked(law, *number, 0.0)?;
            }
        }
        self.parameters.friction = self.friction();
        Ok(())
    }
}

/// First index of a part.
fn start(ends: &[usize; 4], part: usize) -> usize {
    part.checked_sub(1).map_or(0, |before| ends[before])
}

/// Derivatives of the geometric mean of two numbers.
fn mean_slopes([a, b]: [Slot; 2]) -> LawSlopes {
    let slope = |own: f64, other: f64| if own > 0.0 { 0.5 * (other / own).sqrt() } else { 0.0 };
    let (by_a, by_b) =
        if (a.0, a.1) == (b.0, b.1) { (1.0, 0.0) } else { (slope(a.2, b.2), slope(b.2, a.2)) };
    [(a.0, a.1, by_a), (b.0, b.1, by_b)]
}

impl Constant {
    /// True for constants of bodies', fixed pieces' and pairs' own coefficients.
    pub fn is_of_laws(self) -> bool {
        let is_part = |(known, _, part): &(Self, Coefficient, usize)| *known == self && *part > 0;
        matches!(self, Self::Coefficient(_) | Self::FrictionFactor) || PARTS.iter().any(is_part)
    }

    /// Coefficient whose numbers the constant has, and their indices.
    pub(super) fn numbers(self, world: &World) -> Option<(Coefficient, Range<usize>)> {
        if let Self::Coefficient(law) = self {
            return Some((law, 0..world.coefficients(law).len()));
        }
        let (_, law, part) = PARTS.into_iter().find(|(known, ..)| *known == self)?;
        let ends = world.coefficients(law).ends();
        Some((law, start(&ends, part)..ends[part]))
    }

    /// Values of a contact-law constant.
    pub(super) fn law_values(self, world: &World) -> Vec<f64> {
        let Some((law, range)) = self.numbers(world) else {
            return world.friction_axes().iter().map(|(_, axis)| axis.factor).collect();
        };
        world.coefficients(law).values().skip(range.start).take(range.len()).collect()
    }

    /// Number of values of a contact-law constant.
    pub(super) fn law_width(self, world: &World) -> usize {
        self.numbers(world).map_or(world.friction_axes().len(), |(_, range)| range.len())
    }
}
