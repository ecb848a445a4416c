//! Unit tests of `cone.rs`.

use super::*;

const COMPLIANCE: f64 = 1e-6;

/// Slipping contact with a normal impulse of 0.02 m/s. It slips along `direction` (rad) and
/// moves with u_n along its normal.
fn slipping(direction: f64, u_n: f64) -> (CouplingRows, ConeProjection, Vector3<f64>) {
    let rows = CouplingRows::from_contact(Matrix3::identity(), 2.0, 1.5);
    let (sin, cos) = direction.sin_cos();
    let impulse = Vector3::new(-0.006 * cos, -0.006 * sin, 0.02);
    let u = Vector3::new(0.3 * cos, 0.3 * sin, u_n);
    let map = NaturalMap::with_compliance(COMPLIANCE);
    let projection = ConeProjection::new(&map, &rows, &Cone { friction: 0.3 }, &u, &impulse);
    (rows, projection, impulse)
}

/// The offset for use with the point's own gain equals the one of the local solution.
#[test]
fn slip_offset_with_its_own_gain_is_the_local_solutions() {
    let (rows, projection, _) = slipping(0.7, 1e-4);
    let (offset, gain) = projection.linearise_slip(&rows, COMPLIANCE);
    let found = projection.slip_offset(&rows, COMPLIANCE, &gain);
    assert!((found - offset).norm() <= 1e-13 * offset.norm(), "{found} {offset}");
}

/// Next to the gain of another direction, the normal motion −û_n cancels the term û_n/ε
/// completely. The term is a thousand times the impulse here. No part remains in either
/// direction.
#[test]
fn slip_offset_with_another_gain_cancels_the_compliance_term() {
    let u_n = 1e-5;
    let (rows, projection, impulse) = slipping(0.7, u_n);
    let (_, before, _) = slipping(0.6, 0.0);
    let (_, kept) = before.linearise_slip(&rows, COMPLIANCE);
    let back = -rows.normal() * projection.u_n;
    let found = projection.slip_offset(&rows, COMPLIANCE, &kept) + kept * back;
    assert!(found.norm() <= 1e-9 * u_n / COMPLIANCE + impulse.norm(), "{found}");
    let fresh = projection.linearise_slip(&rows, COMPLIANCE).0 + kept * back;
    assert!(
        fresh.norm() > 10.0 * impulse.norm(),
        "as it would be with the local_solution's own: {fresh}"
    );
}
