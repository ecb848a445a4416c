//! Depth-buffered drawing of bodies.
//!
//! Each pixel has a square of samples with depths. A depth is stored as w = 1/z with z along the
//! view. It is linear over the picture of a plane.

use super::camera::{Camera, Spot};
use super::canvas::Canvas;
use super::palette::Hue;
use crate::palette::Rgb;
use nalgebra::Vector3;

/// Samples per side of a pixel.
const SAMPLES: usize = 3;

/// Colour and depth samples.
pub struct Raster {
    /// Number of samples per side of the picture.
    side: usize,
    depths: Vec<f64>,
    colours: Vec<Rgb>,
    /// Ranges of painted pixel rows and columns, end exclusive.
    rows: (usize, usize),
    columns: (usize, usize),
}

impl Raster {
    pub fn new(size: usize) -> Self {
        let side = size * SAMPLES;
        let count = side * side;
        let (depths, colours) = (vec![0.0; count], vec![[0; 3]; count]);
        Self { side, depths, colours, rows: (0, 0), columns: (0, 0) }
    }

    /// Clears all samples.
    pub fn clear(&mut self) {
        let (left, right) = (self.columns.0 * SAMPLES, self.columns.1 * SAMPLES);
        for row in self.rows.0 * SAMPLES..self.rows.1 * SAMPLES {
            self.depths[row * self.side + left..row * self.side + right].fill(0.0);
        }
        let size = self.side / SAMPLES;
        (self.rows, self.columns) = ((size, 0), (size, 0));
    }

    /// Paints a rectangle of pixels. `sample` returns colour and w of a sample. In the row at y
    /// only the interval `span(y)` is evaluated, extended by one sample at both ends.
    fn paint(
        &mut self,
        [low, high]: [Pixel64; 2],
        span: impl Fn(f64) -> (f64, f64),
        mut sample: impl FnMut(f64, f64) -> Option<(Rgb, f64)>,
    ) {
        let side = self.side;
        let cut = |x: f64| ((x * SAMPLES as f64).max(0.0) as usize).min(side);
        let (left, right) = (cut(low[0]), cut(high[0] + 1.0));
        let (top, bottom) = (cut(low[1]), cut(high[1] + 1.0));
        if left >= right || top >= bottom {
            return;
        }
        self.rows.0 = self.rows.0.min(top / SAMPLES);
        self.rows.1 = self.rows.1.max(bottom.div_ceil(SAMPLES));
        self.columns.0 = self.columns.0.min(left / SAMPLES);
        self.columns.1 = self.columns.1.max(right.div_ceil(SAMPLES));
        for row in top..bottom {
            let y = (row as f64 + 0.5) / SAMPLES as f64;
            let (from, to) = span(y);
            for column in left.max(cut(from).saturating_sub(1))..right.min(cut(to) + 2) {
                let x = (column as f64 + 0.5) / SAMPLES as f64;
                let Some((colour, w)) = sample(x, y) else { continue };
                let i = row * self.side + column;
                if w > self.depths[i] {
                    (self.depths[i], self.colours[i]) = (w, colour);
                }
            }
        }
    }

    /// Paints a planar convex polygon. `lights` is the reflected light at its corners.
    pub fn polygon(&mut self, corners: &[Spot], hue: &Hue, lights: &[f32]) {
        for k in 2..corners.len() {
            let [i, j] = [k - 1, k];
            let lights = [lights[0], lights[i], lights[j]];
            self.triangle([corners[0], corners[i], corners[j]], hue, lights);
        }
    }

    fn triangle(&mut self, [a, b, c]: [Spot; 3], hue: &Hue, lights: [f32; 3]) {
        let area = across(a, b, c);
        if area == 0.0 || !area.is_finite() {
            return;
        }
        // Flat triangles are the most common, and fast.
        let flat = (lights[0] == lights[1] && lights[1] == lights[2]).then(|| hue.lit(lights[0]));
        let across_row = |y: f64| {
            let edges = [[a, b], [b, c], [c, a]].map(|edge| within(edge, y, y));
            edges.into_iter().fold(NOWHERE, |all, one| (all.0.min(one.0), all.1.max(one.1)))
        };
        self.paint(bounds(&[a, b, c], 0.0), across_row, |x, y| {
            let p = [x, y, 0.0];
            let shares = [across(b, c, p), across(c, a, p), across(a, b, p)].map(|s| s / area);
            let inside = shares.iter().all(|share| *share >= 0.0);
            let w = shares[0] * a[2] + shares[1] * b[2] + shares[2] * c[2];
            let light = || {
                let parts = shares.iter().zip(lights);
                parts.map(|(share, light)| *share as f32 * light).sum()
            };
            inside.then(|| (flat.unwrap_or_else(|| hue.lit(light())), w))
        });
    }

    /// Paints a line with round ends, `width` pixels wide.
    pub fn line(&mut self, a: Spot, b: Spot, width: f64, colour: Rgb) {
        let reach = (width / 2.0).powi(2);
        let place = nearest(a, b);
        self.paint(bounds(&[a, b], width / 2.0), about([a, b], width / 2.0), |x, y| {
            let (share, apart) = place(x, y);
            (apart <= reach).then_some((colour, a[2] + share * (b[2] - a[2])))
        });
    }

    /// Casts camera rays within `margin` pixels of the line from a to b. `hit` returns the distance
    /// along the view and the colour of the first intersection.
    pub fn trace(
        &mut self,
        camera: &Camera,
        [a, b]: [Spot; 2],
        margin: f64,
        mut hit: impl FnMut(&Vector3<f64>) -> Option<(f64, Rgb)>,
    ) {
        let share = nearest(a, b);
        self.paint(bounds(&[a, b], margin), about([a, b], margin), |x, y| {
            let (_, apart) = share(x, y);
            if apart > margin * margin {
                return None;
            }
            let (distance, colour) = hit(&camera.ray(x, y))?;
            Some((colour, 1.0 / distance))
        });
    }

    /// True if something is in front of a spot by more than `room` (m) in all pixels around it. A
    /// spot at an outline is not hidden.
    pub fn hides(&self, [x, y, w]: Spot, room: f64) -> bool {
        let size = (self.side / SAMPLES) as f64;
        if !(x >= 1.0 && y >= 1.0 && x < size - 1.0 && y < size - 1.0) {
            return false;
        }
        let least = 1.0 / (1.0 / w - room).max(0.0);
        let (left, top) = ((x as usize - 1) * SAMPLES, (y as usize - 1) * SAMPLES);
        let rows = (top..top + 3 * SAMPLES).map(|row| row * self.side + left);
        rows.flat_map(|start| &self.depths[start..start + 3 * SAMPLES]).all(|w| *w > least)
    }

    /// Blends the samples over `canvas`.
    pub fn compose(&self, canvas: &mut Canvas) {
        for y in self.rows.0..self.rows.1 {
            for x in self.columns.0..self.columns.1 {
                let start = y * SAMPLES * self.side + x * SAMPLES;
                let (mut count, mut sum) = (0u16, [0u16; 3]);
                for row in 0..SAMPLES {
                    for i in start + row * self.side..start + row * self.side + SAMPLES {
                        if self.depths[i] > 0.0 {
                            count += 1;
                            for (sum, part) in sum.iter_mut().zip(self.colours[i]) {
                                *sum += u16::from(part);
                            }
                        }
                    }
                }
                if count > 0 {
                    canvas.blend(x, y, sum, count, (SAMPLES * SAMPLES) as u16);
                }
            }
        }
    }
}

type Pixel64 = [f64; 2];

/// Empty interval of a row.
const NOWHERE: (f64, f64) = (f64::INFINITY, f64::NEG_INFINITY);

/// Interval in x of the line from a to b for y from `low` to `high`.
fn within([a, b]: [Spot; 2], low: f64, high: f64) -> (f64, f64) {
    let [a, b] = if a[1] <= b[1] { [a, b] } else { [b, a] };
    if a[1] > high || b[1] < low {
        return NOWHERE;
    }
    let rise = b[1] - a[1];
    let at = |y: f64| {
        let share = if rise > 0.0 { ((y - a[1]) / rise).clamp(0.0, 1.0) } else { 0.0 };
        a[0] + share * (b[0] - a[0])
    };
    let (from, to) = if rise > 0.0 { (at(low), at(high)) } else { (a[0], b[0]) };
    (from.min(to), from.max(to))
}

/// Interval of a row that contains all points within `margin` of the line from a to b.
fn about(line: [Spot; 2], margin: f64) -> impl Fn(f64) -> (f64, f64) {
    move |y| {
        let (from, to) = within(line, y - margin, y + margin);
        (from - margin, to + margin)
    }
}

/// Parameter from 0 to 1 of the nearest point on the line from a to b, and squared distance to it
/// (pixels²).
fn nearest(a: Spot, b: Spot) -> impl Fn(f64, f64) -> (f64, f64) {
    let edge = [b[0] - a[0], b[1] - a[1]];
    let square = edge[0] * edge[0] + edge[1] * edge[1];
    move |x, y| {
        let along = (x - a[0]) * edge[0] + (y - a[1]) * edge[1];
        let share = if square > 0.0 { (along / square).clamp(0.0, 1.0) } else { 0.0 };
        let (dx, dy) = (x - a[0] - share * edge[0], y - a[1] - share * edge[1]);
        (share, dx * dx + dy * dy)
    }
}

/// Bounding rectangle of spots, extended by `margin` pixels.
fn bounds(spots: &[Spot], margin: f64) -> [Pixel64; 2] {
    let ends = |k: usize| {
        let values = spots.iter().map(move |spot| spot[k]);
        values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)))
    };
    let ((left, right), (top, bottom)) = (ends(0), ends(1));
    [[left - margin, top - margin], [right + margin, bottom + margin]]
}

/// Twice the signed area of a triangle in the picture.
fn across(a: Spot, b: Spot, c: Spot) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
#[path = "tests/raster.rs"]
mod tests;
