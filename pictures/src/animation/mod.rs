//! A trajectory as an animated GIF.
//!
//! Thirty frames a second; a camera that stands still, as near as it can with the whole
//! motion in view; the body, its shadow, the contact forces and the clock. The same film
//! and settings give the same bytes.
//!
//! Arrows show the mean force of the steps since the frame before, on a compressed scale
//! (see `forces::Scale`). The body covers those whose corner it hides. A body of eight
//! contact points that are the corners of a box, x fastest, is drawn as a box; of any other
//! body the points and their outline are drawn.

mod camera;
mod canvas;
mod difference;
mod floor;
mod forces;
mod lettering;
mod palette;
mod shape;
mod stage;
mod timing;

#[cfg(test)]
mod tests;

pub use camera::View;
pub(crate) use forces::{NEGLIGIBLE, Scale, means};
pub(crate) use shape::Shape;
pub(crate) use stage::has_ground;
pub use timing::frame_count;

use crate::Film;
use difference::difference;
use gif::{AnyExtension, Encoder, Frame, Repeat};
use nalgebra::{Isometry3, Point3};
use palette::Palette;
use stage::{Moment, Stage};
use std::borrow::Cow;
use std::ops::ControlFlow;

/// How a film becomes an animation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Seconds of the film in a second of the animation.
    pub speed: f64,
    /// Width and height, pixels.
    pub size: u16,
    /// Where the camera stands.
    pub view: View,
}

impl Default for Settings {
    fn default() -> Self {
        Self { speed: 1.0, size: 800, view: View::default() }
    }
}

/// Why there is no animation.
#[derive(Debug, thiserror::Error)]
pub enum AnimationError {
    /// More frames than anyone wants in a file.
    #[error("the animation would have {frames:.0} frames, more than {most}")]
    TooLong {
        /// How many there would be.
        frames: f64,
        /// How many there may be.
        most: u64,
    },
    /// Places so far away that pictures of them have no digits left.
    #[error("the motion goes farther than {FARTHEST:e} m; no picture can show it")]
    TooFar,
    /// The progress callback said so.
    #[error("interrupted")]
    Interrupted,
    /// The encoder failed.
    #[error("the animation cannot be encoded: {0}")]
    Encoding(#[from] gif::EncodingError),
}

/// Coordinates beyond this are not drawn, m.
const FARTHEST: f64 = 1e9;

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
    let to_ground = to_ground(film);
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
        // A mean, so that an impact of one step is seen whichever frame is shown.
        let steps = &film.frames[before.min(now.saturating_sub(1))..now];
        let forces = means(steps, corners.len()).into_iter().map(|mean| to_ground.rotation * mean);
        let arrows = corners.iter().zip(forces);
        let arrows = arrows.filter_map(|(corner, force)| scale.arrow(*corner, &force)).collect();
        moments.push(Moment { time: film.frames[now].time, corners, arrows });
        before = now;
    }
    Ok(moments)
}

/// World → the frame of the ground, which is the world's where there is none.
fn to_ground(film: &Film) -> Isometry3<f64> {
    film.ground.map_or(Isometry3::identity(), |ground| ground.frame())
}
