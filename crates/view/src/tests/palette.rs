//! Unit tests of `palette.rs`.

use super::*;
use crate::samples::{copies, floating_cube, joint, tie};
use nalgebra::{Matrix3, Vector3};

/// Simulation of dichromatic vision in linear RGB (Machado, Oliveira and Fernandes 2009,
    /// severity 1): protanopia, deuteranopia and tritanopia.
    #[rustfmt::skip]
    const VISIONS: [[f64; 9]; 4] = [
        [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        [0.152286, 1.052583, -0.204868, 0.114503, 0.786281, 0.099216, -0.003882, -0.048116, 1.051998],
        [0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.011820, 0.042940, 0.968881],
        [1.255528, -0.076749, -0.178779, -0.078411, 0.930809, 0.147602, 0.004733, 0.691367, 0.303900],
    ];

/// CIELAB coordinates of a colour as seen with a vision.
fn lab(vision: &[f64; 9], colour: Rgb) -> Vector3<f64> {
    let linear = Vector3::from(colour.map(|byte| {
        let s = f64::from(byte) / 255.0;
        if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
    }));
    let seen = (Matrix3::from_row_slice(vision) * linear).map(|x| x.clamp(0.0, 1.0));
    #[rustfmt::skip]
        let to_xyz = Matrix3::new(
            0.4124 / 0.95047, 0.3576 / 0.95047, 0.1805 / 0.95047,
            0.2126, 0.7152, 0.0722,
            0.0193 / 1.08883, 0.1192 / 1.08883, 0.9505 / 1.08883,
        );
    let f = (to_xyz * seen)
        .map(|t| if t > 216.0 / 24389.0 { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 });
    Vector3::new(116.0 * f.y - 16.0, 500.0 * (f.x - f.y), 200.0 * (f.y - f.z))
}

fn least_distance(colours: &[Rgb]) -> f64 {
    let pairs =
        colours.iter().enumerate().flat_map(|(i, a)| colours[..i].iter().map(move |b| (a, b)));
    let distances = VISIONS.iter().flat_map(|vision| {
        pairs.clone().map(move |(a, b)| (lab(vision, *a) - lab(vision, *b)).norm())
    });
    distances.fold(f64::INFINITY, f64::min)
}

/// The distances are several times a just noticeable difference, which is 2.3.
#[test]
fn body_colours_differ_for_every_colour_vision() {
    let least = least_distance(&BODIES);
    assert!(least > 15.0, "{least}");
    let robots = least_distance(&[LINKS[0], LINKS[1], BASE]);
    assert!(robots > 14.0, "{robots}");
    for theme in [LIGHT, DARK] {
        for colour in BODIES.iter().chain(&LINKS) {
            let least = least_distance(&[*colour, theme.force]);
            assert!(least > 15.0, "{colour:?}: {least}");
        }
        let joints = least_distance(&[theme.joint, theme.ground]);
        assert!(joints > 40.0, "{joints}");
    }
    // The lightness of neighbours differs.
    let lightness = |colour| lab(&VISIONS[0], colour).x;
    for k in 0..BODIES.len() {
        let next = BODIES[(k + 1) % BODIES.len()];
        assert!((lightness(BODIES[k]) - lightness(next)).abs() > 12.0, "{k}");
    }
}

#[test]
fn robots_are_grey_with_an_accent_and_other_bodies_cycle_the_palette() {
    let mut film = floating_cube(1);
    copies(&mut film, 7);
    // Bodies 1 to 4 are a robot with base 1. Bodies 0, 5 and 6 are not.
    let joints = vec![joint(2, Some(1)), joint(3, Some(2)), joint(4, Some(1)), joint(6, Some(5))];
    tie(&mut film, joints);
    let expected = [BODIES[1], BASE, LINKS[1], LINKS[0], LINKS[1], BODIES[2], BODIES[3]];
    assert_eq!(body_colours(&film), expected);
    film.bodies[3].colour = Some([1, 2, 3]);
    assert_eq!(body_colours(&film)[3], [1, 2, 3]);
}
