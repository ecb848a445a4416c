//! Sensors on the links of a robot, as functions of the links' motion and the record of a step.
//!
//! Joint sensors are coordinates and rates. Contacts act as impulses
//! within a step. An accelerometer therefore reads the velocity change of its site over the step,
//! without gravity g:
//!
//! ```text
//! a = Rᵀ ((v⁺ − v)/h − g),
//! ```
//!
//! R is the attitude of its frame at the end of the step. At rest it reads g upwards. Velocities
//! are means over their steps. In the first step after the velocities are set, v is an
//! instantaneous value and half of the contribution of rotation is missing.

pub use super::model::{NamedSite, RobotSite};

use super::motion::LinkMotion;
use nalgebra::Vector3;

impl RobotSite {
    /// Motion of the site: pose, angular velocity and velocity of its origin, world.
    ///
    /// # Errors
    /// A link that does not exist.
    pub fn motion(&self, links: &[LinkMotion]) -> Result<LinkMotion, String> {
        let link = links.get(self.link).ok_or_else(|| {
            format!(
                "link: {1} does not exist; there are {0} links, including the world",
                links.len(),
                self.link
            )
        })?;
        let frame = link.frame.then(&self.frame);
        let velocity = link.velocity + link.spin.cross(&(frame.position - link.frame.position));
        Ok(LinkMotion { frame, spin: link.spin, velocity })
    }

    /// Reading of a gyroscope: angular velocity (rad/s) in the site's frame.
    ///
    /// # Errors
    /// A link that does not exist.
    pub fn gyroscope(&self, links: &[LinkMotion]) -> Result<Vector3<f64>, String> {
        let LinkMotion { frame, spin, .. } = self.motion(links)?;
        Ok(frame.rotation().tr_mul(&spin))
    }

    /// Reading of an accelerometer (m/s²) over a step of h = `time_step` (s), in the site's frame
    /// at the end of the step. The arguments are the motion of all links at the start and at the
    /// end, and `gravity` (m/s²) (world).
    ///
    /// # Errors
    /// A link that does not exist.
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
