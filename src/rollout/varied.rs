//! The constants that differ from rollout to rollout.

use tumble_core::error::Error;
pub use tumble_core::world::Constant;
use tumble_core::world::World;
use tumble_core::world::constants::ConstantValue;

/// A constant and its numbers, for B rollouts.
#[derive(Debug, Clone, Copy)]
pub struct Varied<'a> {
    /// Which constant.
    pub constant: Constant,
    /// B times as many numbers as [`Constant::width`] says.
    pub values: &'a [f64],
}

/// `world` with the constants that `values` has for `rollout`.
pub(super) fn varied(world: &World, values: &[Varied<'_>], rollout: usize) -> Result<World, Error> {
    let of_rollout = |values: &Varied<'_>| {
        let width = values.constant.width(world);
        rollout * width..(rollout + 1) * width
    };
    let given = values.iter().map(|given| (given.constant, &given.values[of_rollout(given)]));
    let given: Vec<ConstantValue<'_>> = given.collect();
    world.with_constants(&given)
}
