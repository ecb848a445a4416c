//! The gap between two rounded features that are no faces: a vertex or an edge against another.
//!
//! Each is a [`Core`], a point or a segment, within a radius. With D the shortest way from the core
//! of B to that of A, the gap is known exactly wherever the bodies are,
//!
//! ```text
//! φ = |D| − ρ_A − ρ_B,   D = p_A + s u_A − p_B − t u_B,   0 ≤ s, t ≤ 1       (eq. 4a)
//! ```
//!
//! and grows with the bodies' motion along D/|D| alone, because s and t are the best ones. A step
//! asks for it at k+1, while its force acts along the normal at k. So that a body cannot come out on
//! the other side within a step, |D| is taken for what it is only where D has turned by less than
//! 60° from that normal, and beyond is continued by a plane,
//!
//! ```text
//! |D|_n = max { m·D : |m| = 1, m·n ≥ ½ } ≤ |D|,                           (eq. 4b)
//! ```
//!
//! the distance from the cone behind the other's core.

use crate::geometry::nearest_shares;
use nalgebra::{Matrix3, Vector3};

/// c of eq. 4b: the cosine of the angle that the shortest way may turn by in a step.
const COSINE: f64 = 0.5;
/// Its sine.
const SINE: f64 = 0.866_025_403_784_438_6;

/// A shorter way has no direction, m.
const SMALLEST: f64 = 1e-100;

/// A point, or a segment from `from` to `from + along`, m.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Core {
    /// The point, or the segment's first end.
    pub from: Vector3<f64>,
    /// To its second end; zero for a point.
    pub along: Vector3<f64>,
}

impl Core {
    /// The point `from + share · along`.
    #[must_use]
    pub fn at(&self, share: f64) -> Vector3<f64> {
        self.from + self.along * share
    }

    /// Whether it is a segment.
    #[must_use]
    pub fn is_segment(&self) -> bool {
        self.along != Vector3::zeros()
    }

    /// This core, turned and moved.
    #[must_use]
    pub fn moved(&self, rotation: &Matrix3<f64>, position: &Vector3<f64>) -> Self {
        Self { from: position + rotation * self.from, along: rotation * self.along }
    }
}

/// What a contact of two rounded features knows beyond its tangent plane at k.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "save", derive(serde::Serialize, serde::Deserialize))]
pub struct Curved {
    /// The core of A, frame of A.
    pub of_a: Core,
    /// That of B, frame of B or of the fixed world.
    pub of_b: Core,
    /// ρ_B, m.
    pub radius: f64,
    /// Where along their cores A and B are nearest to each other at k: s, t.
    pub shares: (f64, f64),
}

impl Curved {
    /// The point of A's core that is nearest at k, m, frame of A.
    #[must_use]
    pub fn point(&self) -> Vector3<f64> {
        self.of_a.at(self.shares.0)
    }

    /// The point of B's core that is nearest at k, m, frame of B.
    #[must_use]
    pub fn foot(&self) -> Vector3<f64> {
        self.of_b.at(self.shares.1)
    }

    /// With all lengths `factor` times as long.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let core = |core: &Core| Core { from: core.from * factor, along: core.along * factor };
        Self {
            of_a: core(&self.of_a),
            of_b: core(&self.of_b),
            radius: self.radius * factor,
            shares: self.shares,
        }
    }
}

/// The points of two cores that are nearest to each other: their shares s and t, and the way D from
/// that of `b` to that of `a`, m.
#[must_use]
pub fn shortest_way(a: &Core, b: &Core) -> ((f64, f64), Vector3<f64>) {
    let shares = nearest_shares(&a.from, &a.along, &b.from, &b.along);
    (shares, a.at(shares.0) - b.at(shares.1))
}

/// |D|_n (eq. 4b) and its derivatives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reach {
    /// m.
    pub length: f64,
    /// The m that the maximum is at, unit: ∂|D|_n/∂D.
    pub direction: Vector3<f64>,
    /// Whether it is |D| itself.
    pub is_exact: bool,
}

impl Reach {
    /// That of the way `d` (m) where the unit normal at k is `normal`.
    #[must_use]
    pub fn of(d: &Vector3<f64>, normal: &Vector3<f64>) -> Self {
        let (length, along) = (d.norm(), normal.dot(d));
        if along >= COSINE * length {
            let direction = if length > 0.0 { d / length } else { *normal };
            return Self { length, direction, is_exact: true };
        }
        // Straight behind, every direction across is as good.
        let across = (d - normal * along).try_normalize(SMALLEST).unwrap_or_else(|| {
            let axis = Vector3::ith(normal.iamin(), 1.0);
            (axis - normal * normal.dot(&axis)).normalize()
        });
        let direction = COSINE * normal + SINE * across;
        Self { length: direction.dot(d), direction, is_exact: false }
    }

    /// ∂²|D|_n/∂D², 1/m: (E − m mᵀ)/|D|; beyond the angle the same across the normal alone.
    #[must_use]
    pub fn curvature(&self, d: &Vector3<f64>, normal: &Vector3<f64>) -> Matrix3<f64> {
        let (way, factor) =
            if self.is_exact { (*d, 1.0) } else { (d - normal * normal.dot(d), SINE) };
        let length = way.norm();
        if length <= SMALLEST {
            return Matrix3::zeros();
        }
        let unit = way / length;
        let mut round = Matrix3::identity() - unit * unit.transpose();
        if !self.is_exact {
            round -= normal * normal.transpose();
        }
        round * (factor / length)
    }

    /// |D|_n less the distance `before` of a way that was `was` (m), without loss of digits.
    #[must_use]
    pub fn beyond(&self, d: &Vector3<f64>, was: &Vector3<f64>, before: f64) -> f64 {
        if self.is_exact && self.length + before > 0.0 {
            return (d - was).dot(&(d + was)) / (self.length + before);
        }
        self.length - before
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use proptest::test_runner::RngSeed;

    fn vector() -> impl Strategy<Value = Vector3<f64>> {
        proptest::array::uniform3(-1.0..1.0).prop_map(Vector3::from)
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(5), ..Default::default() })]

        /// No pair of points of a fine net is nearer, and the net comes near: 40 places a side of
        /// segments of length up to √3 leave at most half a place each.
        #[test]
        fn shares_are_those_of_the_nearest_points(
            p in vector(), u in vector(), q in vector(), v in vector(), point in any::<bool>()
        ) {
            let a = Core { from: p, along: if point { Vector3::zeros() } else { u } };
            let b = Core { from: q, along: v };
            let found = shortest_way(&a, &b).1.norm();
            let net = (0..=40).flat_map(|i| (0..=40).map(move |j| (i, j)));
            let best = net
                .map(|(i, j)| (a.at(f64::from(i) / 40.0) - b.at(f64::from(j) / 40.0)).norm())
                .fold(f64::INFINITY, f64::min);
            prop_assert!(found <= best + 1e-12, "{found} {best}");
        }

        /// Central differences of 1e-5 m: of third order 1e-10/d², of rounding 1e-16/1e-5.
        #[test]
        fn the_derivatives_are_those_of_the_length(d in vector(), n in vector()) {
            prop_assume!(n.norm() > 0.1);
            let n = n.normalize();
            let across = (d - n * n.dot(&d)).norm();
            prop_assume!(d.norm() > 0.3 && across > 0.2);
            let at = |d: &Vector3<f64>| Reach::of(d, &n);
            let reach = at(&d);
            // Away from where the kind changes: the second derivative jumps there.
            prop_assume!((n.dot(&d) / d.norm() - COSINE).abs() > 1e-3);
            let curvature = reach.curvature(&d, &n);
            for k in 0..3 {
                let step = Vector3::ith(k, 1e-5);
                let (plus, minus) = (at(&(d + step)), at(&(d - step)));
                let slope = (plus.length - minus.length) / 2e-5;
                prop_assert!((slope - reach.direction[k]).abs() < 1e-8);
                let bend = (plus.direction - minus.direction) / 2e-5;
                prop_assert!((bend - curvature.column(k)).norm() < 1e-6);
            }
            let was = d + Vector3::new(1e-3, 2e-3, -1e-3);
            let before = was.norm();
            prop_assert!((reach.beyond(&d, &was, before) - (reach.length - before)).abs() < 1e-15);
        }

        /// It is never more than the distance, and continuous where the kind changes.
        #[test]
        fn the_length_is_at_most_the_distance(d in vector(), n in vector()) {
            prop_assume!(n.norm() > 0.1 && d.norm() > 1e-3);
            let n = n.normalize();
            prop_assert!(Reach::of(&d, &n).length <= d.norm() + 1e-15);
            let across = d - n * n.dot(&d);
            prop_assume!(across.norm() > 1e-3);
            let edge = n * COSINE + across.normalize() * SINE;
            let sides = [1e-9, -1e-9].map(|by| Reach::of(&(edge + n * by), &n).length);
            prop_assert!((sides[0] - sides[1]).abs() < 1e-8);
        }
    }
}
