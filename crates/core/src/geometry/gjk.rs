//! Close points of two cores by the algorithm of Gilbert, Johnson and Keerthi ("A fast procedure for
//! computing the distance between complex objects in three-dimensional space", IEEE Journal on
//! Robotics and Automation, 1988), from support points alone.
//!
//! Let W be the set of all differences b − a of vertices. The point of its hull that is nearest to the
//! origin is in a simplex of at most four differences. Each step takes the point v of the current
//! simplex that is nearest to the origin, and adds the difference w that is lowest along v. It ends
//! with |v|² − v·w ≤ ε |v|².

use super::pair::{highest, lowest};
use nalgebra::{Matrix3, Vector3};

/// Relative difference ε of the squared distance at which the search ends.
const ENOUGH: f64 = 1e-6;
/// Largest number of steps.
const MOST_STEPS: u32 = 64;

/// A point of each core (m, frame of A).
type Pair = [Vector3<f64>; 2];

/// One to four pairs of vertices.
#[derive(Clone, Copy)]
struct Simplex {
    corners: [Pair; 4],
    count: usize,
}

/// A point of each core (m, frame of A) whose distance is nearly the smallest. The search ends early
/// if the cores overlap to rounding.
///
/// `along` is the first direction, from A to B. `a` and `b` are the vertices.
pub(super) fn close_points(a: &[Vector3<f64>], b: &[Vector3<f64>], along: &Vector3<f64>) -> Pair {
    let support = |along: &Vector3<f64>| [a[highest(a, along).0], b[lowest(b, along).0]];
    let mut closest = support(along);
    let mut simplex = Simplex { corners: [closest; 4], count: 1 };
    for _ in 0..MOST_STEPS {
        let v = closest[1] - closest[0];
        let next = support(&v);
        if v.norm_squared() - v.dot(&(next[1] - next[0])) <= ENOUGH * v.norm_squared() {
            break;
        }
        simplex.push(next);
        let Some(nearest) = simplex.nearest_to_origin() else { break };
        (simplex, closest) = nearest;
    }
    closest
}

fn difference([a, b]: &Pair) -> Vector3<f64> {
    b - a
}

impl Simplex {
    fn push(&mut self, pair: Pair) {
        self.corners[self.count] = pair;
        self.count += 1;
    }

    /// The part whose corners are the bits of `members`.
    fn part(&self, members: u32) -> Self {
        let mut part = Self { count: 0, ..*self };
        (0..self.count)
            .filter(|at| members >> at & 1 == 1)
            .for_each(|at| part.push(self.corners[at]));
        part
    }

    /// The smallest part that contains the point of the simplex nearest to the origin, and this
    /// point. `None` if the simplex contains the origin.
    fn nearest_to_origin(&self) -> Option<(Self, Pair)> {
        let mut best: Option<(f64, Self, Pair)> = None;
        for members in 1..1_u32 << self.count {
            let part = self.part(members);
            let Some(point) = part.nearest_inside() else { continue };
            let square = difference(&point).norm_squared();
            if best.is_none_or(|best| square < best.0) {
                best = Some((square, part, point));
            }
        }
        best.filter(|(_, part, _)| part.count < 4).map(|(_, part, point)| (part, point))
    }

    /// The point nearest to the origin of the line or plane through all corners, if it is between
    /// them.
    ///
    /// With the corners w₀, w₁, … and D = (w₁ − w₀, …), it is w₀ + Dλ with DᵀDλ = −Dᵀw₀. It is
    /// between the corners if all λ and 1 − Σλ are positive.
    fn nearest_inside(&self) -> Option<Pair> {
        let (first, others) = (self.corners[0], &self.corners[1..self.count]);
        let (mut edges, mut gram) = (Matrix3::zeros(), Matrix3::identity());
        for (at, corner) in others.iter().enumerate() {
            edges.set_column(at, &(difference(corner) - difference(&first)));
            gram[(at, at)] = 0.0;
        }
        gram += edges.tr_mul(&edges);
        let shares = gram.lu().solve(&-edges.tr_mul(&difference(&first)))?;
        let shares = &shares.as_slice()[..others.len()];
        let is_between =
            shares.iter().all(|&share| share > 0.0) && shares.iter().sum::<f64>() < 1.0;
        let mut point = first;
        for (share, corner) in shares.iter().zip(others) {
            for side in 0..2 {
                point[side] += (corner[side] - first[side]) * *share;
            }
        }
        is_between.then_some(point)
    }
}
