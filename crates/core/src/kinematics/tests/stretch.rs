//! Unit tests of `stretch.rs`.

use super::*;

/// s of a rotation by `angle` (rad).
fn at(angle: f64) -> f64 {
    0.25 * angle * angle
}

#[test]
fn the_series_is_the_tangent_over_its_argument() {
    // The next term is 62 x⁸/2835; the angle is 2 x.
    for (angle, bound) in [(1e-3, 1e-15), (0.2, 3e-10), (0.6, 2e-6), (1.0, 1.2e-4)] {
        let x = 0.5 * angle;
        let gamma = Stretch::new(at(angle)).gamma.value;
        assert!((gamma - libm::tan(x) / x).abs() < bound, "{angle}");
    }
}

#[test]
fn derivatives_are_those_of_differences() {
    // Central differences of 1e-4: the error of third derivatives up to 10 is 2e-8.
    let (step, bound) = (1e-4, 1e-7);
    for s in [0.0, 0.01, 0.3, 1.0, 2.5] {
        let curves = |s: f64| {
            let stretch = Stretch::new(s);
            let [alpha, beta] = stretch.momentum_factors();
            [stretch.gamma, alpha, beta]
        };
        let (below, here, above) = (curves(s - step), curves(s), curves(s + step));
        for ((below, here), above) in below.iter().zip(here).zip(above) {
            assert!((0.5 * (above.value - below.value) / step - here.slope).abs() < bound);
            assert!((0.5 * (above.slope - below.slope) / step - here.bend).abs() < bound);
        }
    }
}

#[test]
fn a_ball_has_the_momentum_of_its_spin() {
    // α + s β = (1 + s γ²)/(γ + 2 s γ′) is 1 as far as the series is that of the tangent.
    for (angle, bound) in [(1e-3, 1e-15), (0.2, 2e-9), (0.6, 1.4e-5)] {
        let stretch = Stretch::new(at(angle));
        let [alpha, beta] = stretch.momentum_factors();
        assert!((alpha.value + stretch.s * beta.value - 1.0).abs() < bound, "{angle}");
    }
}

#[test]
fn the_inverse_has_the_same_functions() {
    for s in [0.0, 1e-12, 1e-3, 0.4, 3.0, 50.0, 1e4] {
        let gamma = Stretch::new(s).gamma.value;
        let found = Stretch::inverse(s * gamma * gamma).s;
        assert!((found - s).abs() <= 1e-14 * s, "{s}: {found}");
    }
}
