//! Colours of the animation, with one palette for all frames.
//!
//! Each body has its own colour or one of six hues. Fixed objects are grey. Pictures use few flat
//! colours, so that the palette also holds the blends for smooth edges. Each pixel gets the nearest
//! colour, without dithering.

use crate::film::{Film, FilmBody};

/// Red, green and blue.
pub type PaintColour = [u8; 3];

/// Background.
pub const BACKGROUND: PaintColour = [0xfb, 0xfc, 0xfd];
/// Ground.
pub const GROUND: PaintColour = [0xe9, 0xed, 0xf2];
/// Grid lines.
pub const LINE: PaintColour = [0xc6, 0xce, 0xd9];
/// Colour of the shadow layer over the ground.
pub const SHADOW: PaintColour = [0x2c, 0x3e, 0x55];
/// Opacity of [`SHADOW`] in the core of a shadow.
pub const SHADOW_DEPTH: f32 = 0.42;
/// Edges of the bodies.
pub const EDGE: PaintColour = [0x0f, 0x2a, 0x47];
/// Dark, middle and light shade of faces.
pub type Hue = [PaintColour; 3];

/// Hues of bodies without a colour, in turn.
const HUES: [Hue; 6] = [
    [EDGE, [0x2f, 0x74, 0xb5], [0xa9, 0xd0, 0xf0]],
    [[0x4a, 0x2a, 0x08], [0xc4, 0x7a, 0x1c], [0xf8, 0xd4, 0x96]],
    [[0x0c, 0x3b, 0x2c], [0x24, 0x8f, 0x6b], [0xa6, 0xe3, 0xcb]],
    [[0x45, 0x16, 0x3a], [0xa8, 0x4b, 0x8f], [0xee, 0xbd, 0xdf]],
    [[0x47, 0x17, 0x17], [0xb8, 0x4a, 0x45], [0xf3, 0xbf, 0xb8]],
    [[0x38, 0x38, 0x0a], [0x8f, 0x8b, 0x2b], [0xe3, 0xe0, 0x9b]],
];
/// Hue of fixed objects.
pub const STILL: Hue = [[0x30, 0x36, 0x3f], [0x7d, 0x87, 0x94], [0xd5, 0xdb, 0xe2]];
/// Force arrows, and the outline around them.
pub const FORCE: PaintColour = [0xe8, 0x4a, 0x1f];
pub const SEAM: PaintColour = [0xff, 0xff, 0xff];
/// Time display.
pub const INK: PaintColour = [0x1b, 0x26, 0x36];

/// Number of shadow levels.
pub const SHADOW_STEPS: u8 = 8;

/// Interpolates colours: `from` at 0, `to` at 1.
pub fn mix(from: PaintColour, to: PaintColour, share: f32) -> PaintColour {
    std::array::from_fn(|k| {
        let (a, b) = (f32::from(from[k]), f32::from(to[k]));
        (a + (b - a) * share).round() as u8
    })
}

/// Hue of the body with index `b`.
pub fn hue_of(body: &FilmBody, b: usize) -> Hue {
    let Some(colour) = body.colour else { return HUES[b % HUES.len()] };
    [mix([0; 3], colour, 0.4), colour, mix(colour, [0xff; 3], 0.5)]
}

/// Colour of a face for a brightness `light` from 0 to 1.
pub fn body([dark, middle, bright]: Hue, light: f32) -> PaintColour {
    if light < 0.5 {
        mix(dark, middle, 2.0 * light)
    } else {
        mix(middle, bright, 2.0 * light - 1.0)
    }
}

/// Opacity of the shadow after `steps` of [`SHADOW_STEPS`] layers.
fn shadow_share(steps: u8) -> f32 {
    SHADOW_DEPTH * f32::from(steps) / f32::from(SHADOW_STEPS)
}

/// All colours of a palette. With more hues each has fewer shades. Hues beyond the limit have none.
fn colours(hues: &[Hue]) -> Vec<PaintColour> {
    let mut all = vec![BACKGROUND, FORCE, SEAM];
    let mut blends = |from, to, count: u8, last: bool| {
        let blend = |k: u8| mix(from, to, f32::from(k) / f32::from(count));
        all.extend((1..count + u8::from(last)).map(blend));
    };
    blends(GROUND, LINE, 3, true);
    blends(LINE, BACKGROUND, 3, false);
    blends(INK, BACKGROUND, 5, false);
    blends(FORCE, SEAM, 4, false);
    blends(FORCE, GROUND, 3, false);
    for hue in hues.iter().take(HUES.len() + 1) {
        blends(FORCE, hue[1], 3, false);
    }
    all.push(INK);
    all.extend((0..=SHADOW_STEPS).map(|k| mix(GROUND, SHADOW, shadow_share(k))));
    all.extend((2..=SHADOW_STEPS).step_by(2).map(|k| mix(LINE, SHADOW, shadow_share(k))));
    let levels = ((MOST_COLOURS - all.len()) / hues.len().max(1)).clamp(FEWEST_SHADES, SHADES);
    for hue in hues {
        all.extend((0..levels).map(|k| body(*hue, k as f32 / (levels - 1) as f32)));
    }
    all.truncate(MOST_COLOURS);
    all
}

/// Maximum number of colours. A GIF palette has 256 entries, one of them for transparency.
const MOST_COLOURS: usize = 255;
/// Maximum number of shades of a body.
const SHADES: usize = 24;
const FEWEST_SHADES: usize = 3;

/// Bits per channel of the lookup table.
const BITS: u32 = 6;

/// Mapping of colours to palette indices.
pub struct Palette {
    colours: Vec<PaintColour>,
    /// Cache of nearest indices by the leading bits of the channels.
    table: Vec<Option<u8>>,
}

impl Palette {
    /// Palette for the bodies and fixed objects of a film.
    pub fn of(film: &Film) -> Self {
        let mut hues: Vec<Hue> = Vec::new();
        let still = (!film.fixed.is_empty()).then_some(STILL);
        for hue in
            still.into_iter().chain(film.bodies.iter().zip(0..).map(|(body, b)| hue_of(body, b)))
        {
            if !hues.contains(&hue) {
                hues.push(hue);
            }
        }
        Self { colours: colours(&hues), table: vec![None; 1 << (3 * BITS)] }
    }

    /// Index of the nearest colour.
    pub fn index(&mut self, colour: PaintColour) -> u8 {
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

fn nearest(colours: &[PaintColour], wanted: [i32; 3]) -> u8 {
    let distance = |colour: &PaintColour| -> i32 {
        colour.iter().zip(wanted).map(|(&have, want)| (i32::from(have) - want).pow(2)).sum()
    };
    let mut best = (i32::MAX, 0);
    for (index, colour) in (0u8..).zip(colours) {
        best = best.min((distance(colour), index));
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::FilmFixed;
    use crate::samples::falling_cube;

    #[test]
    fn flat_colours_are_in_the_palette_as_they_are() {
        for (bodies, own) in [(1, 0), (100, 0), (20, 9)] {
            let mut film = falling_cube(0);
            film.bodies = vec![film.bodies[0].clone(); bodies];
            for (b, body) in film.bodies.iter_mut().enumerate().take(own) {
                body.colour = Some([28 * b as u8, 255 - 28 * b as u8, 128]);
            }
            if bodies > 1 {
                film.fixed = vec![FilmFixed { name: String::new(), pieces: Vec::new() }];
            }
            let mut palette = Palette::of(&film);
            assert!(palette.colours.len() <= usize::from(palette.transparent()));
            assert_eq!(palette.transparent(), if bodies == 1 { 63 } else { 255 });
            let flat = [BACKGROUND, GROUND, LINE, EDGE, FORCE, SEAM, INK, STILL[2]];
            let flat = flat.into_iter().take(if bodies == 1 { 7 } else { 8 });
            let all = film.bodies.iter().enumerate().map(|(b, one)| body(hue_of(one, b), 1.0));
            for colour in flat.chain(all) {
                let index = palette.index(colour);
                let found = palette.colours[usize::from(index)];
                let far = (0..3).map(|k| found[k].abs_diff(colour[k])).max().unwrap();
                assert!(far <= 4, "{colour:?} became {found:?}");
            }
        }
    }

    #[test]
    fn a_palette_holds_no_more_than_a_gif_has() {
        let mut film = falling_cube(0);
        film.bodies = vec![film.bodies[0].clone(); 300];
        for (b, body) in (0u8..=255).zip(&mut film.bodies) {
            body.colour = Some([b, b.wrapping_mul(7), 255 - b]);
        }
        assert_eq!(Palette::of(&film).bytes().len(), 3 * 256);
    }
}
