//! Unit tests of `timing.rs`.

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
