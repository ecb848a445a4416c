//! Time display and labels.

use super::canvas::{Canvas, Pixel};
use crate::font::Font;
use crate::palette::Theme;

/// Height of a digit over the font size.
const DIGIT_HEIGHT: f32 = 0.714;
/// Width of a label's outline over the font size.
const SEAM_WIDTH: f32 = 0.25;

/// Distance between labels over the height of a digit.
const GAP: f32 = 0.6;

/// Text to write.
pub struct Lettering<'a> {
    pub text: &'a str,
    /// Start of the baseline, or its middle for a label (pixels).
    pub at: Pixel,
    /// Height of a digit (pixels).
    pub height: f32,
}

/// Writes text from its start.
pub fn write(canvas: &mut Canvas, font: &Font, words: &Lettering<'_>, theme: &Theme) {
    if let Some(path) = font.path(words.text, words.height / DIGIT_HEIGHT, words.at) {
        canvas.fill_path(&path, theme.ink);
    }
}

/// Writes labels with an outline, horizontally centred. One that would overlap another moves up.
pub fn draw_labels(canvas: &mut Canvas, font: &Font, words: &[Lettering<'_>], theme: &Theme) {
    let mut taken: Vec<[Pixel; 2]> = Vec::new();
    for Lettering { text, at: [x, y], height } in words {
        let size = height / DIGIT_HEIGHT;
        let half = font.width(text, size.into()) as f32 / 2.0;
        let place = |y: f32| [[x - half, y - height], [x + half, y]];
        let overlaps = |a: &[Pixel; 2], b: &[Pixel; 2]| {
            let gap = GAP * height;
            (0..2).all(|k| a[0][k] < b[1][k] + gap && b[0][k] < a[1][k] + gap)
        };
        let mut y = *y;
        for _ in 0..taken.len() {
            let Some(other) = taken.iter().find(|other| overlaps(&place(y), other)) else { break };
            y = other[0][1] - 1.01 * GAP * height;
        }
        taken.push(place(y));
        if let Some(path) = font.path(text, size, [x - half, y]) {
            canvas.stroke(&path, SEAM_WIDTH * size, theme.seam);
            canvas.fill_path(&path, theme.ink);
        }
    }
}
