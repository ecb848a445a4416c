//! Unit tests of `body.rs`.

use super::*;

#[test]
fn corners_come_with_x_changing_fastest() {
    let half_sides = Vector3::new(1.0, 2.0, 3.0);
    let body = RigidBody::with_box_corners(1.0, Matrix3::identity(), half_sides).unwrap();
    let corners: Vec<_> = body.contact_points().iter().map(|c| c.position).collect();
    assert_eq!(corners[0], Vector3::new(-1.0, -2.0, -3.0));
    assert_eq!(corners[1], Vector3::new(1.0, -2.0, -3.0));
    assert_eq!(corners[2], Vector3::new(-1.0, 2.0, -3.0));
    assert_eq!(corners[7], half_sides);
    assert_eq!(body.reach(), 3.0);
}

/// The range depends on the ratios of mass, inertia and points only: a body in other units is
/// accepted or rejected alike.
#[test]
fn the_range_of_the_inertia_scales_with_the_body() {
    for (mass, length) in [(1e-6, 5e-4), (1.0, 1.0), (1e9, 50.0), (1e-9, 1e4), (1e9, 1e-5)] {
        let half_sides = Vector3::new(0.2, 0.5, 1.0) * length;
        assert!(RigidBody::solid_box(mass, half_sides).is_ok(), "{mass} {length}");
        for (part, fits) in [(1e-7, false), (1e-5, true), (1e5, true), (1e7, false)] {
            let inertia = Matrix3::from_diagonal_element(part * mass * length * length);
            let body = RigidBody::with_box_corners(mass, inertia, half_sides);
            assert_eq!(body.is_ok(), fits, "{mass} {length} {part}: {body:?}");
        }
    }
    // A rod has a small inertia about its axis, and its corners have small lever arms.
    let rod = Vector3::new(0.5, 0.5e-3, 0.5e-3);
    assert!(RigidBody::solid_box(1.0, rod).is_ok());
}

#[test]
fn invalid_bodies_are_rejected_by_field() {
    let cube = |mass, inertia| {
        RigidBody::with_box_corners(mass, inertia, Vector3::repeat(1.0)).unwrap_err().to_string()
    };
    let unit = Matrix3::identity();
    for mass in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(cube(mass, unit).starts_with("mass (kg) is"), "{mass}");
    }
    let skew = Matrix3::new(1.0, 0.5, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    assert!(cube(1.0, skew).contains("not symmetric"));
    assert!(cube(1.0, -unit).contains("not positive definite"));
    assert!(cube(1.0, unit * f64::NAN).contains("finite"));
    assert!(cube(1.0, unit * 1e-6).contains("1e-6 kg m²; allowed with this mass"));
    assert!(cube(1e-9, unit).contains("2.0e-15 to 6.0e-3"));
    let needle = Matrix3::from_diagonal(&Vector3::new(1e-7, 1.0, 1.0));
    assert!(cube(1.0, needle).contains("ratio of at most 1e6"));
    assert!(RigidBody::new(1.0, unit, &[]).is_err());
    assert!(RigidBody::new(1.0, unit, &[Vector3::zeros(); 2]).is_err());
    assert!(RigidBody::new(1.0, unit, &[Vector3::zeros()]).is_ok(), "a point mass");
}
