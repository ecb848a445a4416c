//! Static friction: coefficients of contacts that did not slip in the step before.

use super::law_constants::Slot;
use super::{Coefficient, Partner, World};
use crate::error::{Error, in_range};

/// Slip up to which a contact has its static coefficient, unless another one is set (m/s).
const STICK_SPEED: f64 = 1e-6;

/// Share of the static coefficient of friction over the slip at the start of a step (eq. 42).
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[cfg_attr(
    feature = "serde",
    serde(untagged, expecting = "a slip or a table [[slip, share], …] is needed")
)]
pub enum StickSpeed {
    /// 1 up to this slip (m/s), 0 above.
    Limit(f64),
    /// Slips (m/s) with their shares, linear in between and constant beyond: Stribeck's curve.
    Table(Vec<[f64; 2]>),
}

impl Default for StickSpeed {
    fn default() -> Self {
        Self::Limit(STICK_SPEED)
    }
}

impl StickSpeed {
    /// Share at a `slip` (m/s), and its derivative (s/m). A limit is raised by `arc` (m/s).
    pub fn share(&self, slip: f64, arc: f64) -> (f64, f64) {
        let rows = match self {
            Self::Limit(speed) => return (f64::from(u8::from(slip <= *speed + arc)), 0.0),
            Self::Table(rows) => rows,
        };
        let next = rows.partition_point(|[speed, _]| *speed < slip);
        let before = next.checked_sub(1).map(|before| rows[before]);
        match (before, rows.get(next)) {
            (Some([from, high]), Some([to, low])) => {
                let slope = (low - high) / (to - from);
                (high + slope * (slip - from), slope)
            }
            (Some([_, share]), None) | (None, Some(&[_, share])) => (share, 0.0),
            (None, None) => (0.0, 0.0),
        }
    }
}

impl World {
    /// Returns this world with the slips that have the static coefficient, instead of those up to 10⁻⁶ m/s.
    ///
    /// # Errors
    /// [`Error::Count`] for an empty table; [`Error::OutOfRange`] for a slip outside 0…1000 m/s or below the one
    /// before, and for a share outside 0…1.
    pub fn with_stick_speed(mut self, of: StickSpeed) -> Result<Self, Error> {
        match &of {
            StickSpeed::Limit(speed) => {
                in_range("stick speed (m/s)", *speed, 0.0, 1e3, "0 to 1000")?;
            }
            StickSpeed::Table(rows) => {
                if rows.is_empty() {
                    let field = "rows of stick_speed";
                    return Err(Error::Count { field, count: 0, allowed: "1 or more" });
                }
                let mut least = 0.0;
                for [speed, share] in rows {
                    let allowed = "0 to 1000, not below the one before";
                    least = in_range("slip of stick_speed (m/s)", *speed, least, 1e3, allowed)?;
                    in_range("share of stick_speed", *share, 0.0, 1.0, "0 to 1")?;
                }
            }
        }
        self.stick_speed = of;
        Ok(self)
    }

    /// Slips that have the static coefficient.
    pub fn stick_speed(&self) -> &StickSpeed {
        &self.stick_speed
    }

    /// True if any static coefficient is set.
    pub fn has_static_friction(&self) -> bool {
        self.has(Coefficient::StaticFriction)
    }

    /// Static coefficient of friction between `body` and `partner` if it is above the kinetic one: the pair's
    /// own, or the geometric mean of both. A body or piece without a static coefficient has its own
    /// coefficient of friction, then the world's static one, then the world's.
    ///
    /// # Panics
    /// If the body or partner does not exist.
    pub fn static_friction_between(&self, body: usize, partner: Partner) -> Option<f64> {
        if !self.has_static_friction() {
            return None;
        }
        let kinetic = self.friction_between(body, partner);
        let friction = match self.pair_static(body, partner) {
            Some((.., friction)) => friction,
            None if self.coefficients(Coefficient::Friction).between(body, partner).is_some() => {
                kinetic
            }
            None => {
                let [a, b] = [Partner::Body(body), partner].map(|owner| self.own_static(owner).2);
                Coefficient::StaticFriction.combined(a, b)
            }
        };
        (friction > kinetic).then_some(friction)
    }

    /// Static coefficient of an owner.
    pub(super) fn own_static(&self, owner: Partner) -> Slot {
        use Coefficient::{Friction, StaticFriction};
        let [kinetic, of_static] = [Friction, StaticFriction].map(|of| self.coefficients(of));
        let own = of_static.own(owner).map(|number| (StaticFriction, number));
        let own = own.or_else(|| Some((Friction, kinetic.own(owner)?)));
        let own = own.or_else(|| Some((StaticFriction, of_static.world()?)));
        let (of, number) = own.unwrap_or((Friction, (0, self.friction())));
        self.slot(of, number)
    }

    /// Static coefficient of a pair with its own one.
    pub(super) fn pair_static(&self, body: usize, partner: Partner) -> Option<Slot> {
        let of = Coefficient::StaticFriction;
        Some(self.slot(of, self.coefficients(of).between(body, partner)?))
    }
}
