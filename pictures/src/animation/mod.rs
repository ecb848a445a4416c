//! A trajectory as an animated GIF.
//!
//! Thirty frames a second; a camera that stands still, as near as it can with the whole
//! motion in view; the body, its shadow, the contact forces and the clock. The same film
//! and settings give the same bytes.
//!
//! Arrows show the mean force of the steps since the frame before, on a compressed scale
//! (`forces::Scale`). The body covers those whose corner it hides. A body of eight
//! contact points that are the corners of a box, x fastest, is drawn as a box; of any other
//! body the points and their outline are drawn.

mod arrows;
mod camera;
mod canvas;
mod difference;
mod floor;
mod lettering;
mod outline;
mod palette;
mod settings;
mod stage;
mod timing;

#[cfg(test)]
mod tests;

pub use camera::View;
pub use settings::{AnimationError, Settings};
pub use timing::frame_count;

use crate::film::Film;
use crate::forces::Scale;
use arrows::Arrow;
use difference::difference;
use gif::{AnyExtension, Encoder, Frame, Repeat};
use nalgebra::{Point3, Vector3};
use palette::Palette;
use settings::FARTHEST;
use stage::{Moment, Stage};
use std::borrow::Cow;
use std::ops::ControlFlow;

/// The GIF's comment extension.
const COMMENT: AnyExtension = AnyExtension(0xfe);

/// Draws `film`. `progress` gets the frames done and the frames there will be, and can end
/// the work.
///
/// # Errors
/// See [`AnimationError`].
pub fn animate(
    film: &Film,
    settings: &Settings,
    mut progress: impl FnMut(u64, u64) -> ControlFlow<()>,
) -> Result<Vec<u8>, AnimationError> {
    let moments = moments(film, settings)?;
    let frames = moments.len() as u64;
    let size = usize::from(settings.size);
    let palette = Palette::new();
    let mut bytes = Vec::new();
    let mut encoder = Encoder::new(&mut bytes, settings.size, settings.size, &palette.bytes())?;
    encoder.set_repeat(Repeat::Infinite)?;
    let title: Vec<&[u8]> = film.title.as_bytes().chunks(255).collect();
    encoder.write_raw_extension(COMMENT, &title)?;

    let stage = Stage::new(film, settings, &moments).ok_or(AnimationError::TooFar)?;
    let mut canvas = stage.empty().clone();
    let (mut before, mut now) = (Vec::new(), Vec::with_capacity(size * size));
    for (k, moment) in (0..).zip(&moments) {
        if progress(k, frames).is_break() {
            return Err(AnimationError::Interrupted);
        }
        stage.paint(&mut canvas, moment);
        now.clear();
        now.extend(canvas.colours().map(|colour| palette.index(colour)));
        let mut frame = if before.is_empty() {
            let (width, height) = (settings.size, settings.size);
            Frame { width, height, buffer: Cow::Borrowed(&now), ..Frame::default() }
        } else {
            difference(&before, &now, size)
        };
        frame.delay = timing::delay(k);
        encoder.write_frame(&frame)?;
        drop(frame);
        std::mem::swap(&mut before, &mut now);
    }
    // The trailer is written when the encoder goes.
    drop(encoder);
    Ok(bytes)
}

/// What the frames show.
fn moments(film: &Film, settings: &Settings) -> Result<Vec<Moment>, AnimationError> {
    let duration = (film.frames.len() - 1) as f64 * film.time_step;
    let scale = Scale::of(film);
    let to_ground = film.to_ground();
    let mut before = 0;
    let mut moments = Vec::new();
    for frame in 0..frame_count(duration, settings.speed)? {
        let now = timing::shown(film, frame, settings.speed);
        let points = film.points(&film.frames[now]);
        let corners: Vec<_> = points.map(|p| (to_ground * Point3::from(p)).coords).collect();
        // In this order NaN is too far as well.
        if !corners.iter().flatten().all(|coordinate| coordinate.abs() <= FARTHEST) {
            return Err(AnimationError::TooFar);
        }
        let steps = &film.frames[before.min(now.saturating_sub(1))..now];
        let arrow = |(point, force): (usize, Vector3<f64>)| {
            let from = corners[point];
            Arrow { from, to: from + to_ground.rotation * scale.arrow(&force) }
        };
        let arrows = scale.means(film, steps).into_iter().map(arrow).collect();
        moments.push(Moment { time: film.frames[now].time, corners, arrows });
        before = now;
    }
    Ok(moments)
}
