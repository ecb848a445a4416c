//! Joints drawn as rings and axes.

use super::camera::Camera;
use super::canvas::{Canvas, Pixel};
use crate::palette::Theme;
use nalgebra::Vector3;

/// A joint in the ground's frame.
pub struct DrawnJoint {
    pub at: Vector3<f64>,
    /// Half of the drawn axis, if there is one.
    pub axis: Option<Vector3<f64>>,
}

/// Corners of a disc.
const CORNERS: u8 = 16;

/// Paints joints on top of the picture.
pub fn paint(canvas: &mut Canvas, camera: &Camera, pins: &[DrawnJoint], theme: &Theme) {
    let unit = canvas.size() / 800.0;
    for pin in pins {
        if let Some(axis) = pin.axis {
            let ends = [pin.at - axis, pin.at + axis].map(|end| camera.project(&end));
            canvas.line(&ends, false, 2.2 * unit, theme.joint);
        }
        let at = camera.project(&pin.at);
        for (radius, colour) in [(5.0, theme.joint), (2.9, theme.seam)] {
            canvas.fill(&disc(at, radius * unit), colour, 1.0);
        }
    }
}

fn disc([x, y]: Pixel, radius: f32) -> Vec<Pixel> {
    let corner = |k: u8| {
        let (sine, cosine) = (std::f32::consts::TAU * f32::from(k) / f32::from(CORNERS)).sin_cos();
        [x + radius * cosine, y + radius * sine]
    };
    (0..CORNERS).map(corner).collect()
}
