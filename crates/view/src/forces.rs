//! Selection of the contact forces to draw, and the lengths of their arrows.

use crate::film::{Film, FilmBody, FilmContact, FilmFrame, FilmPartner};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Smallest drawn force over [`Scale::weight`].
const NEGLIGIBLE: f64 = 1e-6;

/// Lengths of force arrows.
///
/// Impact forces are hundreds of times the weight, so lengths are compressed. The relative length
/// is s / (1 + s) with s = √(force / weight). It grows like the square root below the weight and
/// saturates above it.
pub struct Scale {
    /// Reference force (N): mean weight of the bodies, or the largest force of a film without
    /// gravity. Its arrow has half the maximum length.
    pub weight: f64,
    /// Upper bound of the arrow length (m).
    pub longest: f64,
}

impl Scale {
    pub fn of(film: &Film) -> Self {
        let count = film.bodies.len() as f64;
        let mass = film.bodies.iter().map(|body| body.mass).sum::<f64>() / count;
        let reach = film.bodies.iter().map(FilmBody::reach).sum::<f64>() / count;
        let mut weight = mass * film.gravity.norm();
        if weight == 0.0 {
            let contacts = film.frames.iter().flat_map(|frame| &frame.contacts);
            weight = contacts.map(|c| c.force.norm()).fold(f64::MIN_POSITIVE, f64::max);
        }
        Self { weight, longest: 1.5 * reach }
    }

    /// Arrow of a force.
    pub fn arrow(&self, force: &Vector3<f64>) -> Vector3<f64> {
        let root = (force.norm() / self.weight).sqrt();
        force.normalize() * (self.longest * root / (1.0 + root))
    }

    /// Drawn contacts, with their forces averaged over `steps`. The average makes an impact of one
    /// step visible in any frame.
    pub fn means(&self, steps: &[FilmFrame]) -> Vec<MeanForce> {
        let mut means = BTreeMap::new();
        for contact in steps.iter().flat_map(|step| &step.contacts) {
            let mean = means.entry(ContactSite::of(contact)).or_insert((contact, Vector3::zeros()));
            // The last place is drawn.
            mean.0 = contact;
            mean.1 += contact.force / steps.len() as f64;
        }
        let is_shown = |mean: &MeanForce| mean.force.norm() > NEGLIGIBLE * self.weight;
        let mean = |(site, (contact, force)): (_, (&FilmContact, _))| MeanForce {
            site,
            point: contact.point,
            normal: contact.normal,
            friction: contact.friction,
            force,
        };
        means.into_iter().map(mean).filter(is_shown).collect()
    }
}

/// Identity of a contact across steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct ContactSite {
    pub body: usize,
    pub partner: FilmPartner,
    pub key: u64,
}

/// Mean force of a contact (N), world frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeanForce {
    pub site: ContactSite,
    /// Position (m), world frame.
    pub point: Vector3<f64>,
    /// Unit normal away from the partner.
    pub normal: Vector3<f64>,
    /// Friction coefficient of the pair.
    pub friction: f64,
    pub force: Vector3<f64>,
}

impl ContactSite {
    fn of(contact: &FilmContact) -> Self {
        Self { body: contact.body, partner: contact.partner, key: contact.key }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{falling_cube, floating_cube};

    #[test]
    fn larger_forces_have_longer_arrows_of_limited_length() {
        let scale = Scale { weight: 100.0, longest: 2.0 };
        let length = |force: f64| scale.arrow(&Vector3::new(0.0, 0.0, force)).norm();
        assert!((length(100.0) - 1.0).abs() < 1e-12);
        // Square-root law for small forces.
        assert!((length(0.04) / length(0.01) - 2.0).abs() < 0.05);
        assert!(length(1e3) < length(1e4) && length(1e12) <= 2.0);
    }

    #[test]
    fn a_force_that_is_shown_is_the_mean_of_the_steps() {
        let film = falling_cube(500);
        let scale = Scale::of(&film);
        assert!((scale.weight - 98.1).abs() < 1e-12);
        let landed = film.frames.iter().position(|frame| !frame.contacts.is_empty()).unwrap();
        assert_eq!(scale.means(&film.frames[..landed]), []);
        let means = scale.means(&film.frames[landed - 3..landed + 1]);
        assert_eq!(means.iter().map(|mean| mean.site.key).collect::<Vec<_>>(), [0, 1, 2, 3]);
        // The force acts in one of four steps, with a quarter of the weight at each corner.
        assert!(means.iter().all(|mean| (mean.force.norm() - 98.1 / 16.0).abs() < 1e-12));
        let floating = floating_cube(3);
        assert_eq!(Scale::of(&floating).means(&floating.frames), []);
    }
}
