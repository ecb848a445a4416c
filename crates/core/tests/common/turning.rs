//! Rotation of a step in the momentum form, written independently of the crate (eqs. 8e and 34 of
//! `docs/formulation.md`).

use nalgebra::{Matrix3, Vector3, Vector4};

/// Tangent t of half the angle of a step as a function of x = ½ h |ω|, with its first and second
/// derivatives: the series of tan x.
pub fn half_tangent(x: f64) -> [f64; 3] {
    let s = x * x;
    [
        x * (1.0 + s / 3.0 + 2.0 * s * s / 15.0 + 17.0 * s * s * s / 315.0),
        1.0 + s + 2.0 * s * s / 3.0 + 17.0 * s * s * s / 45.0,
        x * (2.0 + 8.0 * s / 3.0 + 34.0 * s * s / 15.0),
    ]
}

/// Half angle vector a of a step of `h` (s), which rotates by the Cayley map of a.
fn half_vector(spin: &Vector3<f64>, h: f64) -> Vector3<f64> {
    let x = 0.5 * h * spin.norm();
    if x == 0.0 { Vector3::zeros() } else { spin * (0.5 * h * half_tangent(x)[0] / x) }
}

/// Unit attitude after a step of `h` (s) with the spin ω⁺ (rad/s, body frame).
pub fn step_attitude(q: &Vector4<f64>, spin: &Vector3<f64>, h: f64) -> Vector4<f64> {
    turned_by(q, &half_vector(spin, h))
}

/// Unit attitude q ⊗ (1, a)/|q ⊗ (1, a)|: the Cayley map of a.
pub fn turned_by(q: &Vector4<f64>, a: &Vector3<f64>) -> Vector4<f64> {
    let [w, x, y, z] = q.data.0[0];
    let real = w - x * a[0] - y * a[1] - z * a[2];
    let v = Vector3::new(x, y, z);
    let imaginary = v + w * a + v.cross(a);
    Vector4::new(real, imaginary[0], imaginary[1], imaginary[2]).normalize()
}

/// P⁺(ω) (N m s, body frame), or P⁻ with −h. With m = I ω along and across ω:
///
/// ```text
/// P^± = (E ± [a]× + a aᵀ) n,   n = m_∥/t′ + m_⊥ x/t
/// ```
///
/// It is the derivative of h ½ ω·I ω by a rotation of the start or the end of the step.
pub fn turned_momentum(inertia: &Matrix3<f64>, spin: &Vector3<f64>, h: f64) -> Vector3<f64> {
    let momentum = inertia * spin;
    let x = (0.5 * h * spin.norm()).abs();
    if x == 0.0 {
        return momentum;
    }
    let [t, slope, _] = half_tangent(x);
    let along = spin * (spin.dot(&momentum) / spin.norm_squared());
    let n = along / slope + (momentum - along) * (x / t);
    let a = half_vector(spin, h);
    n + a.cross(&n) + a * a.dot(&n)
}
