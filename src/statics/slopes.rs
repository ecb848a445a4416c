//! Derivatives of the largest factor, from both certificates at the limit.
//!
//! With the forces f and the mechanism y at λ, and w₁ · y = 1, a change of the structure to A', w', w₁'
//! and of the coefficients of friction to μ' changes the factor by
//!
//! ```text
//! δλ = −y · (A' f' + w' + λ w₁')                                            (S6)
//! ```
//!
//! to first order. f' has the components of f along the axes of the changed contacts, and friction at
//! its limit times μ'/μ. Where y or f are not unique, this is not the derivative: it has another value on
//! each side. [`Structure::slope`] compares it with both sides.

use super::certificate::{ForceState, Mechanism};
use super::limit::Limit;
use super::loads::{LoadCase, Twist};
use super::structure::{ContactRow, Structure};
use crate::Partner;
use nalgebra::{Rotation3, Vector3};
use tumble_core::contact::ContactLoad;

/// Distance of a friction force from its limit up to which it is at it, as a fraction of the limit.
const AT_LIMIT: f64 = 1e-5;
/// Largest difference of slopes that count as equal, as a fraction of the larger one.
const SAME: f64 = 1e-3;

/// Derivative of the largest factor by a number.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Slope {
    /// Derivative from the certificates (S6).
    pub value: f64,
    /// Difference quotients of the factor below and above.
    pub sides: [f64; 2],
    /// True if all three agree to 10⁻³. Otherwise mechanism or forces are not unique, and each side has
    /// its own slope.
    pub is_unique: bool,
}

impl Structure {
    /// Factor, forces and mechanism of a limit of this structure.
    fn certificates<'a>(&self, limit: &'a Limit) -> Option<(f64, &'a ForceState, &'a Mechanism)> {
        let Limit::Factor { lower, forces, mechanism, .. } = limit else { return None };
        let sizes = [forces.contacts.len(), forces.axes.len(), mechanism.velocities.len()];
        let own = [self.contacts.len(), self.axes.len(), self.masses.len()];
        (sizes == own).then_some((*lower, forces, mechanism))
    }

    /// Change of the largest factor to first order (S6), if the structure and its load case change to these.
    /// `None` without a limit, or if the contacts are not the same ones.
    pub fn change_of_factor(&self, limit: &Limit, changed: &Self, case: &LoadCase) -> Option<f64> {
        let (factor, forces, mechanism) = self.certificates(limit)?;
        let counts = |structure: &Self| {
            [structure.contacts.len(), structure.axes.len(), structure.masses.len()]
        };
        if counts(self) != counts(changed) || case.wrenches.len() != self.masses.len() {
            return None;
        }
        let velocities = &mechanism.velocities;
        let mut power = changed.loads.plus(factor, case).power(velocities);
        for (before, load) in self.contacts.iter().zip(&forces.contacts) {
            let now = changed.contacts.iter().find(|now| now.key == before.key)?;
            let load = moved(before, now, load);
            let (velocity, turning) = changed.relative(now, velocities);
            // The balance is about the changed centres.
            power += load.force.dot(&velocity) + load.moment.dot(&turning);
        }
        for (axis, force) in changed.axes.iter().zip(&forces.axes) {
            let rate: f64 = axis.on.iter().map(|(body, on)| on.dot(&velocities[*body])).sum();
            power += force * rate;
        }
        Some(-power)
    }

    /// Derivatives of the largest factor by the coefficient of friction of each pair (S6), the largest first.
    /// All contacts of a pair change together. They are not negative, except for moving surfaces.
    pub fn friction_slopes(&self, limit: &Limit) -> Vec<((usize, Partner), f64)> {
        let Some((_, forces, mechanism)) = self.certificates(limit) else { return Vec::new() };
        let mut slopes = std::collections::BTreeMap::new();
        for (index, (contact, load)) in self.contacts.iter().zip(&forces.contacts).enumerate() {
            let pressing = contact.normal.dot(&load.force);
            let velocity = self.relative(contact, &mechanism.velocities).0;
            *slopes.entry(self.pair(index)).or_insert(0.0) +=
                pressing * contact.resisted(&velocity);
        }
        let mut slopes: Vec<_> = slopes.into_iter().collect();
        slopes.sort_by(|a, b| b.1.total_cmp(&a.1));
        slopes
    }

    /// Derivative of the largest factor of `case` by the mass of each body (1/kg), at the same centre of mass.
    pub fn mass_slopes(&self, limit: &Limit, case: &LoadCase) -> Vec<f64> {
        let Some((factor, _, mechanism)) = self.certificates(limit) else { return Vec::new() };
        let per_mass = self.gravity + case.per_mass * factor;
        mechanism.velocities.iter().map(|twist: &Twist| -per_mass.dot(&twist.linear)).collect()
    }

    /// Derivative of the largest factor by a number p, with the structure and load case that `at` makes
    /// of p, and both difference quotients over `step`. `None` if a limit is missing, or if the
    /// contacts differ.
    pub fn slope(at: impl Fn(f64) -> Option<(Self, LoadCase)>, p: f64, step: f64) -> Option<Slope> {
        let below = at(p - step)?;
        let here = at(p)?;
        let above = at(p + step)?;
        let limit = here.0.largest_factor(&here.1);
        let change = |to: &(Self, LoadCase)| here.0.change_of_factor(&limit, &to.0, &to.1);
        let value = (change(&above)? - change(&below)?) / (2.0 * step);
        let factor = |made: &(Self, LoadCase)| made.0.largest_factor(&made.1).factor();
        let middle = limit.factor()?;
        let sides = [(middle - factor(&below)?) / step, (factor(&above)? - middle) / step];
        let size = sides[0].abs().max(sides[1].abs()).max(value.abs());
        let is_unique = sides.iter().all(|side| (side - value).abs() <= SAME * size);
        Some(Slope { value, sides, is_unique })
    }
}

impl ContactRow {
    /// Power of friction at its limit per coefficient and normal force, against a relative velocity: ‖u_t‖.
    fn resisted(&self, velocity: &Vector3<f64>) -> f64 {
        let mut slip = velocity - self.normal * self.normal.dot(velocity);
        if let Some(dragged) = self.dragged {
            return -dragged.dot(&slip);
        }
        if let Some((along, scale)) = self.scaled {
            slip += along * (along.dot(&slip) * (scale - 1.0));
        }
        slip.norm()
    }
}

/// A load with its components along the axes of a changed contact. The frame turns with the normal, by the
/// shortest rotation, and friction at its limit has the changed coefficient.
fn moved(before: &ContactRow, now: &ContactRow, load: &ContactLoad) -> ContactLoad {
    let turn = Rotation3::rotation_between(&before.normal, &now.normal).unwrap_or_default();
    let pressing = before.normal.dot(&load.force);
    let mut across = load.force - before.normal * pressing;
    let limit = before.friction * pressing;
    if before.dragged.is_some()
        || before.scaled.is_some()
        || across.norm() >= limit * (1.0 - AT_LIMIT)
    {
        across *= if before.friction > 0.0 { now.friction / before.friction } else { 1.0 };
    }
    ContactLoad { force: turn * (before.normal * pressing + across), moment: turn * load.moment }
}
