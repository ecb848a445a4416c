//! Settings and errors of animations.

use super::camera::View;
use crate::palette::{DARK, LIGHT, Theme};
use std::io;

/// Settings of an animation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnimationSettings {
    /// Playback speed: seconds of the film per second of the animation.
    pub speed: f64,
    /// Width and height (pixels).
    pub size: u16,
    /// View direction. `None` selects [`View::default`], or a higher elevation if fixed objects
    /// would hide moving bodies.
    pub view: Option<View>,
    /// True for a dark background.
    pub dark: bool,
}

impl Default for AnimationSettings {
    fn default() -> Self {
        Self { speed: 1.0, size: 800, view: None, dark: false }
    }
}

impl AnimationSettings {
    /// Colours of the pictures.
    pub(crate) fn theme(&self) -> &'static Theme {
        if self.dark { &DARK } else { &LIGHT }
    }
}

/// Error of [`animate`](super::animate).
#[derive(Debug, thiserror::Error)]
pub enum AnimationError {
    /// More frames than the limit.
    #[error("the animation would have {frames:.0} frames, more than {most}")]
    TooLong {
        /// Required number of frames.
        frames: f64,
        /// Maximum number of frames.
        most: u64,
    },
    /// Coordinates too large for a picture.
    #[error("the motion goes farther than {FARTHEST:e} m; no picture can show it")]
    TooFar,
    /// Aborted by the progress callback.
    #[error("interrupted")]
    Interrupted,
    /// Failure of the GIF encoder.
    #[error("the animation cannot be encoded: {0}")]
    Gif(#[from] gif::EncodingError),
    /// Failure of the receiver of [`frames`](super::frames).
    #[error("the frames cannot be written: {0}")]
    Output(#[from] io::Error),
}

/// Largest coordinate that is drawn (m).
pub const FARTHEST: f64 = 1e9;
