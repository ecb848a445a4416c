//! What sensors on the links of a robot read: plain functions of how the links move, and of what a step came to.
//!
//! Joint sensors are coordinates and rates ([`Assembled::coordinates`]). In a step contacts act as impulses, so that an accelerometer reads
//! what the step did to the velocity of its site, of which gravity g is no part:
//!
//! ```text
//! a = Rᵀ ((v⁺ − v)/h − g),
//! ```
//!
//! R being the attitude of its frame at the end. At rest it reads g upwards. Velocities are means over their steps; in the first step after they were set,
//! where v is that of a moment, half of what turning makes is not in it.

pub use super::model::{NamedSite, RobotSite};

use super::Assembled;
use super::motion::LinkMotion;
use nalgebra::Vector3;
use tumble_core::simulation::StepRecord;
use tumble_core::world::Partner;

impl RobotSite {
    /// How it moves: where its frame is, its spin, and the velocity of its origin, world.
    ///
    /// # Errors
    /// A link that is not there.
    pub fn motion(&self, links: &[LinkMotion]) -> Result<LinkMotion, String> {
        let link = links.get(self.link).ok_or_else(|| {
            format!(
                "link: there are {} with the world, and {} is none of them",
                links.len(),
                self.link
            )
        })?;
        let frame = link.frame.then(&self.frame);
        let velocity = link.velocity + link.spin.cross(&(frame.position - link.frame.position));
        Ok(LinkMotion { frame, spin: link.spin, velocity })
    }

    /// What a gyroscope reads: its spin, rad/s, its frame.
    ///
    /// # Errors
    /// A link that is not there.
    pub fn gyroscope(&self, links: &[LinkMotion]) -> Result<Vector3<f64>, String> {
        let LinkMotion { frame, spin, .. } = self.motion(links)?;
        Ok(frame.rotation().tr_mul(&spin))
    }

    /// What an accelerometer reads of a step of h = `time_step` (s) that its links were at the start and the end of, under `gravity` (m/s²,
    /// world): m/s², its frame at the end.
    ///
    /// # Errors
    /// A link that is not there.
    pub fn accelerometer(
        &self,
        [start, end]: [&[LinkMotion]; 2],
        time_step: f64,
        gravity: &Vector3<f64>,
    ) -> Result<Vector3<f64>, String> {
        let (start, end) = (self.motion(start)?, self.motion(end)?);
        let mean = (end.velocity - start.velocity) / time_step;
        Ok(end.frame.rotation().tr_mul(&(mean - gravity)))
    }
}

impl Assembled {
    /// What a touch sensor reads: the sum of the normal forces (N) that act in a step on the bodies that a link moves with, from `partner`
    /// alone if one is given, and within so many metres of a site, where it was at the start, if that is.
    ///
    /// # Errors
    /// A link that is not there; a record of other bodies.
    pub fn touch(
        &self,
        record: &StepRecord,
        link: usize,
        partner: Option<Partner>,
        within: Option<(&RobotSite, f64)>,
    ) -> Result<f64, String> {
        let zone = match within {
            Some((site, radius)) => {
                let links = self.links_at(&record.states)?;
                Some((site.motion(&links)?.frame.position, radius))
            }
            None => None,
        };
        let own = |of: Partner| match of {
            Partner::Body(body) => self.moves_with(link, body),
            Partner::Ground | Partner::Fixed(_) => false,
        };
        let mut sum = 0.0;
        for (contact, found) in record.contacts.iter().zip(&record.solution.contacts) {
            let (body, other) = (contact.key.body, contact.key.partner);
            let sides = [(Partner::Body(body), other), (other, Partner::Body(body))];
            let touches =
                sides.iter().any(|(of, with)| own(*of) && partner.is_none_or(|p| p == *with));
            let place = record.states.get(body).map(|state| state.position + contact.arm);
            let is_near = zone.is_none_or(|(centre, radius)| {
                place.is_some_and(|place| (place - centre).norm() <= radius)
            });
            if touches && is_near {
                sum += found.normal_force;
            }
        }
        Ok(sum)
    }
}
