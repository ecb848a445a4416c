//! Unit tests of `refined.rs`.

use super::Rng;

/// The rows of a face's corners depend on each other by ±1, those of points along an edge by
/// 1, −2, 1. Random numbers must reveal both, at any position in the list.
#[test]
fn random_numbers_have_no_small_subset_sum_of_zero() {
    let mut rng = Rng::default();
    let drawn: Vec<f64> = (0..96).map(|_| rng.next()).collect();
    assert!(drawn.iter().all(|x| x.abs() <= 0.5));
    for from in 0..24 {
        for apart in 1..24 {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| drawn[from + k * apart]);
            for (what, sum) in [("face", a - b - c + d), ("edge", a - 2.0 * b + c)] {
                let whole = (sum - sum.round()).abs();
                assert!(whole > 1e-5, "{what} of {from} and {apart}: {sum}");
            }
        }
    }
}
