//! Random numbers for random scenes, from seeds. They are the same on every machine.

// Every test program compiles this file separately and uses only a part of it.
#![allow(dead_code, clippy::disallowed_methods)]

use nalgebra::{Vector3, Vector4};
use rand_mt::{Mt, Mt64};

/// Source of random numbers.
pub trait Source {
    /// Random number from 0 to `width`.
    fn below(&mut self, width: f64) -> f64;
}

impl Source for Mt {
    fn below(&mut self, width: f64) -> f64 {
        width * f64::from(self.next_u32()) / f64::from(u32::MAX)
    }
}

impl Source for Mt64 {
    fn below(&mut self, width: f64) -> f64 {
        width * (self.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Random numbers of a source: a Mersenne Twister of 32 or 64 bits.
pub struct Draw<S = Mt>(pub S);

/// Random numbers of 53 bits.
pub type WideDraw = Draw<Mt64>;

impl Draw<Mt> {
    pub fn new(seed: u32) -> Self {
        Self(Mt::new(seed))
    }
}

impl WideDraw {
    pub fn wide(seed: u64) -> Self {
        Self(Mt64::new(seed))
    }

    /// Random index below `count`.
    pub fn index(&mut self, count: usize) -> usize {
        (self.0.next_u64() % count as u64) as usize
    }
}

impl<S: Source> Draw<S> {
    /// Random number between `low` and `high`.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + self.0.below(high - low)
    }

    /// Random number between 0 and 1.
    pub fn share(&mut self) -> f64 {
        self.0.below(1.0)
    }

    /// Random number between −1 and 1.
    pub fn unit(&mut self) -> f64 {
        self.within(-1.0, 1.0)
    }

    /// Power of ten between 10^`low` and 10^`high`.
    pub fn power(&mut self, low: f64, high: f64) -> f64 {
        10_f64.powf(self.within(low, high))
    }

    /// Vector with random components between −`size` and `size`.
    pub fn vector(&mut self, size: f64) -> Vector3<f64> {
        Vector3::from_fn(|_, _| self.within(-size, size))
    }

    /// Uniform random unit vector.
    pub fn direction(&mut self) -> Vector3<f64> {
        loop {
            let x = self.vector(1.0);
            if (0.01..1.0).contains(&x.norm()) {
                return x.normalize();
            }
        }
    }

    /// Random unit quaternion. It is not uniformly distributed over all rotations.
    pub fn attitude(&mut self) -> Vector4<f64> {
        Vector4::from_fn(|_, _| self.unit()).normalize()
    }
}
