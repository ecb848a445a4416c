//! Camera and projection. Points are in the ground's frame. The camera is upright in the world, so
//! that slopes appear inclined.

use super::framing::{FILL, FILL_ABOVE, HALF_VIEW, Window};
use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::Serialize;

/// Picture point with depth: x, y (pixels) and w = 1/z (1/m).
pub type Spot = [f64; 3];

/// View direction (degrees).
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct View {
    /// Azimuth of the camera about the vertical, from the x axis towards the y axis.
    pub azimuth: f64,
    /// Elevation of the camera above the horizon.
    pub elevation: f64,
}

impl Default for View {
    /// Default view. Motion along y, as in the drop scene, goes to the right.
    fn default() -> Self {
        Self { azimuth: -32.0, elevation: 20.0 }
    }
}

/// Fixed camera with a window on its view.
pub struct Camera {
    /// Rotation from the ground to the axes right, up, forward.
    axes: Matrix3<f64>,
    /// Position of the camera in its own axes (m).
    eye: Vector3<f64>,
    /// Centre of the picture (pixels).
    middle: f64,
    /// Part of the view that is in the picture.
    pub window: Window,
}

impl Camera {
    /// Camera in direction `view` at the smallest distance with all `points` in a picture of `size`
    /// pixels. `to_ground` rotates world axes to those of the points.
    ///
    /// A point (x, y, z) in camera axes is visible from e if |x − e_x| ≤ a (z − e_z), and likewise
    /// for y. Over all points this is e_x − a e_z ≥ max(x − a z) and e_x + a e_z ≤ min(x + a z).
    /// The largest e_z satisfies both with equality. The other coordinates are centred in the
    /// remaining interval.
    pub fn fit(view: View, to_ground: &Rotation3<f64>, size: u16, points: &[Vector3<f64>]) -> Self {
        let axes = axes(view) * to_ground.matrix().transpose();
        let (side, above) = (HALF_VIEW * FILL, HALF_VIEW * FILL_ABOVE);
        let slopes = [(side, side), (above, side)];
        let mut low = [f64::NEG_INFINITY; 2];
        let mut high = [f64::INFINITY; 2];
        let (mut near, mut far) = (f64::INFINITY, f64::NEG_INFINITY);
        for point in points {
            let p = axes * point;
            for (k, (up, down)) in slopes.into_iter().enumerate() {
                low[k] = low[k].max(p[k] - up * p[2]);
                high[k] = high[k].min(p[k] + down * p[2]);
            }
            (near, far) = (near.min(p[2]), far.max(p[2]));
        }
        let mut depth = near - 0.05 * (far - near);
        for (k, (up, down)) in slopes.into_iter().enumerate() {
            depth = depth.min((high[k] - low[k]) / (up + down));
        }
        let across = |k: usize| {
            let (up, down) = slopes[k];
            0.5 * ((low[k] + up * depth) + (high[k] - down * depth))
        };
        let eye = Vector3::new(across(0), across(1), depth);
        Self { axes, eye, middle: f64::from(size) / 2.0, window: Window::WHOLE }
    }

    /// Pixel of a point, x to the right and y down.
    pub fn project(&self, point: &Vector3<f64>) -> [f32; 2] {
        let [x, y, _] = self.spot(point);
        [x as f32, y as f32]
    }

    /// Pixel and depth of a point: x, y and 1/z with z along the view.
    pub fn spot(&self, point: &Vector3<f64>) -> Spot {
        let ([x, y], w) = self.slopes(point);
        let (middle, scale) = (self.window.middle, self.scale());
        [self.middle + scale * (x - middle[0]), self.middle - scale * (y - middle[1]), w]
    }

    /// Slopes of a point to the right and up, and 1/z.
    pub fn slopes(&self, point: &Vector3<f64>) -> ([f64; 2], f64) {
        let p = self.axes * point - self.eye;
        let w = 1.0 / p[2];
        ([p[0] * w, p[1] * w], w)
    }

    /// Pixels per unit slope.
    fn scale(&self) -> f64 {
        self.middle / self.window.half
    }

    /// Size in pixels of a length across the view at a spot.
    pub fn pixels(&self, length: f64, spot: Spot) -> f64 {
        self.scale() * length * spot[2]
    }

    /// Ray from the eye through a picture point, in the ground's frame. Its component along the
    /// view is 1.
    pub fn ray(&self, x: f64, y: f64) -> Vector3<f64> {
        let ([right, up], scale) = (self.window.middle, self.scale());
        let offset = [right + (x - self.middle) / scale, up + (self.middle - y) / scale];
        self.axes.transpose() * Vector3::new(offset[0], offset[1], 1.0)
    }

    /// Unit vector along the view, in the ground's frame.
    pub fn forward(&self) -> Vector3<f64> {
        self.axes.row(2).transpose()
    }

    /// Position of the camera, in the ground's frame.
    pub fn eye(&self) -> Vector3<f64> {
        self.axes.transpose() * self.eye
    }
}

/// Rotation from the world to the axes right, up, forward, valid up to elevation 90°.
fn axes(view: View) -> Matrix3<f64> {
    let (sin_a, cos_a) = view.azimuth.to_radians().sin_cos();
    let (sin_e, cos_e) = view.elevation.to_radians().sin_cos();
    #[rustfmt::skip]
    let axes = Matrix3::new(
        -sin_a, cos_a, 0.0,
        -cos_a * sin_e, -sin_a * sin_e, cos_e,
        -cos_a * cos_e, -sin_a * cos_e, -sin_e,
    );
    axes
}

#[cfg(test)]
#[path = "tests/camera.rs"]
mod tests;
