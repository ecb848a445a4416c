//! Random inputs with a fixed seed: the program must not panic, hang or accept invalid input.

use crate::common;

mod program;
mod rows;
mod solvers;
mod steps;
mod trajectory;
mod values;
mod verify;

use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};
use std::fmt::Debug;

/// Checks `count` values of `strategy` with the same seed on every machine.
fn each<T: Debug>(
    count: u32,
    strategy: impl Strategy<Value = T>,
    check: impl Fn(T) -> Result<(), TestCaseError>,
) {
    let config = ProptestConfig {
        rng_seed: RngSeed::Fixed(71),
        // Shrinking reruns the program and takes minutes. The first failing value is usually clear
        // enough.
        max_shrink_iters: 200,
        ..common::cases(count)
    };
    let outcome = TestRunner::new(config).run(&strategy, check);
    outcome.unwrap_or_else(|failure| panic!("{failure}"));
}

/// Strategy for any double with uniform bit patterns, including NaN, infinities and subnormals.
fn any_bits() -> impl Strategy<Value = f64> {
    any::<u64>().prop_map(f64::from_bits)
}

/// Strategy for any finite double.
fn finite() -> impl Strategy<Value = f64> {
    any_bits().prop_map(|value| {
        // Clears the highest bit of an exponent of all ones.
        if value.is_finite() { value } else { f64::from_bits(value.to_bits() & !(1 << 62)) }
    })
}

/// Strategy for unusual numbers: any bits, edge cases, or a power of ten.
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
