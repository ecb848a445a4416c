//! Rolling and torsional resistance: coefficients of the moments of contacts.

use super::{Coefficient, Partner, World};
use crate::partner::TurningFriction;

impl World {
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

    /// Coefficients of turning friction between `body` and `partner`: the pair's own, or the larger one of
    /// both. The world's apply to the ground, and to bodies and colliders without their own.
    #[inline]
    pub fn turning_friction_between(&self, body: usize, partner: Partner) -> TurningFriction {
        if self.coefficients.is_none() {
            return TurningFriction::NONE;
        }
        let friction =
            |turning| self.larger_between(turning, body, partner).map_or(0.0, |(_, own)| own);
        TurningFriction {
            rolling: friction(Coefficient::RollingFriction),
            torsional: friction(Coefficient::TorsionalFriction),
        }
    }

    /// Number of the pair, or the larger one of both, and its index; `None` if there is none.
    pub(crate) fn larger_between(
        &self,
        of: Coefficient,
        body: usize,
        partner: Partner,
    ) -> Option<(usize, f64)> {
        let all = self.coefficients(of)?;
        all.between(body, partner).or_else(|| {
            let own = |owner| all.own(owner).or(all.world());
            let both = [own(Partner::Body(body)), own(partner)].into_iter().flatten();
            both.reduce(|a, b| if b.1 > a.1 { b } else { a })
        })
    }
}
