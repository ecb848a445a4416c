//! World constants that differ between rollouts.

use tumble_core::error::Error;
pub use tumble_core::world::Constant;
use tumble_core::world::World;
use tumble_core::world::constants::ConstantValue;

/// A constant and its values for B rollouts.
#[derive(Debug, Clone, Copy)]
pub struct Varied<'a> {
    /// Constant that varies.
    pub constant: Constant,
    /// B times [`Constant::width`] values.
    pub values: &'a [f64],
}

/// Returns `world` with the constants of `rollout` from `values`.
pub(super) fn varied(world: &World, values: &[Varied<'_>], rollout: usize) -> Result<World, Error> {
    let of_rollout = |values: &Varied<'_>| {
        let width = values.constant.width(world);
        rollout * width..(rollout + 1) * width
    };
    let given = values.iter().map(|given| (given.constant, &given.values[of_rollout(given)]));
    let given: Vec<ConstantValue<'_>> = given.collect();
    world.with_constants(&given)
}
