//! The constants that differ from rollout to rollout.

use crate::error::Error;
pub use crate::world::Constant as Parameter;
use crate::world::World;
use crate::world::constants::Given;

/// A parameter and its numbers, for B rollouts.
#[derive(Debug, Clone, Copy)]
pub struct Values<'a> {
    /// Which constant.
    pub parameter: Parameter,
    /// B times as many numbers as [`Parameter::width`] says.
    pub values: &'a [f64],
}

/// `world` with the constants that `values` has for `rollout`.
pub(super) fn varied(world: &World, values: &[Values<'_>], rollout: usize) -> Result<World, Error> {
    let bodies = world.bodies().len();
    let of_rollout = |values: &Values<'_>| {
        let width = values.parameter.width(bodies);
        rollout * width..(rollout + 1) * width
    };
    let given = values.iter().map(|given| (given.parameter, &given.values[of_rollout(given)]));
    let given: Vec<Given<'_>> = given.collect();
    world.with_constants(&given)
}
