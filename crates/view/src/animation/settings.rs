//! What is asked of an animation, and why there may be none.

use super::camera::View;

/// How a film becomes an animation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnimationSettings {
    /// Seconds of the film in a second of the animation.
    pub speed: f64,
    /// Width and height, pixels.
    pub size: u16,
    /// Where the camera stands. `None`: where [`View::default`] says, or higher above the horizon where what stands
    /// still hides from there what moves.
    pub view: Option<View>,
}

impl Default for AnimationSettings {
    fn default() -> Self {
        Self { speed: 1.0, size: 800, view: None }
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
    /// The GIF encoder failed.
    #[error("the animation cannot be encoded: {0}")]
    Gif(#[from] gif::EncodingError),
}

/// Coordinates beyond this are not drawn, m.
pub const FARTHEST: f64 = 1e9;
