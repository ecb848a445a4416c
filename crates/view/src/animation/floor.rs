//! Ground with grid and shadows.

use super::camera::Camera;
use super::canvas::Canvas;
use super::outline::hull;
use super::palette::{GROUND, LINE, SHADOW, SHADOW_DEPTH, SHADOW_STEPS};
use nalgebra::{Vector2, Vector3};

/// Approximate number of grid lines along the longer side.
const LINES: f64 = 14.0;

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
    /// Light relative to the camera. Shadows fall to the left and backwards.
    pub fn for_azimuth(degrees: f64) -> Self {
        let angle = (degrees - 125.0).to_radians();
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

/// Extent of an endless floor over the distance of the visible motion.
const FARTHEST: f64 = 4.0;

/// Maximum number of grid lines of an endless floor.
const MOST_LINES: f64 = 400.0;

/// Rectangle of ground with a grid.
pub struct Floor {
    low: Vector2<f64>,
    high: Vector2<f64>,
    /// Spacing of the grid (m): 1, 2 or 5 times a power of ten.
    spacing: f64,
    light: Light,
    /// Visible range along the view direction (m), if the floor is endless.
    farthest: Option<f64>,
}

impl Floor {
    /// Floor under `points`, including their shadows.
    pub fn under(points: &[Vector3<f64>], light: Light) -> Self {
        let mut low = Vector2::repeat(f64::INFINITY);
        let mut high = -low;
        for point in points {
            let shadows = (0..SHADOW_STEPS).map(|part| light.cast(point, part));
            for place in shadows.chain([*point]) {
                low = low.inf(&place.xy());
                high = high.sup(&place.xy());
            }
        }
        let spacing = round_length((high - low).max() / LINES);
        let margin = Vector2::repeat(0.4 * spacing);
        let low = ((low - margin) / spacing).map(f64::floor) * spacing;
        let high = ((high + margin) / spacing).map(f64::ceil) * spacing;
        Self { low, high, spacing, light, farthest: None }
    }

    /// Endless floor. Its grid suits a picture that shows `width` (m) at `distance` (m).
    pub fn endless(self, width: f64, distance: f64) -> Self {
        let spacing = round_length(width / LINES);
        Self { spacing, farthest: Some(FARTHEST * distance), ..self }
    }

    /// Corners of the rectangle.
    pub fn corners(&self) -> [Vector3<f64>; 4] {
        let (a, b) = (self.low, self.high);
        [(a.x, a.y), (b.x, a.y), (b.x, b.y), (a.x, b.y)].map(|(x, y)| Vector3::new(x, y, 0.0))
    }

    /// Paints ground and grid.
    pub fn paint(&self, canvas: &mut Canvas, camera: &Camera) {
        if let Some(farthest) = self.farthest {
            return self.paint_endless(canvas, camera, farthest);
        }
        let outline = self.corners().map(|corner| camera.project(&corner));
        canvas.fill(&outline, GROUND, 1.0);
        let width = canvas.size() / 800.0;
        let lines = ((self.high - self.low) / self.spacing).map(f64::round);
        for axis in 0..2 {
            for k in 1..lines[axis] as u32 {
                let mut from = self.low;
                from[axis] += f64::from(k) * self.spacing;
                let mut to = from;
                to[1 - axis] = self.high[1 - axis];
                let ends = [from, to].map(|end| camera.project(&Vector3::new(end.x, end.y, 0.0)));
                canvas.line(&ends, false, width, LINE);
            }
        }
        canvas.line(&outline, true, 1.6 * width, LINE);
    }

    /// Paints the visible part of an endless floor.
    ///
    /// A ray from the eye e through the picture point (x, y) has direction r, linear in x and y. It
    /// meets the ground at −e_z/r_z. This is nearer than `farthest` if −r_z is at least
    /// e_z/`farthest`.
    fn paint_endless(&self, canvas: &mut Canvas, camera: &Camera, farthest: f64) {
        let (size, eye) = (f64::from(canvas.size()), camera.eye());
        let below =
            |[x, y]: [f64; 2]| -eye.z.signum() * camera.ray(x, y).z - eye.z.abs() / farthest;
        let square = [[0.0, 0.0], [size, 0.0], [size, size], [0.0, size]];
        let mut seen: Vec<[f64; 2]> = Vec::new();
        for (k, &from) in square.iter().enumerate() {
            let to = square[(k + 1) % 4];
            let (a, b) = (below(from), below(to));
            if a >= 0.0 {
                seen.push(from);
            }
            if (a < 0.0) != (b < 0.0) {
                seen.push([0, 1].map(|k| from[k] + a / (a - b) * (to[k] - from[k])));
            }
        }
        let outline: Vec<_> = seen.iter().map(|place| place.map(|x| x as f32)).collect();
        canvas.fill(&outline, GROUND, 1.0);
        let on_ground = |[x, y]: &[f64; 2]| {
            let ray = camera.ray(*x, *y);
            (eye - ray * (eye.z / ray.z)).xy()
        };
        let ground: Vec<_> = seen.iter().map(on_ground).collect();
        for axis in 0..2 {
            let ends = ground.iter().map(|place| place[axis]);
            let low = ends.clone().fold(f64::INFINITY, f64::min);
            let high = ends.fold(f64::NEG_INFINITY, f64::max);
            // Coarser lines for views along the ground.
            let crowd = ((high - low) / (self.spacing * MOST_LINES)).max(1.0);
            let spacing = self.spacing * 10f64.powf(crowd.log10().ceil());
            let (first, last) = ((low / spacing).ceil() as i64, (high / spacing).floor() as i64);
            for k in first..=last {
                let ends = chord(&ground, axis, k as f64 * spacing);
                let ends = ends.map(|end| camera.project(&Vector3::new(end.x, end.y, 0.0)));
                canvas.line(&ends.collect::<Vec<_>>(), false, canvas.size() / 800.0, LINE);
            }
        }
    }

    /// Paints the shadows of convex pieces, each given by points that span it. Each part of the
    /// light's disc casts one layer. Overlapping shadows are not darker.
    pub fn paint_shadows(
        &self,
        canvas: &mut Canvas,
        camera: &Camera,
        pieces: &[Vec<Vector3<f64>>],
    ) {
        // Opacity of one layer, such that all layers together have SHADOW_DEPTH.
        let cover = 1.0 - (1.0 - SHADOW_DEPTH).powf(1.0 / f32::from(SHADOW_STEPS));
        for part in 0..SHADOW_STEPS {
            let cast = |points: &Vec<Vector3<f64>>| {
                let spots = points.iter().map(|point| camera.spot(&self.light.cast(point, part)));
                hull(&spots.collect::<Vec<_>>())
                    .iter()
                    .map(|s| [s[0] as f32, s[1] as f32])
                    .collect()
            };
            canvas.fill_union(&pieces.iter().map(cast).collect::<Vec<_>>(), SHADOW, cover);
        }
    }
}

/// End points of the chord of a convex polygon at coordinate `axis` = `at`.
fn chord(
    polygon: &[Vector2<f64>],
    axis: usize,
    at: f64,
) -> impl Iterator<Item = Vector2<f64>> + '_ {
    let edges = polygon.iter().zip(polygon.iter().cycle().skip(1));
    edges.filter_map(move |(from, to)| {
        let (a, b) = (from[axis] - at, to[axis] - at);
        ((a < 0.0) != (b < 0.0)).then(|| from + (to - from) * (a / (a - b)))
    })
}

/// The smallest of 1, 2, 5 times a power of ten that is at least `length`.
fn round_length(length: f64) -> f64 {
    let power = 10f64.powf(length.log10().floor());
    let digit = [1.0, 2.0, 5.0].into_iter().find(|digit| digit * power >= length);
    digit.unwrap_or(10.0) * power
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_grid_has_round_lengths() {
        for (length, round) in [(0.7, 1.0), (1.1, 2.0), (2.5, 5.0), (60.0, 100.0), (0.02, 0.02)] {
            assert!((round_length(length) / round - 1.0).abs() < 1e-12, "{length}");
        }
    }

    #[test]
    fn points_and_shadows_are_on_the_floor() {
        let light = Light::for_azimuth(10.0);
        let points = [Vector3::new(1.0, 2.0, 3.0), Vector3::new(-4.0, 2.5, 0.0)];
        let floor = Floor::under(&points, light);
        let cast = light.cast(&points[0], 3);
        for place in [points[0], points[1], cast] {
            assert!(floor.low < place.xy() && place.xy() < floor.high, "{place}");
        }
    }
}
