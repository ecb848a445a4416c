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
/// Distance of the supporting plane from a portal at which the search ends, relative to the smaller
/// piece.
const CONVERGED: f64 = 1e-13;

/// Sine of the angle at a corner of a portal below which its plane is unknown.
const NEEDLE: f64 = 1e-9;

/// Axis of separation of a pair (unit, frame of A, from A to B).
pub(super) fn portal_axis(pair: &PiecePair<'_>) -> Vector3<f64> {
    let support = |direction: &Vector3<f64>| pair.difference(direction);
    let inside = pair.rotation * pair.b.centre() + pair.shift - pair.a.centre();
    let tolerance = CONVERGED * pair.size();
    let Some(ray) = (-inside).try_normalize(tolerance) else { return Vector3::z() };
    let mut first = support(&ray);
    let Some(across) = (first - inside).cross(&inside).try_normalize(tolerance * tolerance) else {
        // The ray passes through a point of the surface that is farthest along it.
        return -ray;
    };
    let mut second = support(&across);
    let normal =
        |first: &Vector3<f64>, second: &Vector3<f64>| (first - inside).cross(&(second - inside));
    if normal(&first, &second).dot(&inside) > 0.0 {
        std::mem::swap(&mut first, &mut second);
    }
    // A triangle that the ray pierces.
    let mut third = first;
    for _ in 0..MOST_PORTALS {
        let Some(outward) = normal(&first, &second).try_normalize(0.0) else { return -ray };
        third = support(&outward);
        if normal(&first, &third).dot(&inside) < 0.0 {
            second = third;
        } else if normal(&third, &second).dot(&inside) < 0.0 {
            first = third;
        } else {
            break;
        }
    }
    // Of all planes the one farthest from the inside is kept, because portals end as needles.
    let (mut best, mut least) = (ray, f64::INFINITY);
    for _ in 0..MOST_PORTALS {
        let (along, across) = (second - first, third - first);
        let outward = along.cross(&across).try_normalize(NEEDLE * along.norm() * across.norm());
        let Some(outward) = outward else { break };
        let is_inward = outward.dot(&(first - inside)) < 0.0;
        let outward = if is_inward { -outward } else { outward };
        let beyond = support(&outward);
        let height = outward.dot(&beyond);
        if height < least {
            (best, least) = (outward, height);
        }
        if (beyond - first).dot(&outward) <= tolerance {
            break;
        }
        // The part of the portal, divided by the new point, that the ray pierces.
        let side = (beyond - inside).cross(&inside);
        let is_left = |corner: &Vector3<f64>| (corner - inside).dot(&side) > 0.0;
        if is_left(&first) {
            if is_left(&second) { first = beyond } else { third = beyond }
        } else if is_left(&third) {
            second = beyond;
        } else {
            first = beyond;
        }
    }
    -best
}
