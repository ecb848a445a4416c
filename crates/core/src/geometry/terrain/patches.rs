//! Patches: connected triangles in one plane.
//!
//! A contact with a plane keeps its key while it crosses the seams of a patch, so the forces of the
//! last step are found again.

use nalgebra::Vector3;

/// Distance of a triangle's corners from the plane of a patch below which it belongs to the patch,
/// as a fraction of the first triangle's longest side.
const IN_PLANE: f64 = 1e-9;

/// Number of roundings in the coordinates of a terrain that is turned and moved.
const ROUNDINGS: f64 = 16.0;

/// First triangle of each triangle's patch; empty if all triangles are alone.
///
/// `corners` returns the corners of a triangle (m), and `each_beside` visits the triangles at its
/// sides.
pub(super) fn patches(
    count: usize,
    corners: impl Fn(usize) -> [Vector3<f64>; 3],
    each_beside: impl Fn(usize, &mut dyn FnMut(usize)),
) -> Vec<u32> {
    const NONE: u32 = u32::MAX;
    let mut first = vec![NONE; count];
    let mut waiting = Vec::new();
    let mut has_seams = false;
    for seed in 0..count {
        if first[seed] != NONE {
            continue;
        }
        let [a, b, c] = corners(seed);
        let normal = (b - a).cross(&(c - a)).normalize();
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        let near = IN_PLANE * longest + ROUNDINGS * f64::EPSILON * a.amax();
        let is_in_plane = |triangle: usize| {
            corners(triangle).iter().all(|corner| normal.dot(&(corner - a)).abs() <= near)
        };
        first[seed] = seed as u32;
        waiting.push(seed);
        while let Some(triangle) = waiting.pop() {
            each_beside(triangle, &mut |other| {
                if first[other] == NONE && is_in_plane(other) {
                    first[other] = seed as u32;
                    has_seams = true;
                    waiting.push(other);
                }
            });
        }
    }
    if has_seams { first } else { Vec::new() }
}
