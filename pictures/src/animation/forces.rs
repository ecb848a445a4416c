//! Contact forces as arrows.

use super::camera::Camera;
use super::canvas::Canvas;
use super::palette::{FORCE, SEAM};
use crate::{Film, Frame};
use nalgebra::Vector3;

/// An arrow in the ground's frame.
pub struct Arrow {
    pub from: Vector3<f64>,
    pub to: Vector3<f64>,
}

/// Forces below this times [`Scale::weight`] have no arrow.
pub const NEGLIGIBLE: f64 = 1e-6;

/// How long an arrow is for a force.
///
/// Impacts are hundreds of times the weight, so lengths are compressed: with
/// s = √(force / weight) the length is s / (1 + s) of the longest, which grows like the
/// square root for forces below the weight and levels off above it.
pub struct Scale {
    /// Mass times gravity; without gravity the largest force of the film. N.
    weight: f64,
    /// No arrow gets this long, m.
    longest: f64,
}

impl Scale {
    pub fn of(film: &Film) -> Self {
        let body = film.body();
        let mut weight = body.mass * film.gravity.norm();
        if weight == 0.0 {
            let forces = film.frames.iter().flat_map(|frame| frame.touches());
            weight = forces.map(|contact| contact.force.norm()).fold(f64::MIN_POSITIVE, f64::max);
        }
        let reach = body.points.iter().map(|point| point.norm()).fold(0.0, f64::max);
        Self { weight, longest: 1.5 * reach }
    }

    /// The force whose arrow has half of the longest length, N.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// No arrow gets this long, m.
    pub fn longest(&self) -> f64 {
        self.longest
    }

    /// The arrow for `force` at `from`; none for no force.
    pub fn arrow(&self, from: Vector3<f64>, force: &Vector3<f64>) -> Option<Arrow> {
        let direction = force.try_normalize(NEGLIGIBLE * self.weight)?;
        let root = (force.norm() / self.weight).sqrt();
        Some(Arrow { from, to: from + direction * (self.longest * root / (1.0 + root)) })
    }
}

/// The mean force of `steps` on each of `points` points of the body.
pub fn means(steps: &[Frame], points: usize) -> Vec<Vector3<f64>> {
    let mut means = vec![Vector3::zeros(); points];
    for contact in steps.iter().flat_map(Frame::touches) {
        if let Some(mean) = means.get_mut(contact.point) {
            *mean += contact.force / steps.len() as f64;
        }
    }
    means
}

/// Paints arrows over what is there, with a seam that sets them off.
pub fn paint(canvas: &mut Canvas, camera: &Camera, arrows: &[&Arrow]) {
    let unit = canvas.size() / 800.0;
    for (colour, extra) in [(SEAM, 2.4 * unit), (FORCE, 0.0)] {
        for arrow in arrows {
            let (from, to) = (camera.project(&arrow.from), camera.project(&arrow.to));
            let (x, y) = (to[0] - from[0], to[1] - from[1]);
            let length = x.hypot(y);
            if !(length.is_finite() && length > 2.0 * unit) {
                continue;
            }
            let (x, y) = (x / length, y / length);
            let head = (15.0 * unit).min(0.6 * length);
            let neck = [to[0] - head * x, to[1] - head * y];
            let half = 0.4 * head;
            let sides = [-half, half].map(|w| [neck[0] - w * y, neck[1] + w * x]);
            let tip = [to, sides[0], sides[1]];
            canvas.line(&[from, neck], false, 3.6 * unit + extra, colour);
            canvas.line(&tip, true, unit + extra, colour);
            canvas.fill(&tip, colour, 1.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn larger_forces_have_longer_arrows_of_limited_length() {
        let scale = Scale { weight: 100.0, longest: 2.0 };
        let length = |force: f64| {
            let arrow = scale.arrow(Vector3::x(), &Vector3::new(0.0, 0.0, force)).unwrap();
            (arrow.to - arrow.from).norm()
        };
        assert!((length(100.0) - 1.0).abs() < 1e-12);
        // Nearly the square root for small forces.
        assert!((length(0.04) / length(0.01) - 2.0).abs() < 0.05);
        assert!(length(1e3) < length(1e4) && length(1e12) <= 2.0);
        assert!(scale.arrow(Vector3::x(), &Vector3::zeros()).is_none());
    }
}
