//! Ground with grid and shadows.

use super::camera::Camera;
use super::canvas::Canvas;
use super::outline::hull;
use super::palette::{FADES, SHADOW_STEPS, mix};
use crate::palette::Theme;
use nalgebra::{Vector2, Vector3};

/// Approximate number of grid lines along the longer side of the motion.
const LINES: f64 = 10.0;

/// Radius of the ground over that of the motion, and share of it from which the ground fades.
const REACH: f64 = 3.2;
const FADE_START: f64 = 0.35;

/// Horizontal over vertical component of the light direction. The light is 65° above the horizon.
const LEAN: f64 = 0.466;
/// Diameter of the light's disc over its distance. Shadows get softer with height.
const SPREAD: f64 = 0.05;

/// Direction of the light.
#[derive(Debug, Clone, Copy)]
pub struct Light {
    /// Horizontal direction of the shadows, unit vector.
    away: Vector2<f64>,
}

impl Light {
    /// Light relative to the camera. Shadows fall to the right and backwards.
    pub fn for_azimuth(degrees: f64) -> Self {
        let angle = (degrees + 116.0).to_radians();
        Self { away: Vector2::new(angle.cos(), angle.sin()) }
    }

    /// Unit vector towards the light.
    pub fn direction(&self) -> Vector3<f64> {
        Vector3::new(-LEAN * self.away.x, -LEAN * self.away.y, 1.0).normalize()
    }

    /// Shadow of `point` on the ground, cast by one part of the light's disc.
    fn cast(&self, point: &Vector3<f64>, part: u8) -> Vector3<f64> {
        let angle = std::f64::consts::TAU * f64::from(part) / f64::from(SHADOW_STEPS);
        let lean = LEAN * self.away + SPREAD * Vector2::new(angle.cos(), angle.sin());
        let above = point.z.max(0.0);
        Vector3::new(point.x + above * lean.x, point.y + above * lean.y, 0.0)
    }
}

/// Maximum number of grid lines across the ground.
const MOST_LINES: f64 = 400.0;

/// Ground with a grid that fades to the background around the motion.
pub struct Floor {
    middle: Vector2<f64>,
    /// Radius at which the ground has faded (m).
    radius: f64,
    /// Spacing of the grid (m): 1, 2 or 5 times a power of ten.
    spacing: f64,
    light: Light,
}

impl Floor {
    /// Floor under `points`.
    pub fn under(points: &[Vector3<f64>], light: Light) -> Self {
        let (mut low, mut high) =
            (Vector2::repeat(f64::INFINITY), Vector2::repeat(f64::NEG_INFINITY));
        for point in points {
            (low, high) = (low.inf(&point.xy()), high.sup(&point.xy()));
        }
        let radius = (REACH * 0.5 * (high - low).norm()).max(1e-9);
        let spacing = round_length((high - low).max().max(1e-9) / LINES);
        Self { middle: 0.5 * (low + high), radius, spacing, light }
    }

    /// Floor with a grid that suits a picture that shows `width` (m).
    pub fn with_grid_for(self, width: f64) -> Self {
        let least = 2.0 * self.radius / MOST_LINES;
        Self { spacing: round_length((width / LINES).max(least)), ..self }
    }

    /// Shadow of `point` and its rim.
    pub fn shadows(&self, point: &Vector3<f64>) -> impl Iterator<Item = Vector3<f64>> {
        let (light, point) = (self.light, *point);
        (0..SHADOW_STEPS).map(move |part| light.cast(&point, part))
    }

    /// Paints ground and grid.
    pub fn paint(&self, canvas: &mut Canvas, camera: &Camera, theme: &Theme) {
        let (eye, unit) = (camera.eye(), f64::from(canvas.size()) / 800.0);
        canvas.paint_all(|x, y| {
            let ray = camera.ray(x, y);
            let far = -eye.z / ray.z;
            if far.is_nan() || far <= 0.0 {
                return None;
            }
            let place = (eye + ray * far).xy();
            let fade = self.fade(&place);
            // Change of the place from pixel to pixel, in cells of the grid.
            let next = [camera.ray(x + 1.0, y), camera.ray(x, y + 1.0)]
                .map(|ray| ((eye - ray * (eye.z / ray.z)).xy() - place) / self.spacing);
            let mut line: f64 = 0.0;
            for axis in 0..2 {
                let pixel = (next[0][axis].abs() + next[1][axis].abs()).max(1e-9);
                let cell = place[axis] / self.spacing;
                let off = (cell - cell.round()).abs() / pixel;
                let near = (0.5 + 0.6 * unit - off).clamp(0.0, 1.0);
                // Lines closer than a few pixels merge into the ground.
                line = line.max(near * (1.4 - 6.0 * pixel).clamp(0.0, 1.0));
            }
            let paint = mix(theme.ground, theme.grid, line as f32);
            Some(mix(theme.sky, paint, fade))
        });
    }

    /// Share of the ground's colour at a place, from 1 near the motion to 0 far from it, in
    /// [`FADES`] steps.
    fn fade(&self, place: &Vector2<f64>) -> f32 {
        let far = (place - self.middle).norm() / self.radius;
        let share = ((far - FADE_START) / (1.0 - FADE_START)).clamp(0.0, 1.0);
        let smooth = 1.0 - share * share * (3.0 - 2.0 * share);
        ((smooth * f64::from(FADES)).round() / f64::from(FADES)) as f32
    }

    /// Paints the shadows of convex pieces, each given by points that span it. Each part of the
    /// light's disc casts one layer. Overlapping shadows are not darker.
    pub fn paint_shadows(
        &self,
        canvas: &mut Canvas,
        camera: &Camera,
        pieces: &[Vec<Vector3<f64>>],
        theme: &Theme,
    ) {
        // Opacity of one layer, such that all layers together have the depth of the theme.
        let cover = 1.0 - (1.0 - theme.shadow_depth).powf(1.0 / f32::from(SHADOW_STEPS));
        for part in 0..SHADOW_STEPS {
            let cast = |points: &Vec<Vector3<f64>>| {
                let spots = points.iter().map(|point| camera.spot(&self.light.cast(point, part)));
                hull(&spots.collect::<Vec<_>>())
                    .iter()
                    .map(|s| [s[0] as f32, s[1] as f32])
                    .collect()
            };
            canvas.fill_union(&pieces.iter().map(cast).collect::<Vec<_>>(), theme.shadow, cover);
        }
    }
}

/// The smallest of 1, 2, 5 times a power of ten that is at least `length`.
fn round_length(length: f64) -> f64 {
    let power = 10f64.powf(length.log10().floor());
    let digit = [1.0, 2.0, 5.0].into_iter().find(|digit| digit * power >= length);
    digit.unwrap_or(10.0) * power
}

#[cfg(test)]
#[path = "tests/floor.rs"]
mod tests;
