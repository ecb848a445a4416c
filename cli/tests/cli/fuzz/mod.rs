//! Input of every kind, drawn at random but the same every time: nothing panics, hangs or is
//! taken for what it is not.

use crate::common;

mod inspect_verify;
mod program;
mod rows;
mod solvers;
mod steps;
mod trajectory;
mod values;

use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};
use std::fmt::Debug;

/// Checks `count` values of `strategy`, the same ones on every machine.
fn each<T: Debug>(
    count: u32,
    strategy: impl Strategy<Value = T>,
    check: impl Fn(T) -> Result<(), TestCaseError>,
) {
    let config = ProptestConfig {
        rng_seed: RngSeed::Fixed(71),
        // Shrinking a run of the program takes minutes; the first failure says enough.
        max_shrink_iters: 200,
        ..common::cases(count)
    };
    let outcome = TestRunner::new(config).run(&strategy, check);
    outcome.unwrap_or_else(|failure| panic!("{failure}"));
}

/// Any double, every pattern of bits as likely as any other: NaN, infinities, subnormals.
fn any_bits() -> impl Strategy<Value = f64> {
    any::<u64>().prop_map(f64::from_bits)
}

/// Any finite double.
fn finite() -> impl Strategy<Value = f64> {
    any_bits().prop_map(|value| {
        // An exponent of all ones loses its highest bit.
        if value.is_finite() { value } else { f64::from_bits(value.to_bits() & !(1 << 62)) }
    })
}

/// A number that is out of the ordinary: any bits, or an edge of something.
fn wild() -> impl Strategy<Value = f64> {
    let edges = [
        0.0,
        -0.0,
        1.0,
        -1.0,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
        f64::MIN_POSITIVE,
        5e-324,
        f64::MAX,
        f64::MIN,
        f64::EPSILON,
    ];
    let powers = (-14_i32..14, -1.0..1.0_f64).prop_map(|(power, x)| x * 10_f64.powi(power));
    prop_oneof![any_bits(), proptest::sample::select(edges.to_vec()), powers]
}
