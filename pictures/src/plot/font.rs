//! What the font of the pictures can write, and how wide it is.

use skrifa::instance::{LocationRef, Size};
use skrifa::{FontRef, MetadataProvider};

/// The bold font of headings.
pub struct Font {
    font: FontRef<'static>,
}

/// A heading as it is written, and what has to be said of it.
pub struct Heading {
    pub text: String,
    /// How many characters the font lacks; each is written as `?`.
    pub missing: usize,
}

impl Font {
    /// `None` if the font that is built in cannot be read, which no input makes.
    pub fn bold() -> Option<Self> {
        FontRef::new(notosans::BOLD_TTF).ok().map(|font| Self { font })
    }

    fn has(&self, c: char) -> bool {
        self.font.charmap().map(c).is_some()
    }

    /// The width of a text, `size` units high.
    fn width(&self, text: &str, size: f64) -> f64 {
        let metrics = self.font.glyph_metrics(Size::new(size as f32), LocationRef::default());
        let charmap = self.font.charmap();
        let advances = text.chars().filter_map(|c| metrics.advance_width(charmap.map(c)?));
        advances.map(f64::from).sum()
    }

    /// `text` with `?` for what the font lacks, and cut with an ellipsis in its middle where
    /// it is wider than `room`: its end says as much as its beginning.
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
        // No letter has less than an eighth of its height.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_headings_keep_their_ends_and_fit() {
        let font = Font::bold().unwrap();
        let short = font.heading("drop scene, seed 42", 17.0, 1080.0);
        assert_eq!((short.text.as_str(), short.missing), ("drop scene, seed 42", 0));
        let long = format!("Motion: {} scene, seed 42, native", "wide ".repeat(200_000));
        let cut = font.heading(&long, 17.0, 1080.0).text;
        assert!(cut.starts_with("Motion: wide") && cut.ends_with("scene, seed 42, native"));
        assert!(cut.contains('…'));
        let width = font.width(&cut, 17.0);
        assert!((1050.0..=1080.0).contains(&width), "{width}");
    }

    #[test]
    fn what_the_font_lacks_is_counted() {
        let font = Font::bold().unwrap();
        let heading = font.heading("Würfel 立方体 Ωμ", 17.0, 1080.0);
        assert_eq!((heading.text.as_str(), heading.missing), ("Würfel ??? Ωμ", 3));
    }
}
