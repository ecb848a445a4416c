//! Decimal places of the numbers in tables.
//!
//! The numbers of whole steps are rounded to a decimal place of their unit. A residual that is recomputed
//! from them differs by less than 10⁻¹¹ m/s, times the speed scale of the world. With s = 10⁻¹² m/s times
//! this scale and the time step h, the last place is at most
//!
//! ```text
//! speed s,  spin s/ℓ,  length 2 s h,  quaternion and normal s h/ℓ,
//! force 0.1 s/(h (m⁻¹ + ‖I⁻¹‖ ℓ²)),  moment 0.1 s/(h ‖I⁻¹‖ ℓ)
//! ```
//!
//! ℓ is the reach of the world. The last two have the body of which an impulse changes the speed most.

use super::ContactRow;
use nalgebra::Vector3;
use tumble_core::mechanics::{RigidBody, State};
use tumble_core::world::{Impacts, StickSpeed, World};

/// Largest last place of a speed (m/s) in a world with a speed scale of 1.
const SPEED: f64 = 1e-12;

/// True if short tables of a run in `world` have rounded numbers.
pub fn rounds(world: &World) -> bool {
    Digits::new(world).is_some()
}

/// Rounding of states and contacts.
#[derive(Debug, Clone)]
pub(super) struct Digits {
    length: Places,
    /// Places of quaternions and normals.
    part: Places,
    speed: Places,
    spin: Places,
    force: Places,
    moment: Places,
}

impl Digits {
    /// Rounding in `world`, or `None`: joints can be stiff, located impacts have short intervals, and friction
    /// by a table of speeds is compared exactly.
    pub fn new(world: &World) -> Option<Self> {
        if !world.joints().is_empty()
            || world.impacts() == Impacts::Located
            || matches!(world.stick_speed(), StickSpeed::Table(_))
        {
            return None;
        }
        let (h, reach) = (world.time_step(), world.reach());
        let speed = SPEED * world.speed_scale();
        let largest =
            |give: fn(&RigidBody) -> f64| world.bodies().iter().map(give).fold(0.0, f64::max);
        let turning = |body: &RigidBody| body.inertia_inverse().norm() * body.reach();
        let give = |body: &RigidBody| {
            1.0 / body.mass() + body.inertia_inverse().norm() * body.reach().powi(2)
        };
        Some(Self {
            length: Places::new(2.0 * speed * h),
            part: Places::new(speed * h / reach),
            speed: Places::new(speed),
            spin: Places::new(speed / reach),
            force: Places::new(0.1 * speed / (h * largest(give))),
            moment: Places::new(0.1 * speed / (h * largest(turning))),
        })
    }

    /// State with rounded numbers.
    pub fn state(&self, state: &State) -> State {
        State {
            position: state.position.map(|number| self.length.rounded(number)),
            attitude: state.attitude.map(|number| self.part.rounded(number)),
            velocity: state.velocity.map(|number| self.speed.rounded(number)),
            spin: state.spin.map(|number| self.spin.rounded(number)),
        }
    }

    /// Row with rounded numbers. A force does not become zero: only contacts with a force have a placement.
    pub fn contact(&self, row: &ContactRow) -> ContactRow {
        let force = row.force.map(|number| self.force.rounded(number));
        let vanishes = force == Vector3::zeros() && row.force != force;
        ContactRow {
            point: row.point.map(|number| self.length.rounded(number)),
            normal: row.normal.map(|number| self.part.rounded(number)),
            force: if vanishes { row.force } else { force },
            slip: row.slip.map(|number| self.speed.rounded(number)),
            gap: self.length.rounded(row.gap),
            rebound: self.speed.rounded(row.rebound),
            moment: row.moment.map(|number| self.moment.rounded(number)),
            ..row.clone()
        }
    }
}

/// Decimal places of a unit, as the power of ten that makes rounded numbers whole.
#[derive(Debug, Clone, Copy)]
struct Places(f64);

impl Places {
    /// Largest power of ten that is exact.
    const MOST: i32 = 22;

    /// Fewest places whose last one is at most `step`.
    fn new(step: f64) -> Self {
        let mut powers = (0..=Self::MOST).map(|places| 10.0_f64.powi(places));
        Self(powers.find(|power| power * step >= 1.0).unwrap_or(f64::INFINITY))
    }

    /// Double next to the rounded number. −0 becomes 0. A number with fewer places stays the same.
    fn rounded(self, number: f64) -> f64 {
        /// Above it, doubles are whole numbers.
        const WHOLE: f64 = 1.0 / f64::EPSILON;
        let scaled = number * self.0;
        if scaled.abs() < WHOLE { scaled.round_ties_even() / self.0 + 0.0 } else { number }
    }
}

#[cfg(test)]
#[path = "tests/digits.rs"]
mod tests;
