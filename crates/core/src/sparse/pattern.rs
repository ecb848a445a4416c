//! Sparsity pattern of a block system: pairs, elimination order and fill.

use super::ordering::Order;
use super::symbolic::SymbolicFactorisation;

/// Number of block updates per body from which fronts save time: a third for a wall of 1000 bricks.
const HEAVY: usize = 60;

/// Pattern of a symmetric sparse block matrix with one row per body. Every diagonal has a block,
/// and every pair has blocks at (i, j) and (j, i).
#[derive(Debug, Clone, Default)]
pub(crate) struct Pattern {
    pub(super) order: Order,
    /// Plan of fronts of 6 × 6 blocks, for large eliminations only.
    plan: Option<Box<SymbolicFactorisation>>,
}

impl Pattern {
    /// Sets the pattern for `bodies` rows with blocks at the `pairs` of different bodies. Pairs may
    /// repeat.
    pub(crate) fn set(&mut self, bodies: usize, pairs: impl Iterator<Item = (usize, usize)>) {
        if self.order.set(bodies, pairs) {
            let each = (0..bodies).map(|place| self.order.row(place).len());
            let updates: usize = each.map(|blocks| blocks * blocks).sum();
            let is_worth_it = updates > HEAVY * bodies;
            self.plan = is_worth_it.then(|| {
                Box::new(SymbolicFactorisation::from_order(&self.order, &vec![6; bodies]))
            });
            if self.plan.is_none() {
                self.order.find_updates();
            }
        }
    }

    /// Place of a body in the elimination order.
    pub(crate) fn place(&self, body: usize) -> usize {
        self.order.place(body)
    }

    /// Plan of its fronts, if they pay off.
    pub(crate) fn plan(&self) -> Option<&SymbolicFactorisation> {
        self.plan.as_deref()
    }
}
