//! Arithmetic that tracks the size of the terms of a value, of its gradient in 19 variables and of
//! its curvature.
//!
//! A sum of products in double precision has an error of some ε times the sum of the terms'
//! absolute values, even where the terms cancel. Every sum here is a sum of absolute values:
//!
//! ```text
//! |a ± b| → |a| + |b|,   (ab)_i → |a_i||b| + |a||b_i|,   (ab)_ij → |a_ij||b| + |a_i||b_j| + …
//! ```
//!
//! The base u of a power u^k is a sum itself, with an error of ε times its terms. The power
//! therefore counts κ = (terms of u)/|u| times.

use std::array::from_fn;
use std::ops::{Add, Mul, Sub};

/// Number of variables: X⁺ (13) and one contact's f_x, f_y, f_z, s1, s2, λ.
pub const VARIABLES: usize = 19;

/// Value, and the sizes of the terms of the value, its gradient and its curvature.
#[derive(Debug, Clone, Copy)]
pub struct Terms {
    value: f64,
    pub size: f64,
    pub slope: [f64; VARIABLES],
    pub curvature: [[f64; VARIABLES]; VARIABLES],
}

impl Terms {
    pub fn constant(value: f64) -> Self {
        let curvature = [[0.0; VARIABLES]; VARIABLES];
        Self { value, size: value.abs(), slope: [0.0; VARIABLES], curvature }
    }

    pub fn variable(index: usize, value: f64) -> Self {
        let mut variable = Self::constant(value);
        variable.slope[index] = 1.0;
        variable
    }

    /// u^k for u > 0.
    pub fn power(self, k: f64) -> Self {
        let (u, condition) = (self.value, self.size / self.value.abs());
        let [size, first, second] =
            [u.powf(k), k * u.powf(k - 1.0), k * (k - 1.0) * u.powf(k - 2.0)]
                .map(|derivative| derivative.abs() * condition);
        Self {
            value: u.powf(k),
            size,
            slope: self.slope.map(|slope| first * slope),
            curvature: from_fn(|i| {
                from_fn(|j| first * self.curvature[i][j] + second * self.slope[i] * self.slope[j])
            }),
        }
    }
}

impl Add for Terms {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            size: self.size + other.size,
            slope: from_fn(|i| self.slope[i] + other.slope[i]),
            curvature: from_fn(|i| from_fn(|j| self.curvature[i][j] + other.curvature[i][j])),
        }
    }
}

impl Sub for Terms {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + other * -1.0
    }
}

impl Mul for Terms {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let (a, b) = (&self, &other);
        Self {
            value: a.value * b.value,
            size: a.size * b.size,
            slope: from_fn(|i| a.slope[i] * b.size + a.size * b.slope[i]),
            curvature: from_fn(|i| {
                from_fn(|j| {
                    a.curvature[i][j] * b.size
                        + a.slope[i] * b.slope[j]
                        + a.slope[j] * b.slope[i]
                        + a.size * b.curvature[i][j]
                })
            }),
        }
    }
}

impl Mul<f64> for Terms {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        self * Self::constant(factor)
    }
}
