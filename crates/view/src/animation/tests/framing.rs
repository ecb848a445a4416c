//! Unit tests of `framing.rs`.

use super::*;

/// Squares of half side `half` around places.
fn squares(places: &[[f64; 2]], half: f64) -> Vec<ViewExtent> {
    let square = |place: &[f64; 2]| {
        let corner = |sign: f64| place.map(|x| x + sign * half);
        ViewExtent::NONE.with(corner(-1.0)).with(corner(1.0))
    };
    places.iter().map(square).collect()
}

/// Windows for squares around places, with tracking of each place.
fn windows_of(places: &[[f64; 2]], half: f64, has_ground: bool) -> Vec<Window> {
    let gone = smooth(places);
    let followed: Vec<_> = places.iter().zip(&gone).map(|(at, to)| [*at, *to]).collect();
    windows(&squares(places, half), half, &followed, has_ground)
}

#[test]
fn camera_centres_uniform_motion() {
    for frames in [1, 2, 9, 40] {
        let places: Vec<_> = (0..frames).map(|k| [0.3 * f64::from(k) - 1.0, 0.2]).collect();
        for (at, to) in places.iter().zip(smooth(&places)) {
            assert!((0..2).all(|k| (at[k] - to[k]).abs() < 1e-12), "{frames}: {at:?} {to:?}");
        }
    }
}

#[test]
fn camera_follows_long_motion_smoothly_and_loses_no_point() {
    // Along a line, then abruptly along another, as after an impact.
    let place = |k: usize| [0.002 * k as f64 - 0.2, 0.003 * (k as f64 - 100.0).abs() - 0.1];
    let places: Vec<_> = (0..200).map(place).collect();
    let (moving, windows) = (squares(&places, 0.004), windows_of(&places, 0.004, true));
    assert_eq!(windows.len(), 200);
    assert!(windows.iter().all(|window| window.half == windows[0].half));
    for (window, one) in windows.iter().zip(&moving) {
        assert!(window.needed(one) <= window.half * (1.0 + 1e-12));
    }
    // The square takes at least a tenth of the picture width.
    assert!(0.004 / windows[0].half > 0.1, "{}", windows[0].half);
    for three in windows.windows(3) {
        for k in 0..2 {
            let speed = |a: usize| three[a + 1].middle[k] - three[a].middle[k];
            assert!((speed(1) - speed(0)).abs() < 0.006 / SMOOTH as f64);
        }
    }
}

#[test]
fn motion_in_a_corner_gets_a_small_fixed_window() {
    let places: Vec<_> = (0..60).map(|k| [0.1 + 0.0005 * f64::from(k), -0.1]).collect();
    let (moving, near) = (squares(&places, 0.01), windows_of(&places, 0.01, true));
    assert_eq!(near.len(), 1);
    assert!(near[0].half < HALF_VIEW / 3.0 && near[0].needed(&moving[59]) <= near[0].half);
}

#[test]
fn camera_is_fixed_for_short_motion_or_without_ground() {
    let places: Vec<_> = (0..60).map(|k| [0.007 * f64::from(k) - 0.2, 0.0]).collect();
    assert_eq!(windows_of(&places, 0.06, true), [Window::WHOLE]);
    assert_eq!(windows_of(&places, 0.005, false), [Window::WHOLE]);
}
