//! Random numbers for random scenes.

use nalgebra::{Vector3, Vector4};
use rand_mt::Mt;

/// Generator of a fixed sequence of numbers.
pub struct Draw(pub Mt);

impl Draw {
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * f64::from(self.0.next_u32()) / f64::from(u32::MAX)
    }

    pub fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.within(-size, size))
    }

    /// Random number between −1 and 1.
    pub fn unit(&mut self) -> f64 {
        self.within(-1.0, 1.0)
    }

    pub fn attitude(&mut self) -> Vector4<f64> {
        Vector4::from_fn(|_, _| self.unit()).normalize()
    }
}
