//! Separation of smooth pieces by portal refinement (Snethen, "XenoCollide: complex collision made
//! simple", Game Programming Gems 7, 2008), from support points alone.
//!
//! Let W be the set of all differences b − a of points of B and A. The pieces overlap if W contains
//! the origin. The ray from a point inside W to the origin leaves W at a point x. The search finds
//! the supporting plane of W at x, by triangles ("portals") of points on the surface of W that the
//! ray pierces. The inward normal n of this plane is an axis from A to B. Its gap
//!
//! ```text
//! s = min_W n·w ≤ separation
//! ```
//!
//! has the sign of the separation. For pieces that touch, both are equal. Otherwise they differ by
//! at most s² tan²φ/(2 R), with φ the angle between n and the ray, and R the radius of curvature.

use super::pair::PiecePair;
use nalgebra::Vector3;

/// Largest number of portals. Each one halves the size of the triangle, or better.
const MOST_PORTALS: u32 = 80;
/// Smallest useful distance of the supporting plane from a portal, relative to the smaller piece.
pub(super) const TIGHT: f64 = 1e-13;

/// Sine of the angle at a corner of a portal below which its plane is unknown.
const NEEDLE: f64 = 1e-9;

/// Search for the supporting plane of W at the point where the ray leaves it.
pub(super) struct Portal<'p> {
    pair: &'p PiecePair<'p>,
    /// Start of the ray, inside W.
    inside: Vector3<f64>,
    /// Corners of a triangle that the ray pierces. `None` if the ray leaves W at the point that is
    /// farthest along it.
    corners: Option<[Vector3<f64>; 3]>,
    /// Outward normal of the plane that is farthest from the inside, and its height over the origin.
    /// It is kept because triangles end as needles.
    best: (Vector3<f64>, f64),
}

impl<'p> Portal<'p> {
    /// Finds a first triangle.
    pub(super) fn new(pair: &'p PiecePair<'p>) -> Self {
        let inside = pair.rotation * pair.b.centre() + pair.shift - pair.a.centre();
        let ray = (-inside).try_normalize(TIGHT * pair.size()).unwrap_or_else(Vector3::z);
        let corners = first_triangle(pair, &inside, &ray);
        Self { pair, inside, corners, best: (ray, f64::INFINITY) }
    }

    /// Axis of separation (unit, frame of A, from A to B). The plane is within `tolerance` (m) of a
    /// triangle, or of what rounding permits.
    pub(super) fn axis(&mut self, tolerance: f64) -> Vector3<f64> {
        for _ in 0..MOST_PORTALS {
            let Some([first, second, third]) = self.corners else { break };
            let (along, across) = (second - first, third - first);
            let outward = along.cross(&across).try_normalize(NEEDLE * along.norm() * across.norm());
            let Some(outward) = outward else { break };
            let is_inward = outward.dot(&(first - self.inside)) < 0.0;
            let outward = if is_inward { -outward } else { outward };
            let beyond = self.pair.difference(&outward);
            let height = outward.dot(&beyond);
            if height < self.best.1 {
                self.best = (outward, height);
            }
            if (beyond - first).dot(&outward) <= tolerance {
                break;
            }
            // The part of the triangle, divided by the new point, that the ray pierces.
            let side = (beyond - self.inside).cross(&self.inside);
            let is_left = |corner: &Vector3<f64>| (corner - self.inside).dot(&side) > 0.0;
            self.corners = Some(match (is_left(&first), is_left(&second), is_left(&third)) {
                (true, true, _) | (false, _, false) => [beyond, second, third],
                (true, false, _) => [first, second, beyond],
                (false, _, true) => [first, beyond, third],
            });
        }
        -self.best.0
    }
}

/// Corners of a triangle of points on the surface of W that the ray from `inside` to the origin
/// pierces.
fn first_triangle(
    pair: &PiecePair<'_>,
    inside: &Vector3<f64>,
    ray: &Vector3<f64>,
) -> Option<[Vector3<f64>; 3]> {
    let mut first = pair.difference(ray);
    let tiny = TIGHT * pair.size();
    let across = (first - inside).cross(inside).try_normalize(tiny * tiny)?;
    let mut second = pair.difference(&across);
    let normal =
        |first: &Vector3<f64>, second: &Vector3<f64>| (first - inside).cross(&(second - inside));
    if normal(&first, &second).dot(inside) > 0.0 {
        std::mem::swap(&mut first, &mut second);
    }
    let mut third = first;
    for _ in 0..MOST_PORTALS {
        third = pair.difference(&normal(&first, &second).try_normalize(0.0)?);
        if normal(&first, &third).dot(inside) < 0.0 {
            second = third;
        } else if normal(&third, &second).dot(inside) < 0.0 {
            first = third;
        } else {
            break;
        }
    }
    Some([first, second, third])
}
