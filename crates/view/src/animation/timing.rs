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
mod tests {
    use super::*;

    #[test]
    fn the_delays_add_up_to_real_time() {
        let mut sum = 0;
        for frame in 0..3000 {
            sum += u64::from(delay(frame));
            assert!(sum.abs_diff((frame + 1) * 100 / 30) <= 1, "{frame}");
            assert!((3..=4).contains(&delay(frame)));
        }
        assert_eq!(sum, 10_000);
    }

    #[test]
    fn a_film_has_a_first_and_a_last_frame() {
        assert_eq!(frame_count(0.0, 1.0).unwrap(), 1);
        assert_eq!(frame_count(1.0, 1.0).unwrap(), 31);
        assert_eq!(frame_count(1.0, 0.5).unwrap(), 61);
        assert_eq!(frame_count(1.01, 1.0).unwrap(), 32);
        assert_eq!(frame_count(99.95, 1.0).unwrap(), 3000);
        assert!(frame_count(100.1, 1.0).is_err());
        assert!(frame_count(1e300, 1e-3).is_err());
    }
}
