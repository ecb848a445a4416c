//! Unit tests of `quaternion.rs`.

use super::*;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(3), ..Default::default() })]

    #[test]
    fn quaternion_product_is_the_matrix_product(p in proptest::array::uniform4(-1.0..1.0), q in proptest::array::uniform4(-1.0..1.0)) {
        let (p, q) = (Vector4::from(p), Vector4::from(q));
        prop_assert!((product(&p, &q) - left(&p) * q).amax() < 1e-15);
        prop_assert!((product(&p, &q) - right(&q) * p).amax() < 1e-15);
    }
}

fn quaternion() -> impl Strategy<Value = Vector4<f64>> {
    proptest::array::uniform4(-1.0..1.0)
        .prop_map(Vector4::from)
        .prop_filter("not zero", |q| q.norm() > 0.1)
}

fn vector() -> impl Strategy<Value = Vector3<f64>> {
    proptest::array::uniform3(-2.0..2.0).prop_map(Vector3::from)
}

proptest! {
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(3), ..Default::default() })]

    // Tolerances: sums of at most 16 products of numbers up to 2, so 1e-14.
    #[test]
    fn the_closed_forms_are_the_products_of_the_maps(q in quaternion(), p in quaternion()) {
        prop_assert!((left(&q) * p - right(&p) * q).norm() < 1e-14);
        prop_assert!((left(&q) * pure() - attitude_map(&q)).norm() < 1e-14);
        let a = pure().transpose() * left(&q) * right(&q).transpose() * pure();
        prop_assert!((rotation(&q) - a).norm() < 1e-14);
    }

    #[test]
    fn normalising_twice_changes_no_bit(q in quaternion()) {
        let once = unit(q);
        prop_assert!((once - q / q.norm()).norm() < 1e-15);
        prop_assert_eq!(unit(once), once);
    }

    #[test]
    fn a_unit_quaternion_gives_a_rotation(q in quaternion()) {
        let a = rotation(&q.normalize());
        prop_assert!((a * a.transpose() - Matrix3::identity()).norm() < 1e-14);
        prop_assert!((a.determinant() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn the_quadratic_forms_give_the_rotated_point(q in quaternion(), c in vector()) {
        let expected = rotation(&q) * c;
        for (k, form) in rotated_point_forms(&c).iter().enumerate() {
            prop_assert_eq!(*form, form.transpose());
            prop_assert!((0.5 * q.dot(&(form * q)) - expected[k]).abs() < 1e-14);
        }
    }

    /// Rotations up to 2 atan(½ · 0.5 · √12) ≈ 82°; rounding errors are 1e-15/h.
    #[test]
    fn the_turning_rate_is_the_spin_of_the_step(q in quaternion(), spin in vector()) {
        let (q, h) = (q.normalize(), 0.5);
        let (from, to) = (rotation(&q), rotation(&advance(&q, &spin, h)));
        prop_assert!((turning_rate(&from, &to, h) - from * spin).norm() < 1e-13);
    }

    #[test]
    fn advance_agrees_with_the_exponential_to_third_order(
        q in quaternion(), spin in vector()
    ) {
        // Error of one step of the scheme: tan(θ/2) ≈ θ/2 + θ³/24 with θ = h|ω|.
        let (q, h) = (q.normalize(), 1e-3);
        let half = 0.5 * h * spin.norm();
        let axis = spin / spin.norm().max(1e-300);
        let exact = left(&q) * Vector4::new(
            half.cos(), half.sin() * axis[0], half.sin() * axis[1], half.sin() * axis[2],
        );
        prop_assert!((advance(&q, &spin, h) - exact).norm() <= half.powi(3) + 1e-15);
    }
}
