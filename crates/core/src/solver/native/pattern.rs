//! Where a system of blocks has numbers: its pairs, the order of elimination, and the fill.

use super::order::Order;
use super::plan::FrontPlan;

/// Fronts are worth it from so many updates of blocks for each body on: the first step of a wall of 1000 bricks takes two
/// thirds of the processor time with them, that of a pyramid of 1275 cubes nine tenths.
const HEAVY: usize = 60;

/// The pattern of a symmetric sparse matrix of blocks, one row a body: a block on every diagonal, and one
/// at (i, j) and (j, i) of every pair.
#[derive(Debug, Clone, Default)]
pub(super) struct Pattern {
    pub order: Order,
    /// Where so much is to be eliminated that it is worth it, the fronts of blocks of six.
    plan: Option<Box<FrontPlan>>,
}

impl Pattern {
    /// Makes this that of `bodies` rows with blocks at the `pairs` of different bodies, which may come
    /// more than once.
    pub(super) fn set(&mut self, bodies: usize, pairs: impl Iterator<Item = (usize, usize)>) {
        if self.order.set(bodies, pairs) {
            let each = (0..bodies).map(|place| self.order.row(place).len());
            let updates: usize = each.map(|blocks| blocks * blocks).sum();
            let is_worth_it = updates > HEAVY * bodies;
            self.plan = is_worth_it.then(|| Box::new(FrontPlan::of(&self.order, &vec![6; bodies])));
            if self.plan.is_none() {
                self.order.find_updates();
            }
        }
    }

    /// The fronts of its blocks, where it is worth to eliminate in fronts.
    pub(super) fn plan(&self) -> Option<&FrontPlan> {
        self.plan.as_deref()
    }
}
