//! Shades of the animation, with one palette for all frames.
//!
//! Surfaces are lit as on the page: a lamp and the sky, in linear light. Pictures use few flat
//! colours, so that the palette also holds the blends for smooth edges. Each pixel gets the nearest
//! colour, without dithering.

use crate::film::Film;
use crate::palette::{self, Rgb, STILL, Theme};
use crate::shape::Shape;

/// Number of steps in which the ground fades to the background.
pub const FADES: u8 = 12;
/// Number of shades of a hue.
const LEVELS: usize = 48;
/// Reflected light of a white surface in the darkest and the brightest shade.
const DARKEST: f32 = 0.2;
const BRIGHTEST: f32 = 1.32;

/// Shades of a colour from dark to bright.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hue {
    shades: [Rgb; LEVELS],
}

/// Linear light of an sRGB channel, and its inverse.
fn linear(channel: u8) -> f32 {
    let s = f32::from(channel) / 255.0;
    if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}

fn encoded(light: f32) -> u8 {
    let light = light.clamp(0.0, 1.0);
    let s =
        if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 };
    (255.0 * s).round() as u8
}

impl Hue {
    /// Shades of `colour`.
    pub fn from_rgb(colour: Rgb) -> Self {
        let full = colour.map(linear);
        let shade = |level: usize| {
            let light = DARKEST + (BRIGHTEST - DARKEST) * level as f32 / (LEVELS - 1) as f32;
            full.map(|channel| encoded(channel * light))
        };
        Self { shades: std::array::from_fn(shade) }
    }

    /// Shade for the reflected `light` of a white surface.
    pub fn lit(&self, light: f32) -> Rgb {
        let share = (light - DARKEST) / (BRIGHTEST - DARKEST);
        // The conversion truncates and saturates.
        self.shades[((share * (LEVELS - 1) as f32 + 0.5) as usize).min(LEVELS - 1)]
    }
}

/// Interpolates colours: `from` at 0, `to` at 1.
pub fn mix(from: Rgb, to: Rgb, share: f32) -> Rgb {
    std::array::from_fn(|k| {
        let (a, b) = (f32::from(from[k]), f32::from(to[k]));
        (a + (b - a) * share).round() as u8
    })
}

/// Number of shadow levels.
pub const SHADOW_STEPS: u8 = 8;

/// Opacity of the shadow after `steps` of [`SHADOW_STEPS`] layers.
fn shadow_share(theme: &Theme, steps: u8) -> f32 {
    theme.shadow_depth * f32::from(steps) / f32::from(SHADOW_STEPS)
}

/// All colours of a palette. With more hues each has fewer shades. Hues beyond the limit have none.
fn colours(theme: &Theme, hues: &[Hue]) -> Vec<Rgb> {
    let Theme { sky, ground, grid, shadow, ink, seam, joint, force, .. } = *theme;
    let mut all = vec![sky, force, seam, joint];
    let mut blends = |from, to, count: u8, last: bool| {
        let blend = |k: u8| mix(from, to, f32::from(k) / f32::from(count));
        all.extend((1..count + u8::from(last)).map(blend));
    };
    blends(sky, ground, FADES, true);
    blends(ground, grid, 3, true);
    blends(grid, sky, 3, false);
    blends(ink, sky, 5, false);
    blends(force, seam, 4, false);
    blends(force, ground, 3, false);
    for hue in hues.iter().take(7) {
        blends(force, hue.lit(0.7), 3, false);
    }
    all.push(ink);
    all.extend((0..=SHADOW_STEPS).map(|k| mix(ground, shadow, shadow_share(theme, k))));
    let few = (2..=SHADOW_STEPS).step_by(2);
    all.extend(few.map(|k| mix(grid, shadow, shadow_share(theme, k))));
    let levels = ((MOST_COLOURS - all.len()) / hues.len().max(1)).clamp(FEWEST_SHADES, SHADES);
    for hue in hues {
        all.extend((0..levels).map(|k| hue.shades[k * (LEVELS - 1) / (levels - 1)]));
    }
    all.truncate(MOST_COLOURS);
    all
}

/// Maximum number of colours. A GIF palette has 256 entries, one of them for transparency.
const MOST_COLOURS: usize = 255;
/// Maximum number of shades of a body.
const SHADES: usize = 32;
const FEWEST_SHADES: usize = 3;

/// Bits per channel of the lookup table.
const BITS: u32 = 6;

/// Mapping of colours to palette indices.
pub struct Palette {
    colours: Vec<Rgb>,
    /// Cache of nearest indices by the leading bits of the channels.
    table: Vec<Option<u8>>,
}

impl Palette {
    /// Palette for the bodies and fixed objects of a film.
    pub fn new(film: &Film, theme: &Theme) -> Self {
        let still = (!film.fixed.is_empty()).then_some(STILL);
        let meshes = film.bodies.iter().flat_map(|body| &body.shapes).filter_map(Shape::colour);
        let mut own: Vec<Rgb> = Vec::new();
        for colour in still.into_iter().chain(palette::body_colours(film)).chain(meshes) {
            if !own.contains(&colour) {
                own.push(colour);
            }
        }
        let hues: Vec<_> = own.into_iter().map(Hue::from_rgb).collect();
        Self { colours: colours(theme, &hues), table: vec![None; 1 << (3 * BITS)] }
    }

    /// Index of the nearest colour.
    pub fn index(&mut self, colour: Rgb) -> u8 {
        let cut = colour.map(|channel| usize::from(channel >> (8 - BITS)));
        let place = cut[0] << (2 * BITS) | cut[1] << BITS | cut[2];
        // Middle of the colours with these leading bits.
        let middle = |bits: usize| (bits << (8 - BITS)) as i32 + (1 << (7 - BITS));
        *self.table[place].get_or_insert_with(|| nearest(&self.colours, cut.map(middle)))
    }

    /// Index of transparent pixels, which keep their previous colour. It is the last entry of the
    /// palette, whose size is a power of two as GIF requires.
    pub fn transparent(&self) -> u8 {
        ((self.colours.len() + 1).next_power_of_two() - 1).min(255) as u8
    }

    /// Palette in GIF format, three bytes per colour.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = self.colours.concat();
        bytes.resize(3 * (usize::from(self.transparent()) + 1), 0);
        bytes
    }
}

fn nearest(colours: &[Rgb], target: [i32; 3]) -> u8 {
    let distance = |colour: &Rgb| -> i32 {
        colour.iter().zip(target).map(|(&have, want)| (i32::from(have) - want).pow(2)).sum()
    };
    let mut best = (i32::MAX, 0);
    for (index, colour) in (0u8..).zip(colours) {
        best = best.min((distance(colour), index));
    }
    best.1
}

#[cfg(test)]
#[path = "tests/palette.rs"]
mod tests;
