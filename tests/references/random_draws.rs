//! Random initial attitudes are those that NumPy draws.

use crate::common::reference;
use tumble_core::simulation::random::{Draws, numpy_rand4, random_attitude};

/// Numbers of the array `key` in an object of `numpy_draws.json`. The standard library parses them,
/// because it rounds correctly. serde_json may have an error of one unit in the last place.
fn numbers(object: &str, key: &str) -> Vec<f64> {
    let (_, rest) = object.split_once(&format!("\"{key}\": [")).unwrap();
    let (list, _) = rest.split_once(']').unwrap();
    list.split(',').map(|number| number.trim().parse().unwrap()).collect()
}

fn draws() -> Vec<(u32, Vec<f64>, Vec<f64>)> {
    let text = reference("numpy_draws.json");
    let objects = text.lines().filter(|line| line.starts_with('{'));
    let draw = |object: &str| {
        let (_, seed) = object.split_once("\"seed\": ").unwrap();
        let (seed, _) = seed.split_once(',').unwrap();
        (seed.parse().unwrap(), numbers(object, "draws"), numbers(object, "quaternion"))
    };
    objects.map(draw).collect()
}

#[test]
fn draws_are_numpys_bit_for_bit() {
    let draws = draws();
    assert_eq!(draws.len(), 43);
    for (seed, draws, _) in draws {
        let ours = numpy_rand4(seed).map(f64::to_bits);
        let theirs: Vec<_> = draws.iter().map(|draw| draw.to_bits()).collect();
        assert_eq!(ours, *theirs, "seed {seed}");
    }
}

/// Checks attitudes bit for bit. They consist of products, sums from the left, a square root and a
/// quotient, each rounded correctly on every machine.
#[test]
fn attitudes_are_the_normalised_draws_bit_for_bit() {
    for (seed, _, quaternion) in draws() {
        for (ours, theirs) in random_attitude(seed).iter().zip(quaternion) {
            assert_eq!(ours.to_bits(), theirs.to_bits(), "seed {seed}: {ours} and {theirs}");
        }
    }
}

/// Checks that random attitudes have length 1 and are uniform. The mean of q qᵀ is ¼ E, to a few
/// 1/√n.
#[test]
fn attitudes_prefer_no_direction() {
    const COUNT: usize = 20_000;
    let mut draws = Draws::new(5);
    let mut mean = nalgebra::Matrix4::<f64>::zeros();
    for _ in 0..COUNT {
        let attitude = draws.attitude();
        assert!((attitude.norm() - 1.0).abs() < 1e-15);
        mean += attitude * attitude.transpose() / COUNT as f64;
    }
    // A diagonal entry has the variance 3/24 − 1/16 = 1/16. The tolerance is five times 1/(4 √n).
    let off = (mean - nalgebra::Matrix4::identity() * 0.25).amax();
    assert!(off < 1.25 / (COUNT as f64).sqrt(), "{off}");
}
