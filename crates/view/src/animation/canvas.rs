//! Antialiased painting of polygons, lines and dots, in pixels.

use super::AnimationError;
use crate::palette::Rgb;
use crate::png::marked;
use std::io;
use tiny_skia::{FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, Transform};

/// Point of the picture, x to the right and y down.
pub type Pixel = [f32; 2];

/// Square picture.
#[derive(Clone)]
pub struct Canvas {
    pixmap: Pixmap,
}

impl Canvas {
    /// Creates a picture. `None` if `size` is 0.
    pub fn new(size: u16, background: Rgb) -> Option<Self> {
        let mut canvas = Self { pixmap: Pixmap::new(u32::from(size), u32::from(size))? };
        canvas.clear(background);
        Some(canvas)
    }

    /// Fills the picture with one colour.
    pub fn clear(&mut self, [red, green, blue]: Rgb) {
        self.pixmap.fill(tiny_skia::Color::from_rgba8(red, green, blue, 255));
    }

    /// Sets the pixels for which `colour` returns one, at the middle of each pixel.
    pub fn paint_all(&mut self, colour: impl Fn(f64, f64) -> Option<Rgb>) {
        let width = self.pixmap.width() as usize;
        for (i, pixel) in self.pixmap.data_mut().chunks_exact_mut(4).enumerate() {
            let (x, y) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
            if let Some(colour) = colour(x, y) {
                pixel[..3].copy_from_slice(&colour);
            }
        }
    }

    /// Width in pixels.
    pub fn size(&self) -> f32 {
        self.pixmap.width() as f32
    }

    /// Copies another picture of the same size.
    pub fn copy_from(&mut self, other: &Self) {
        self.pixmap.data_mut().copy_from_slice(other.pixmap.data());
    }

    /// Encodes the picture as PNG.
    pub fn png(&self) -> Result<Vec<u8>, AnimationError> {
        marked(&self.pixmap).map_err(|why| AnimationError::Output(io::Error::other(why)))
    }

    /// Colours row by row. The background is opaque, and therefore all pixels are.
    pub fn colours(&self) -> impl Iterator<Item = Rgb> + '_ {
        self.pixmap.data().chunks_exact(4).map(|pixel| [pixel[0], pixel[1], pixel[2]])
    }

    /// Fills a polygon with opacity `cover`.
    pub fn fill(&mut self, corners: &[Pixel], colour: Rgb, cover: f32) {
        if let Some(path) = path(corners, true) {
            let transform = Transform::identity();
            self.pixmap.fill_path(&path, &paint(colour, cover), FillRule::Winding, transform, None);
        }
    }

    pub fn fill_union(&mut self, polygons: &[Vec<Pixel>], colour: Rgb, cover: f32) {
        let mut path = PathBuilder::new();
        for polygon in polygons.iter().filter(|polygon| polygon.len() > 2) {
            for (i, &[x, y]) in polygon.iter().enumerate() {
                if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
            }
            path.close();
        }
        if let Some(path) = path.finish() {
            let transform = Transform::identity();
            self.pixmap.fill_path(&path, &paint(colour, cover), FillRule::Winding, transform, None);
        }
    }

    /// Blends `count` of `all` samples of a pixel. `sum` is the sum of their colours.
    pub fn blend(&mut self, x: usize, y: usize, sum: [u16; 3], count: u16, all: u16) {
        let start = 4 * (y * self.pixmap.width() as usize + x);
        let pixel = &mut self.pixmap.data_mut()[start..start + 3];
        for (part, sum) in pixel.iter_mut().zip(sum) {
            *part = ((u16::from(*part) * (all - count) + sum + all / 2) / all) as u8;
        }
    }

    pub fn fill_path(&mut self, path: &Path, colour: Rgb) {
        let (paint, whole) = (paint(colour, 1.0), Transform::identity());
        self.pixmap.fill_path(path, &paint, FillRule::Winding, whole, None);
    }

    /// Draws a line through `points` with round ends and corners.
    pub fn line(&mut self, points: &[Pixel], closed: bool, width: f32, colour: Rgb) {
        if let Some(path) = path(points, closed) {
            self.stroke(&path, width, colour);
        }
    }

    /// Strokes a path with round ends and corners.
    pub fn stroke(&mut self, path: &Path, width: f32, colour: Rgb) {
        let stroke = Stroke {
            width,
            line_cap: LineCap::Round,
            line_join: LineJoin::Round,
            ..Stroke::default()
        };
        self.pixmap.stroke_path(path, &paint(colour, 1.0), &stroke, Transform::identity(), None);
    }
}

fn paint(colour: Rgb, cover: f32) -> Paint<'static> {
    let mut paint = Paint::default();
    let [red, green, blue] = colour;
    paint.set_color_rgba8(red, green, blue, (255.0 * cover).round() as u8);
    paint
}

/// Path through points. `None` for fewer than two points or for NaN.
fn path(points: &[Pixel], closed: bool) -> Option<Path> {
    let (&[x, y], rest) = points.split_first()?;
    let mut path = PathBuilder::new();
    path.move_to(x, y);
    for &[x, y] in rest {
        path.line_to(x, y);
    }
    if closed {
        path.close();
    }
    path.finish()
}
