//! Unit tests of `film.rs`.

use super::*;
use crate::samples::{copies, floating_cube};
use nalgebra::Point3;

#[test]
fn z_in_the_ground_frame_is_height() {
    let place = Vector3::new(1.0, -2.0, 0.5);
    for normal in [[0.3, -0.2, 0.9], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [1e-9, 0.0, -1.0]] {
        let ground = Plane::new(Vector3::from(normal), -1.5).unwrap();
        let placed = frame_of(&ground) * Point3::from(place);
        // Near the vertical the arc cosine loses half the digits, which a picture does not
        // show.
        assert!((placed.z - height(&ground, &place)).abs() < 1e-7, "{normal:?}");
    }
    assert_eq!(frame_of(&Plane::level()) * Point3::from(place), Point3::from(place));
}

#[test]
fn plots_start_with_the_first_body_that_moves() {
    let mut film = floating_cube(20);
    copies(&mut film, 3);
    assert_eq!(film.first_moving(), 0);
    // Body 0 rests, body 1 trembles, body 2 moves.
    let start = film.frames[0].states.clone();
    for (k, frame) in film.frames.iter_mut().enumerate() {
        frame.states[0] = start[0];
        frame.states[1] = start[1];
        frame.states[1].position.x += 1e-5 * k as f64;
    }
    assert_eq!(film.first_moving(), 2);
    film.frames.truncate(1);
    assert_eq!(film.first_moving(), 0);
}

#[test]
fn slope_of_the_ground_is_an_angle() {
    let ground = Plane::new(Vector3::new(0.6, 0.0, 0.8), 0.0).unwrap();
    assert!((slope(&ground) - 36.869_897_645_844).abs() < 1e-9);
    let place = frame_of(&ground) * Point3::new(0.8, 0.0, -0.6);
    assert!((place - Point3::new(1.0, 0.0, 0.0)).norm() < 1e-15, "x falls with the slope");
}
