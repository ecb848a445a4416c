//! Time display and labels.

use super::canvas::{Canvas, Pixel};
use super::palette::{INK, SEAM};
use crate::font::Font;

/// Height of a digit over the font size.
const DIGIT_HEIGHT: f32 = 0.714;
/// Width of a label's outline over the font size.
const SEAM_WIDTH: f32 = 0.25;

/// Writes `text` from the baseline point `at` with digits `height` pixels high.
pub fn write(canvas: &mut Canvas, font: &Font, text: &str, at: Pixel, height: f32) {
    if let Some(path) = font.path(text, height / DIGIT_HEIGHT, at) {
        canvas.fill_path(&path, INK);
    }
}

/// Writes `text` horizontally centred at `at`, with an outline.
pub fn label(canvas: &mut Canvas, font: &Font, text: &str, [x, y]: Pixel, height: f32) {
    let size = height / DIGIT_HEIGHT;
    let left = x - font.width(text, size.into()) as f32 / 2.0;
    if let Some(path) = font.path(text, size, [left, y]) {
        canvas.stroke(&path, SEAM_WIDTH * size, SEAM);
        canvas.fill_path(&path, INK);
    }
}
