//! Largest factor of a load case, with both certificates.
//!
//! With multipliers y of (S3) and w₁ · y = 1, every force state at a factor λ has
//!
//! ```text
//! λ ≤ λ* = −w · y,   because 0 = y · (A f + w + λ w₁) ≥ w · y + λ              (S4)
//! ```

use super::certificate::{ForceState, Mechanism};
use super::conic::{ConicResult, Goal};
use super::loads::LoadCase;
use super::structure::Structure;
use super::verdict::Verdict;
use crate::Partner;

/// Factor by which a mechanism is checked above the limit.
const ABOVE: f64 = 1e-6;
/// Smallest factor for the same, in units of the other loads.
const LEAST: f64 = 1e-3;
/// Size of a load case that stands for any factor, in units of the other loads.
const ANY: f64 = 1e3;

/// Limit of a load case.
#[derive(Debug, Clone, PartialEq)]
pub enum Limit {
    /// Largest factor, between both certificates.
    Factor {
        /// Factor λ of the force state.
        lower: f64,
        /// Factor above which the mechanism excludes all forces (S4).
        upper: f64,
        /// Forces at `lower`.
        forces: ForceState,
        /// Velocities, with a power of the load case of 1 W.
        mechanism: Mechanism,
    },
    /// No factor is too large: these forces balance the load case alone.
    Unlimited(ForceState),
    /// The structure stands at no factor.
    Never(Mechanism),
    /// A certificate is missing.
    Undecided,
}

impl Limit {
    /// The largest factor, if it has both certificates.
    pub fn factor(&self) -> Option<f64> {
        match self {
            Self::Factor { lower, .. } => Some(*lower),
            _ => None,
        }
    }

    /// Name of the result.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Factor { .. } => "factor",
            Self::Unlimited(_) => "unlimited",
            Self::Never(_) => "never",
            Self::Undecided => "undecided",
        }
    }
}

/// Part of a contact in a mechanism.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WeakSpot {
    /// Index of the contact.
    pub contact: usize,
    /// Speed of one side relative to the other, as a fraction of the largest of all contacts.
    pub part: f64,
    /// Normal part of this speed as a fraction of it: 1 if the contact opens straight.
    pub opening: f64,
}

impl Structure {
    /// Largest factor λ of `case`, which acts besides the loads of the scene. The mechanism is
    /// checked at λ (1 + 10⁻⁶).
    pub fn largest_factor(&self, case: &LoadCase) -> Limit {
        if case.wrenches.len() != self.masses.len() {
            return Limit::Undecided;
        }
        let goal = Goal::LargestFactor(case);
        let Some(found) = self.solve(&self.loads, &goal) else { return Limit::Undecided };
        let ConicResult { forces, factor: lower, mechanism } = found;
        let power = case.power(&mechanism.velocities);
        let above = self.above(lower, case);
        if self.check_forces(&forces, &self.loads.plus(lower, case)).holds
            && self.check_mechanism(&mechanism, &self.loads.plus(above, case)).holds
        {
            let mechanism = mechanism.times(1.0 / power);
            let (work, _) = self.work_of_axes(&mechanism.velocities);
            let upper = -self.loads.power(&mechanism.velocities) - work;
            return Limit::Factor { lower, upper, forces, mechanism };
        }
        let any = ANY * self.unit_of(case);
        let excludes =
            |factor: f64| self.check_mechanism(&mechanism, &self.loads.plus(factor, case)).holds;
        if [-any, 0.0, any].into_iter().all(excludes) {
            return Limit::Never(mechanism);
        }
        let Verdict::Equilibrium(alone) = self.without_bounded_forces().verdict_under(case) else {
            return Limit::Undecided;
        };
        let stands = |factor: f64| {
            matches!(self.verdict_under(&self.loads.plus(factor, case)), Verdict::Equilibrium(_))
        };
        if stands(0.0) || stands(any) { Limit::Unlimited(alone) } else { Limit::Undecided }
    }

    /// Factor of `case` above `factor` at which a limit has its mechanism: by 10⁻⁶ of it, and near 0 by 10⁻⁹ of
    /// the other loads.
    pub fn above(&self, factor: f64, case: &LoadCase) -> f64 {
        factor + ABOVE * factor.abs().max(LEAST * self.unit_of(case))
    }

    /// Factor that makes `case` as large as the loads of the scene, or 1.
    fn unit_of(&self, case: &LoadCase) -> f64 {
        let unit = self.size(&self.loads) / self.size(case);
        if unit > 0.0 && unit.is_finite() { unit } else { 1.0 }
    }

    /// Contacts in the order of their part in a mechanism, the weakest first. Contacts that do not move are
    /// left out.
    pub fn weak_contacts(&self, mechanism: &Mechanism) -> Vec<WeakSpot> {
        let mut spots: Vec<WeakSpot> = Vec::new();
        if mechanism.velocities.len() != self.masses.len() {
            return spots;
        }
        for (contact, row) in self.contacts.iter().enumerate() {
            let velocity = self.relative(row, &mechanism.velocities).0;
            let part = velocity.norm();
            spots.push(WeakSpot { contact, part, opening: row.normal.dot(&velocity) / part });
        }
        let largest = spots.iter().fold(0.0, |most: f64, spot| most.max(spot.part));
        spots.iter_mut().for_each(|spot| spot.part /= largest);
        spots.retain(|spot| spot.part > 1e-6);
        spots.sort_by(|a, b| b.part.total_cmp(&a.part));
        spots
    }

    /// Bodies in the order of their speed in a mechanism, with their part of the largest speed. Bodies that
    /// do not move are left out.
    pub fn weak_bodies(&self, mechanism: &Mechanism) -> Vec<(usize, f64)> {
        let most = self.speed(&mechanism.velocities);
        let speeds = mechanism.velocities.iter().zip(&self.reaches);
        let parts = speeds
            .map(|(twist, reach)| (twist.linear.norm() + twist.angular.norm() * reach) / most);
        let mut bodies: Vec<_> = parts.enumerate().filter(|(_, part)| *part > 1e-6).collect();
        bodies.sort_by(|a, b| b.1.total_cmp(&a.1));
        bodies
    }

    /// Pair of objects of a contact: the body with the smaller index first.
    ///
    /// # Panics
    /// If the contact does not exist.
    pub fn pair(&self, contact: usize) -> (usize, Partner) {
        let key = &self.contacts[contact].key;
        match key.partner {
            Partner::Body(other) if other < key.body => (other, Partner::Body(key.body)),
            partner => (key.body, partner),
        }
    }
}
