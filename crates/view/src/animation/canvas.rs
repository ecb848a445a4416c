//! Painting: filled polygons, lines and dots, antialiased, in pixels.

use super::palette::PaintColour;
use tiny_skia::{FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, Stroke, Transform};

/// A point of the picture, x to the right and y down.
pub type Pixel = [f32; 2];

/// A square picture.
#[derive(Clone)]
pub struct Canvas {
    pixmap: Pixmap,
}

impl Canvas {
    /// `None` if `size` is 0.
    pub fn new(size: u16, background: PaintColour) -> Option<Self> {
        let mut canvas = Self { pixmap: Pixmap::new(u32::from(size), u32::from(size))? };
        canvas.clear(background);
        Some(canvas)
    }

    /// Makes it all of one colour.
    pub fn clear(&mut self, [red, green, blue]: PaintColour) {
        self.pixmap.fill(tiny_skia::Color::from_rgba8(red, green, blue, 255));
    }

    /// Pixels across.
    pub fn size(&self) -> f32 {
        self.pixmap.width() as f32
    }

    /// Makes this picture the same as another of the same size.
    pub fn copy_from(&mut self, other: &Self) {
        self.pixmap.data_mut().copy_from_slice(other.pixmap.data());
    }

    /// As PNG; `None` if it cannot be encoded.
    pub fn png(&self) -> Option<Vec<u8>> {
        self.pixmap.encode_png().ok()
    }

    /// The colours by rows. The background is opaque, so all pixels are.
    pub fn colours(&self) -> impl Iterator<Item = PaintColour> + '_ {
        self.pixmap.data().chunks_exact(4).map(|pixel| [pixel[0], pixel[1], pixel[2]])
    }

    /// Fills a polygon; `cover` is 1 for opaque paint.
    pub fn fill(&mut self, corners: &[Pixel], colour: PaintColour, cover: f32) {
        if let Some(path) = path(corners, true) {
            let transform = Transform::identity();
            self.pixmap.fill_path(&path, &paint(colour, cover), FillRule::Winding, transform, None);
        }
    }

    /// Fills polygons that may overlap as one.
    pub fn fill_union(&mut self, polygons: &[Vec<Pixel>], colour: PaintColour, cover: f32) {
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

    /// Covers `count` of `all` samples of a pixel; their colours add up to `sum`.
    pub fn blend(&mut self, x: usize, y: usize, sum: [u16; 3], count: u16, all: u16) {
        let start = 4 * (y * self.pixmap.width() as usize + x);
        let pixel = &mut self.pixmap.data_mut()[start..start + 3];
        for (part, sum) in pixel.iter_mut().zip(sum) {
            *part = ((u16::from(*part) * (all - count) + sum + all / 2) / all) as u8;
        }
    }

    /// Fills an outline.
    pub fn fill_path(&mut self, path: &Path, colour: PaintColour) {
        let (paint, whole) = (paint(colour, 1.0), Transform::identity());
        self.pixmap.fill_path(path, &paint, FillRule::Winding, whole, None);
    }

    /// Draws a line through `points`, with round ends and corners.
    pub fn line(&mut self, points: &[Pixel], closed: bool, width: f32, colour: PaintColour) {
        if let Some(path) = path(points, closed) {
            self.stroke(&path, width, colour);
        }
    }

    /// Draws along a path, with round ends and corners.
    pub fn stroke(&mut self, path: &Path, width: f32, colour: PaintColour) {
        let stroke = Stroke {
            width,
            line_cap: LineCap::Round,
            line_join: LineJoin::Round,
            ..Stroke::default()
        };
        self.pixmap.stroke_path(path, &paint(colour, 1.0), &stroke, Transform::identity(), None);
    }
}

fn paint(colour: PaintColour, cover: f32) -> Paint<'static> {
    let mut paint = Paint::default();
    let [red, green, blue] = colour;
    paint.set_color_rgba8(red, green, blue, (255.0 * cover).round() as u8);
    paint
}

/// `None` for fewer than two points, and for points that are no numbers.
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
