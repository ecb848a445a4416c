//! Selection of the contact forces to draw, and the lengths of their arrows.

use crate::film::{Film, Object};
use nalgebra::Vector3;
use serde::Serialize;
use std::collections::BTreeMap;
use tumble_core::contact::ContactKey;
use tumble_scene::output::tables::IntervalRows;

/// Smallest drawn force over [`Scale::weight`].
const NEGLIGIBLE: f64 = 1e-6;

/// Lengths of force arrows.
///
/// Impact forces are hundreds of times the weight, so lengths are compressed. The relative length
/// is s / (1 + s) with s = √(force / weight). It grows like the square root below the weight and
/// saturates above it.
#[derive(Serialize)]
pub struct Scale {
    /// Reference force (N): mean weight of the bodies, or the largest force of a film without
    /// gravity. Its arrow has half the maximum length.
    pub weight: f64,
    /// Upper bound of the arrow length (m).
    pub longest: f64,
}

impl Scale {
    pub fn from_film(film: &Film) -> Self {
        let count = film.bodies.len() as f64;
        let mass = film.world.bodies().iter().map(|body| body.mass()).sum::<f64>() / count;
        let reach = film.bodies.iter().map(Object::reach).sum::<f64>() / count;
        let mut weight = mass * film.world.gravity().norm();
        if weight == 0.0 {
            let contacts = film.frames.iter().flat_map(|frame| &*frame.contacts);
            weight = contacts.map(|c| c.force.norm()).fold(f64::MIN_POSITIVE, f64::max);
        }
        Self { weight, longest: 1.5 * reach }
    }

    /// Common scale of films that are compared: the larger reference force and length.
    pub fn from_films(films: &[&Film]) -> Self {
        let all = films.iter().map(|film| Self::from_film(film));
        let larger = |a: Self, b: Self| Self {
            weight: a.weight.max(b.weight),
            longest: a.longest.max(b.longest),
        };
        all.reduce(larger).unwrap_or(Self { weight: f64::MIN_POSITIVE, longest: 0.0 })
    }

    /// Arrow of a force.
    pub fn arrow(&self, force: &Vector3<f64>) -> Vector3<f64> {
        let root = (force.norm() / self.weight).sqrt();
        force.normalize() * (self.longest * root / (1.0 + root))
    }

    /// Drawn contacts, with their forces averaged over `steps`. The average makes an impact of one
    /// step visible in any frame.
    pub fn means(&self, steps: &[IntervalRows]) -> Vec<MeanForce> {
        let mut means = BTreeMap::new();
        for contact in steps.iter().flat_map(|step| &*step.contacts) {
            let site = contact.key.between(contact.body, contact.partner);
            let (point, normal) = (contact.point, contact.normal);
            let (force, moment) = (Vector3::zeros(), Vector3::zeros());
            let mean =
                means.entry(site).or_insert(MeanForce { site, point, normal, force, moment });
            // The last place is drawn.
            (mean.point, mean.normal) = (point, normal);
            mean.force += contact.force / steps.len() as f64;
            mean.moment += contact.moment / steps.len() as f64;
        }
        let is_shown = |mean: &MeanForce| mean.force.norm() > NEGLIGIBLE * self.weight;
        means.into_values().filter(is_shown).collect()
    }
}

/// Mean force of a contact (N), world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanForce {
    /// Identity of the contact across steps.
    pub site: ContactKey,
    /// Position (m), world frame.
    pub point: Vector3<f64>,
    /// Unit normal away from the partner.
    pub normal: Vector3<f64>,
    pub force: Vector3<f64>,
    /// Moment about `point` (N m), of rolling and torsional friction.
    pub moment: Vector3<f64>,
}

#[cfg(test)]
#[path = "tests/forces.rs"]
mod tests;
