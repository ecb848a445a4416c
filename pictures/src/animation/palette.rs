//! The colours of the animation: one palette for all frames of all films.
//!
//! Pictures are painted with few flat colours, so that the palette holds them and the
//! blends that smooth edges need; each pixel gets the nearest. No dithering.

/// Red, green, blue.
pub type Colour = [u8; 3];

/// Behind everything.
pub const BACKGROUND: Colour = [0xfb, 0xfc, 0xfd];
/// The ground.
pub const GROUND: Colour = [0xe9, 0xed, 0xf2];
/// Lines of the grid.
pub const LINE: Colour = [0xc6, 0xce, 0xd9];
/// Laid over the ground where the shadow is.
pub const SHADOW: Colour = [0x2c, 0x3e, 0x55];
/// How much of [`SHADOW`] covers the ground where it is deepest.
pub const SHADOW_DEPTH: f32 = 0.42;
/// Edges of the body, and its faces from the darkest to the lightest.
pub const EDGE: Colour = [0x0f, 0x2a, 0x47];
const BODY_MIDDLE: Colour = [0x2f, 0x74, 0xb5];
const BODY_LIGHT: Colour = [0xa9, 0xd0, 0xf0];
/// Arrows of the forces, and the seam around them.
pub const FORCE: Colour = [0xe8, 0x4a, 0x1f];
pub const SEAM: Colour = [0xff, 0xff, 0xff];
/// The clock.
pub const INK: Colour = [0x1b, 0x26, 0x36];

/// Steps of the shadow, from none to the deepest.
pub const SHADOW_STEPS: u8 = 8;

/// The index that leaves a pixel as the frame before had it.
pub const TRANSPARENT: u8 = 63;

/// `from` at 0, `to` at 1.
pub fn mix(from: Colour, to: Colour, share: f32) -> Colour {
    std::array::from_fn(|k| {
        let (a, b) = (f32::from(from[k]), f32::from(to[k]));
        (a + (b - a) * share).round() as u8
    })
}

/// The colour of a face, `light` from 0 to 1.
pub fn body(light: f32) -> Colour {
    if light < 0.5 {
        mix(EDGE, BODY_MIDDLE, 2.0 * light)
    } else {
        mix(BODY_MIDDLE, BODY_LIGHT, 2.0 * light - 1.0)
    }
}

/// The share of the shadow's colour after `steps` of [`SHADOW_STEPS`].
fn shadow_share(steps: u8) -> f32 {
    SHADOW_DEPTH * f32::from(steps) / f32::from(SHADOW_STEPS)
}

/// All colours, [`TRANSPARENT`] not among them.
fn colours() -> Vec<Colour> {
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
    blends(FORCE, BODY_MIDDLE, 3, false);
    all.push(INK);
    all.extend((0..=SHADOW_STEPS).map(|k| mix(GROUND, SHADOW, shadow_share(k))));
    all.extend((2..=SHADOW_STEPS).step_by(2).map(|k| mix(LINE, SHADOW, shadow_share(k))));
    all.extend((0..BODY_LEVELS).map(|k| body(f32::from(k) / f32::from(BODY_LEVELS - 1))));
    all
}

/// Shades of the body in the palette.
const BODY_LEVELS: u8 = 24;

/// Bits of a channel that the table looks at.
const BITS: u32 = 6;

/// Turns colours into indices.
pub struct Palette {
    colours: Vec<Colour>,
    /// The nearest index for every colour, by the leading bits of its channels.
    table: Vec<u8>,
}

impl Palette {
    pub fn new() -> Self {
        let colours = colours();
        let side = 1usize << BITS;
        let middle = |bits: usize| {
            // The middle of the colours with these leading bits.
            (bits << (8 - BITS)) as i32 + (1 << (7 - BITS))
        };
        let mut table = Vec::with_capacity(side * side * side);
        for red in 0..side {
            for green in 0..side {
                for blue in 0..side {
                    let wanted = [middle(red), middle(green), middle(blue)];
                    table.push(nearest(&colours, wanted));
                }
            }
        }
        Self { colours, table }
    }

    /// The index of the nearest colour.
    pub fn index(&self, [red, green, blue]: Colour) -> u8 {
        let cut = |channel: u8| usize::from(channel >> (8 - BITS));
        self.table[cut(red) << (2 * BITS) | cut(green) << BITS | cut(blue)]
    }

    /// As GIF has it: 64 colours, three bytes each.
    pub fn bytes(&self) -> Vec<u8> {
        let mut bytes = self.colours.concat();
        bytes.resize(3 * (usize::from(TRANSPARENT) + 1), 0);
        bytes
    }
}

fn nearest(colours: &[Colour], wanted: [i32; 3]) -> u8 {
    let distance = |colour: &Colour| -> i32 {
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

    #[test]
    fn flat_colours_are_in_the_palette_as_they_are() {
        let palette = Palette::new();
        assert!(palette.colours.len() <= usize::from(TRANSPARENT), "{}", palette.colours.len());
        for colour in [BACKGROUND, GROUND, LINE, EDGE, FORCE, SEAM, INK, body(1.0)] {
            let found = palette.colours[usize::from(palette.index(colour))];
            let far = (0..3).map(|k| found[k].abs_diff(colour[k])).max().unwrap();
            assert!(far <= 4, "{colour:?} became {found:?}");
        }
    }
}
