//! Motion of a body's touching point relative to a fixed plane in a step (N2), and its derivative
//! by the spin (N3).
//!
//! Equation numbers refer to `docs/native-solver.md`.

use super::coupling::{Coupling, Lever};
use super::turning::BodyTurning;
use nalgebra::{Matrix3, Vector3};

/// u (N2) of a coupling of a body with the final velocity `linear` (m/s, world) and the rotation
/// `turning`.
///
/// A rolling feature moves with its centre and with its spin:
///
/// ```text
/// u = v⁺ + A K a − ρ (A ω⁺) × n + n φ/h
/// ```
#[inline]
pub(super) fn point_velocity(
    coupling: &Coupling,
    turning: &BodyTurning,
    linear: &Vector3<f64>,
) -> Vector3<f64> {
    let Lever { centre, radius, .. } = &coupling.lever;
    let mut u = linear + turning.swept(centre);
    if *radius > 0.0 {
        u -= *radius * turning.spin_world().cross(&coupling.rows.normal());
    }
    u + coupling.offset
}

/// ∂u/∂ω⁺ (N3), from A K a. The derivative ∂u/∂v⁺ is E.
///
/// ```text
/// ∂(−ρ (A ω) × n)/∂ω = ρ [n]× A
/// ```
#[inline(always)]
pub(super) fn slope(
    coupling: &Coupling,
    rotation: &Matrix3<f64>,
    turning: &BodyTurning,
    swept: &Vector3<f64>,
) -> Matrix3<f64> {
    let Lever { centre, arm, radius, torque_map } = &coupling.lever;
    if *radius == 0.0 {
        return turning.slope(rotation, centre, arm, torque_map.transpose(), swept);
    }
    let turned = -rotation * centre.cross_matrix();
    turning.slope(rotation, centre, arm, turned, swept)
        + rolling(&coupling.rows.normal(), *radius, rotation)
}

/// ρ [n]× A.
pub(super) fn rolling(normal: &Vector3<f64>, radius: f64, rotation: &Matrix3<f64>) -> Matrix3<f64> {
    (normal * radius).cross_matrix() * rotation
}
