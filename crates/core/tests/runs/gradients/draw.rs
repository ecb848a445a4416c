//! Random numbers for random scenes.

use nalgebra::{Vector3, Vector4};
use rand_mt::Mt;

/// Random numbers from a seeded Mersenne Twister. The sequence is the same on every machine.
pub struct Draw(pub Mt);

impl Draw {
    /// Random number between `low` and `high`.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * f64::from(self.0.next_u32()) / f64::from(u32::MAX)
    }

    /// Vector with random components between −`size` and `size`.
    pub fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.within(-size, size))
    }

    /// Random number between −1 and 1.
    pub fn unit(&mut self) -> f64 {
        self.within(-1.0, 1.0)
    }

    /// Random unit quaternion. It is not uniformly distributed over all rotations.
    pub fn attitude(&mut self) -> Vector4<f64> {
        Vector4::from_fn(|_, _| self.unit()).normalize()
    }
}
