//! Random numbers as numpy draws them: the start of the drop [scene](crate::simulation::scene).

use nalgebra::Vector4;
use rand_mt::Mt;

/// The first four doubles of `numpy.random.RandomState(seed).rand(4)`, bit for bit:
/// Mersenne twister MT19937, 53 bits a number.
#[must_use]
pub fn numpy_rand4(seed: u32) -> [f64; 4] {
    let mut twister = Mt::new(seed);
    std::array::from_fn(|_| {
        // genrand_res53 of Matsumoto and Nishimura: 27 high bits, then 26 low bits.
        let high = f64::from(twister.next_u32() >> 5);
        let low = f64::from(twister.next_u32() >> 6);
        (high * 67_108_864.0 + low) / 9_007_199_254_740_992.0
    })
}

/// The attitude of the drop scene: [`numpy_rand4`] divided by its norm, (w, x, y, z), the
/// squares added from left to right as numpy does: the same doubles. No seed draws four
/// zeros.
#[must_use]
pub fn random_attitude(seed: u32) -> Vector4<f64> {
    let draws = numpy_rand4(seed);
    let norm = draws.iter().map(|draw| draw * draw).sum::<f64>().sqrt();
    Vector4::from(draws) / norm
}
