//! Unit tests of `forces.rs`.

use super::*;
use crate::samples::{falling_cube, floating_cube};

#[test]
fn arrow_length_grows_with_force_up_to_a_limit() {
    let scale = Scale { weight: 100.0, longest: 2.0 };
    let length = |force: f64| scale.arrow(&Vector3::new(0.0, 0.0, force)).norm();
    assert!((length(100.0) - 1.0).abs() < 1e-12);
    // Square-root law for small forces.
    assert!((length(0.04) / length(0.01) - 2.0).abs() < 0.05);
    assert!(length(1e3) < length(1e4) && length(1e12) <= 2.0);
}

#[test]
fn drawn_force_is_the_mean_over_the_steps() {
    let film = falling_cube(500);
    let scale = Scale::from_film(&film);
    assert!((scale.weight - 98.1).abs() < 1e-12);
    let landed = film.frames.iter().position(|frame| !frame.contacts.is_empty()).unwrap();
    assert_eq!(scale.means(&film.frames[..landed]), []);
    let means = scale.means(&film.frames[landed - 3..landed + 1]);
    assert_eq!(means.iter().map(|mean| mean.site.point).collect::<Vec<_>>(), [0, 1, 2, 3]);
    // The force acts in one of four steps, with a quarter of the weight at each corner.
    assert!(means.iter().all(|mean| (mean.force.norm() - 98.1 / 16.0).abs() < 1e-12));
    let floating = floating_cube(3);
    assert_eq!(Scale::from_film(&floating).means(&floating.frames), []);
}
