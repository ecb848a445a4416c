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
#[path = "tests/palette.rs"]
mod tests;
