//! Colours of the page, the animation and the still pictures.
//!
//! Bodies have light, clear colours of different lightness, which readers with any colour vision tell
//! apart. Robots are light grey, with one accent at their base. Forces have a colour of their own.

use crate::film::Film;
use crate::skeleton;
use std::fmt::Write as _;

/// Red, green and blue.
pub type Rgb = [u8; 3];

/// Colours of a scene on a light or a dark page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Theme {
    /// Background.
    pub sky: Rgb,
    /// Ground near the scene. It fades to the background.
    pub ground: Rgb,
    /// Grid lines on the ground.
    pub grid: Rgb,
    /// Shadow layer over the ground.
    pub shadow: Rgb,
    /// Opacity of [`Theme::shadow`] in the core of a shadow.
    pub shadow_depth: f32,
    /// Text.
    pub ink: Rgb,
    /// Outline of text and arrows.
    pub seam: Rgb,
    /// Joints, and lines between them.
    pub joint: Rgb,
    /// Trails of centres of mass.
    pub trail: Rgb,
    /// Contact forces.
    pub force: Rgb,
    /// Outline of selected bodies.
    pub chosen: Rgb,
}

/// Theme of a light page.
pub const LIGHT: Theme = Theme {
    sky: [0xf7, 0xf8, 0xfa],
    ground: [0xe6, 0xea, 0xef],
    grid: [0xcd, 0xd4, 0xdd],
    shadow: [0x2b, 0x38, 0x4a],
    shadow_depth: 0.40,
    ink: [0x1b, 0x26, 0x36],
    seam: [0xff, 0xff, 0xff],
    joint: [0x33, 0x40, 0x52],
    trail: [0x7a, 0x87, 0x98],
    force: [0xe8, 0x4a, 0x1f],
    chosen: [0x0b, 0x62, 0xa8],
};

/// Theme of a dark page.
pub const DARK: Theme = Theme {
    sky: [0x13, 0x18, 0x1f],
    ground: [0x22, 0x29, 0x33],
    grid: [0x36, 0x40, 0x4d],
    shadow: [0x05, 0x07, 0x0a],
    shadow_depth: 0.55,
    ink: [0xe4, 0xe9, 0xef],
    seam: [0x10, 0x15, 0x1c],
    joint: [0xf2, 0xc1, 0x4e],
    trail: [0x8d, 0x9b, 0xab],
    force: [0xff, 0x6a, 0x3d],
    chosen: [0x7c, 0xc4, 0xff],
};

/// Colours of bodies, in turn. Neighbours differ in lightness.
pub const BODIES: [Rgb; 6] = [
    [0x42, 0x75, 0xbf],
    [0xf4, 0xd5, 0x94],
    [0x89, 0x59, 0x92],
    [0xb3, 0xd7, 0xee],
    [0x46, 0xa1, 0x93],
    [0xfa, 0xb1, 0xa1],
];
/// Colours of a robot's links, in turn along the tree of joints.
pub const LINKS: [Rgb; 2] = [[0xe3, 0xe6, 0xea], [0xb7, 0xbf, 0xc9]];
/// Accent of a robot: its base.
pub const BASE: Rgb = BODIES[0];
/// Fixed objects.
pub const STILL: Rgb = [0x8a, 0x94, 0xa1];

/// Colour of each body: its own, or that of its place in a robot, or one of [`BODIES`].
pub fn body_colours(film: &Film) -> Vec<Rgb> {
    let depths = skeleton::robot_depths(film);
    // The base of a robot has the first colour.
    let mut free = usize::from(depths.iter().any(Option::is_some));
    let colour = |(body, depth): (&crate::film::Object, Option<usize>)| {
        let usual = match depth {
            Some(0) => BASE,
            Some(depth) => LINKS[depth % LINKS.len()],
            None => {
                free += 1;
                BODIES[(free - 1) % BODIES.len()]
            }
        };
        body.colour.unwrap_or(usual)
    };
    film.bodies.iter().zip(depths).map(colour).collect()
}

/// Colour in CSS notation.
pub fn css([red, green, blue]: Rgb) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

/// Style sheet with the colours of both themes as custom properties.
pub fn style() -> String {
    let dark = "@media (prefers-color-scheme: dark)";
    format!(":root {{{} }}\n{dark} {{ :root {{{} }} }}\n", properties(&LIGHT), properties(&DARK))
}

fn properties(theme: &Theme) -> String {
    let colours = [
        ("sky", theme.sky),
        ("ground", theme.ground),
        ("grid", theme.grid),
        ("shadow", theme.shadow),
        ("ink", theme.ink),
        ("seam", theme.seam),
        ("joint", theme.joint),
        ("trail", theme.trail),
        ("force", theme.force),
        ("chosen", theme.chosen),
        ("still", STILL),
    ];
    let mut text = String::new();
    for (name, colour) in colours {
        // Writing to a string does not fail.
        let _ = write!(text, " --{name}: {};", css(colour));
    }
    let _ = write!(text, " --shadow-depth: {};", theme.shadow_depth);
    text
}

#[cfg(test)]
mod tests {
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
        let f = (to_xyz * seen).map(|t| {
            if t > 216.0 / 24389.0 { t.cbrt() } else { (24389.0 / 27.0 * t + 16.0) / 116.0 }
        });
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
        let joints =
            vec![joint(2, Some(1)), joint(3, Some(2)), joint(4, Some(1)), joint(6, Some(5))];
        tie(&mut film, joints);
        let expected = [BODIES[1], BASE, LINKS[1], LINKS[0], LINKS[1], BODIES[2], BODIES[3]];
        assert_eq!(body_colours(&film), expected);
        film.bodies[3].colour = Some([1, 2, 3]);
        assert_eq!(body_colours(&film)[3], [1, 2, 3]);
    }
}
