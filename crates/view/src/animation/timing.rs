//! Mapping of animation frames to film frames, and their durations.

use super::settings::AnimationError;
use crate::film::Film;

/// Frames per second of the animation.
pub const FRAMES_A_SECOND: u64 = 30;

/// Maximum number of frames, for practical file sizes.
const MOST_FRAMES: u64 = 3000;

/// Number of frames for `duration` seconds at playback speed `speed`: one at the start, one every
/// thirtieth of a second, and one at the end.
///
/// # Errors
/// [`AnimationError::TooLong`].
pub fn frame_count(duration: f64, speed: f64) -> Result<u64, AnimationError> {
    let steps = (duration * FRAMES_A_SECOND as f64 / speed - 1e-6).ceil();
    if steps >= MOST_FRAMES as f64 {
        return Err(AnimationError::TooLong { frames: steps + 1.0, most: MOST_FRAMES });
    }
    Ok(steps.max(0.0) as u64 + 1)
}

/// Film frame nearest in time to frame `frame` of the animation.
pub fn shown(film: &Film, frame: u64, speed: f64) -> usize {
    let time = frame as f64 * speed / FRAMES_A_SECOND as f64;
    let shown = (time / film.frame_time()).round() as usize;
    shown.min(film.frames.len() - 1)
}

/// Duration of frame `frame` in hundredths of a second, the unit of GIF: 3, 4, 3, 3, 4, 3 … Each
/// frame time is accurate to half a hundredth.
pub fn delay(frame: u64) -> u16 {
    let at = |frame: u64| (frame * 100 + FRAMES_A_SECOND / 2) / FRAMES_A_SECOND;
    (at(frame + 1) - at(frame)) as u16
}

#[cfg(test)]
#[path = "tests/timing.rs"]
mod tests;
