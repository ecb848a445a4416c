//! Closest points of segments.

use nalgebra::Vector3;

/// Parameters s and t of the closest points p + s u and q + t v, 0 ≤ s, t ≤ 1.
///
/// Either segment may be a point. Parallel segments can have many closest pairs; the result is then
/// the closest pair nearest to s = 0.
#[inline(always)]
pub fn closest_segment_parameters(
    p: &Vector3<f64>,
    u: &Vector3<f64>,
    q: &Vector3<f64>,
    v: &Vector3<f64>,
) -> (f64, f64) {
    let (uu, vv, uv) = (u.norm_squared(), v.norm_squared(), u.dot(v));
    let (ur, vr) = (u.dot(&(q - p)), v.dot(&(q - p)));
    // The optimal s for a given t, and the optimal t for a given s.
    let s_of = |t: f64| if uu > 0.0 { ((ur + t * uv) / uu).clamp(0.0, 1.0) } else { 0.0 };
    let t_of = |s: f64| if vv > 0.0 { ((s * uv - vr) / vv).clamp(0.0, 1.0) } else { 0.0 };
    let determinant = uu * vv - uv * uv;
    let free = if determinant > 1e-14 * uu * vv {
        ((ur * vv - vr * uv) / determinant).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let t = t_of(free);
    (s_of(t), t)
}

/// Closest point to `point` on the segment q + t v, 0 ≤ t ≤ 1.
pub(crate) fn closest_on_segment(
    point: &Vector3<f64>,
    q: &Vector3<f64>,
    v: &Vector3<f64>,
) -> Vector3<f64> {
    q + v * (v.dot(&(point - q)) / v.norm_squared()).clamp(0.0, 1.0)
}
