//! Contact forces drawn as arrows.

use super::camera::Camera;
use super::canvas::Canvas;
use crate::palette::Theme;
use nalgebra::Vector3;

/// An arrow in the ground's frame.
pub struct Arrow {
    pub from: Vector3<f64>,
    pub to: Vector3<f64>,
    /// Size of its body (m).
    pub reach: f64,
}

/// Paints arrows on top of the picture, with an outline.
pub fn paint(canvas: &mut Canvas, camera: &Camera, arrows: &[&Arrow], theme: &Theme) {
    let unit = canvas.size() / 800.0;
    for (colour, extra) in [(theme.seam, 2.0 * unit), (theme.force, 0.0)] {
        for arrow in arrows {
            let (from, to) = (camera.project(&arrow.from), camera.project(&arrow.to));
            let (x, y) = (to[0] - from[0], to[1] - from[1]);
            let length = x.hypot(y);
            if !(length.is_finite() && length > 2.0 * unit) {
                continue;
            }
            let (x, y) = (x / length, y / length);
            let head = (14.0 * unit).min(0.6 * length);
            let neck = [to[0] - head * x, to[1] - head * y];
            let half = 0.4 * head;
            let sides = [-half, half].map(|w| [neck[0] - w * y, neck[1] + w * x]);
            let tip = [to, sides[0], sides[1]];
            canvas.line(&[from, neck], false, 3.0 * unit + extra, colour);
            canvas.line(&tip, true, unit + extra, colour);
            canvas.fill(&tip, colour, 1.0);
        }
    }
}
