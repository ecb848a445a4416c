//! Unit tests of `plane.rs`.

use super::*;

fn planes() -> Vec<Plane> {
    let normals = [
        [0.0, 0.0, 1.0],
        [0.3, -0.2, 0.9],
        [1.0, 0.0, 0.0],
        [0.0, -2.0, 1e-9],
        [1e-9, 2e-9, -1.0],
        [0.0, 0.0, -3.0],
        [-5.0, 4.0, -7.0],
        [1e-12, 0.0, 1.0],
    ];
    normals
        .iter()
        .flat_map(|&normal| [0.0, -1.5].map(|d| Plane::new(normal.into(), d).unwrap()))
        .collect()
}

fn some_state() -> State {
    State {
        position: Vector3::new(1.0, -2.0, 0.5),
        attitude: Vector4::new(0.3, -0.5, 0.1, 0.8).normalize(),
        velocity: Vector3::new(4.0, 5.0, -6.0),
        spin: Vector3::new(1.0, 2.0, 3.0),
    }
}

#[test]
fn the_normal_becomes_the_z_axis_and_the_plane_the_height_zero() {
    for plane in planes() {
        let normal = plane.vector_to_ground(plane.normal());
        assert!((normal - Vector3::z()).norm() < 4.0 * f64::EPSILON, "{plane:?}: {normal}");
        let turned = plane.rotation() * plane.rotation().transpose();
        assert!((turned - Matrix3::identity()).amax() < 8.0 * f64::EPSILON, "{plane:?}");
        // Height: n·x − d.
        let state = some_state();
        let height = plane.normal().dot(&state.position) - plane.offset();
        let found = plane.state_to_ground(&state).position[2];
        assert!((found - height).abs() < 1e-14, "{plane:?}: {found} {height}");
    }
}

#[test]
fn state_round_trips_through_plane_coordinates() {
    let state = some_state();
    for plane in planes() {
        let back = plane.state_to_world(&plane.state_to_ground(&state));
        let difference = (back.to_vector() - state.to_vector()).amax();
        assert!(difference < 1e-14, "{plane:?}: {difference}");
        // Points of the body go with it: R (r + A c − d n) = r_g + A_g c.
        let c = Vector3::new(0.7, -0.1, 0.4);
        let ground = plane.state_to_ground(&state);
        let world = state.position + rotation(&state.attitude) * c;
        let point = plane.rotation() * (world - plane.offset() * plane.normal());
        let same = ground.position + rotation(&ground.attitude) * c;
        assert!((point - same).norm() < 1e-14, "{plane:?}");
    }
}

#[test]
fn a_slope_falls_towards_x() {
    let plane = Plane::sloping(30.0).unwrap();
    let gravity = plane.vector_to_ground(&Vector3::new(0.0, 0.0, -10.0));
    assert!((gravity - Vector3::new(5.0, 0.0, -75f64.sqrt())).norm() < 1e-14, "{gravity}");
}

#[test]
fn invalid_planes_are_rejected() {
    for normal in [[0.0; 3], [f64::NAN, 0.0, 1.0], [0.0, f64::INFINITY, 1.0], [1e-9, 0.0, 0.0]] {
        assert!(Plane::new(normal.into(), 0.0).is_err(), "{normal:?}");
    }
    assert!(Plane::new(Vector3::z(), f64::NAN).is_err());
    assert!(Plane::sloping(200.0).is_err());
    assert!(Plane::new(Vector3::new(0.0, 0.0, 2.0), 0.0).unwrap().is_level());
}
