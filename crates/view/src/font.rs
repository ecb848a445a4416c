//! Built-in font of the pictures, with text widths and outlines.

use skrifa::instance::{LocationRef, Size};
use skrifa::outline::{DrawSettings, OutlinePen};
use skrifa::{FontRef, MetadataProvider};
use tiny_skia::{Path, PathBuilder};

/// One weight of the font.
pub struct Font {
    font: FontRef<'static>,
}

/// Heading text as drawn.
pub struct Heading {
    pub text: String,
    /// Number of characters that the font lacks. Each is drawn as `?`.
    pub missing: usize,
}

impl Font {
    /// Weight of headings, clocks and labels. `None` if it is invalid, independent of input.
    pub fn bold() -> Option<Self> {
        FontRef::new(notosans::BOLD_TTF).ok().map(|font| Self { font })
    }

    /// Weight of other text, like [`bold`](Self::bold).
    pub fn regular() -> Option<Self> {
        FontRef::new(notosans::REGULAR_TTF).ok().map(|font| Self { font })
    }

    fn has(&self, c: char) -> bool {
        self.font.charmap().map(c).is_some()
    }

    /// Width of a text with font size `size`, in the same units.
    pub fn width(&self, text: &str, size: f64) -> f64 {
        text.chars().map(|c| f64::from(self.advance(c, size as f32))).sum()
    }

    /// Advance width of a character; 0 if the font lacks it.
    fn advance(&self, c: char, size: f32) -> f32 {
        let metrics = self.font.glyph_metrics(Size::new(size), LocationRef::default());
        self.font.charmap().map(c).and_then(|glyph| metrics.advance_width(glyph)).unwrap_or(0.0)
    }

    /// Outline of a text with the start of its baseline at x, y. Unknown characters are skipped.
    pub fn path(&self, text: &str, size: f32, [x, y]: [f32; 2]) -> Option<Path> {
        let outlines = self.font.outline_glyphs();
        let mut pen = Pen { path: PathBuilder::new(), x, y };
        for c in text.chars() {
            let outline = self.font.charmap().map(c).and_then(|glyph| outlines.get(glyph));
            let settings = DrawSettings::unhinted(Size::new(size), LocationRef::default());
            // Glyphs of the built-in font are always valid.
            let _ = outline.map(|outline| outline.draw(settings, &mut pen));
            pen.x += self.advance(c, size);
        }
        pen.path.finish()
    }

    /// Replaces unknown characters in `text` by `?`. If it is wider than `room`, an ellipsis
    /// replaces its middle, since both ends carry information.
    pub fn heading(&self, text: &str, size: f64, room: f64) -> Heading {
        let known = |c: char| if self.has(c) || c.is_control() { c } else { '?' };
        let letters: Vec<char> = text.chars().map(known).collect();
        let missing = text.chars().zip(&letters).filter(|(before, now)| before != *now).count();
        let whole: String = letters.iter().collect();
        if self.width(&whole, size) <= room {
            return Heading { text: whole, missing };
        }
        let cut = |kept: usize| -> String {
            let tail = (2 * kept).div_ceil(5);
            let (head, tail) = (&letters[..kept - tail], &letters[letters.len() - tail..]);
            head.iter().chain(&['…']).chain(tail).collect()
        };
        // Each letter is at least an eighth as wide as high.
        let most = letters.len().min((8.0 * room / size) as usize);
        let (mut fits, mut too_wide) = (0, most + 1);
        while too_wide - fits > 1 {
            let middle = fits.midpoint(too_wide);
            if self.width(&cut(middle), size) <= room {
                fits = middle;
            } else {
                too_wide = middle;
            }
        }
        Heading { text: cut(fits), missing }
    }
}

/// Pen that draws glyphs, whose y axis points up, at a position in a picture.
struct Pen {
    path: PathBuilder,
    x: f32,
    y: f32,
}

impl OutlinePen for Pen {
    fn move_to(&mut self, x: f32, y: f32) {
        self.path.move_to(self.x + x, self.y - y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        self.path.line_to(self.x + x, self.y - y);
    }

    fn quad_to(&mut self, cx: f32, cy: f32, x: f32, y: f32) {
        self.path.quad_to(self.x + cx, self.y - cy, self.x + x, self.y - y);
    }

    fn curve_to(&mut self, ax: f32, ay: f32, bx: f32, by: f32, x: f32, y: f32) {
        let (left, base) = (self.x, self.y);
        self.path.cubic_to(left + ax, base - ay, left + bx, base - by, left + x, base - y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}

#[cfg(test)]
#[path = "tests/font.rs"]
mod tests;
