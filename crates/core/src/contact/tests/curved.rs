//! Unit tests of `curved.rs`.

use super::*;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn vector() -> impl Strategy<Value = Vector3<f64>> {
    proptest::array::uniform3(-1.0..1.0).prop_map(Vector3::from)
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(5), ..Default::default() })]

    /// Compares with all pairs of points on a fine grid. A segment of length up to √3 has 40
    /// intervals, so the grid leaves at most half an interval on each.
    #[test]
    fn shares_are_those_of_the_nearest_points(
        p in vector(), u in vector(), q in vector(), v in vector(), point in any::<bool>()
    ) {
        let a = Core { from: p, along: if point { Vector3::zeros() } else { u } };
        let b = Core { from: q, along: v };
        let found = closest_vector(&a, &b).1.norm();
        let net = (0..=40).flat_map(|i| (0..=40).map(move |j| (i, j)));
        let best = net
            .map(|(i, j)| (a.at(f64::from(i) / 40.0) - b.at(f64::from(j) / 40.0)).norm())
            .fold(f64::INFINITY, f64::min);
        prop_assert!(found <= best + 1e-12, "{found} {best}");
    }

    /// Checks with central differences of 1e-5 m: error 1e-10/d² of third order, 1e-16/1e-5 by
    /// rounding.
    #[test]
    fn the_derivatives_are_those_of_the_length(d in vector(), n in vector()) {
        prop_assume!(n.norm() > 0.1);
        let n = n.normalize();
        let across = (d - n * n.dot(&d)).norm();
        prop_assume!(d.norm() > 0.3 && across > 0.2);
        let at = |d: &Vector3<f64>| Reach::new(d, &n);
        let reach = at(&d);
        // The derivative jumps at the limit angle.
        prop_assume!((n.dot(&d) / d.norm() - COSINE).abs() > 1e-3);
        for k in 0..3 {
            let step = Vector3::ith(k, 1e-5);
            let (plus, minus) = (at(&(d + step)), at(&(d - step)));
            let slope = (plus.length - minus.length) / 2e-5;
            prop_assert!((slope - reach.direction[k]).abs() < 1e-8);
        }
        let was = d + Vector3::new(1e-3, 2e-3, -1e-3);
        let before = at(&was);
        let difference = reach.beyond(&d, (&was, &before));
        prop_assert!((difference - (reach.length - before.length)).abs() < 1e-15);
    }

    /// The length is at most the distance, and it is continuous at the limit angle.
    #[test]
    fn the_length_is_at_most_the_distance(d in vector(), n in vector()) {
        prop_assume!(n.norm() > 0.1 && d.norm() > 1e-3);
        let n = n.normalize();
        prop_assert!(Reach::new(&d, &n).length <= d.norm() + 1e-15);
        let across = d - n * n.dot(&d);
        prop_assume!(across.norm() > 1e-3);
        let edge = n * COSINE + across.normalize() * SINE;
        let sides = [1e-9, -1e-9].map(|by| Reach::new(&(edge + n * by), &n).length);
        prop_assert!((sides[0] - sides[1]).abs() < 1e-8);
    }
}
