//! Random numbers identical to numpy's, for the initial states of the drop
//! [scene](crate::simulation::scene) and of piles.

use nalgebra::Vector4;
use rand_mt::Mt;
use std::f64::consts::TAU;

/// Sequence of doubles of `numpy.random.RandomState(seed)`, bit for bit: Mersenne twister MT19937,
/// 53 bits per number.
#[derive(Debug, Clone)]
pub struct Draws {
    twister: Mt,
}

impl Draws {
    /// Creates the sequence of `seed`.
    pub fn new(seed: u32) -> Self {
        Self { twister: Mt::new(seed) }
    }

    /// Next number u, 0 ≤ u < 1.
    pub fn unit(&mut self) -> f64 {
        // genrand_res53 of Matsumoto and Nishimura: 27 high bits, then 26 low bits.
        let high = f64::from(self.twister.next_u32() >> 5);
        let low = f64::from(self.twister.next_u32() >> 6);
        (high * 67_108_864.0 + low) / 9_007_199_254_740_992.0
    }

    /// Uniformly distributed attitude (w, x, y, z) from three draws u₁, u₂, u₃:
    ///
    /// ```text
    /// q = (√(1 − u₁) sin 2πu₂, √(1 − u₁) cos 2πu₂, √u₁ sin 2πu₃, √u₁ cos 2πu₃)
    /// ```
    pub fn attitude(&mut self) -> Vector4<f64> {
        let share = self.unit();
        let (first, second) = (TAU * self.unit(), TAU * self.unit());
        let (large, small) = ((1.0 - share).sqrt(), share.sqrt());
        let (one, two) = (libm::sincos(first), libm::sincos(second));
        Vector4::new(large * one.0, large * one.1, small * two.0, small * two.1).normalize()
    }

    /// The tutorial's attitude (w, x, y, z): four draws divided by their norm. Squares are added
    /// from left to right as in numpy, for identical doubles. No seed draws four zeros.
    pub fn tutorial_attitude(&mut self) -> Vector4<f64> {
        let draws = self.four();
        let norm = draws.iter().map(|draw| draw * draw).sum::<f64>().sqrt();
        Vector4::from(draws) / norm
    }

    fn four(&mut self) -> [f64; 4] {
        std::array::from_fn(|_| self.unit())
    }
}

/// First four doubles of `numpy.random.RandomState(seed).rand(4)`.
pub fn numpy_rand4(seed: u32) -> [f64; 4] {
    Draws::new(seed).four()
}

/// Attitude of the drop scene: the first [`Draws::tutorial_attitude`] of `seed`.
pub fn random_attitude(seed: u32) -> Vector4<f64> {
    Draws::new(seed).tutorial_attitude()
}
