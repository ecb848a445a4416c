//! Tests on decoded animations.

use super::arrows::Arrow;
use super::framing::Window;
use super::stage::Backdrop;
use super::{AnimationError, AnimationSettings, View, animate, moments};
use crate::film::{Film, Object};
use crate::palette::{LIGHT, Rgb, Theme};
use crate::samples::{ball, falling_cube, floating_cube};
use crate::shape::Shape;
use nalgebra::{Isometry3, Vector3};
use std::ops::ControlFlow;

const THEME: Theme = LIGHT;

fn bytes(film: &Film, settings: &AnimationSettings) -> Vec<u8> {
    animate(film, settings, |_, _| ControlFlow::Continue(())).unwrap()
}

/// Decoded frames, with colours row by row.
fn pictures(bytes: &[u8], size: usize) -> Vec<Vec<Rgb>> {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes).unwrap();
    let mut screen = vec![[0; 3]; size * size];
    let mut pictures = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        let (width, left) = (usize::from(frame.width), usize::from(frame.left));
        for (i, pixel) in frame.buffer.chunks_exact(4).enumerate() {
            let place = (usize::from(frame.top) + i / width) * size + left + i % width;
            if pixel[3] != 0 {
                screen[place] = [pixel[0], pixel[1], pixel[2]];
            }
        }
        pictures.push(screen.clone());
    }
    pictures
}

fn near(a: Rgb, b: Rgb) -> bool {
    a.iter().zip(b).all(|(a, b)| a.abs_diff(b) <= 4)
}

fn has(picture: &[Rgb], colour: Rgb) -> bool {
    picture.iter().any(|&pixel| near(pixel, colour))
}

#[test]
fn body_is_drawn_at_its_trajectory_position() {
    let settings = AnimationSettings { size: 300, ..AnimationSettings::default() };
    for (film, floating) in [(falling_cube(500), false), (floating_cube(500), true)] {
        let moments = moments(&film, &settings).unwrap();
        let stage = Backdrop::new(&film, &settings, &moments).unwrap();
        let empty: Vec<_> = stage.empty().colours().collect();
        let pictures = pictures(&bytes(&film, &settings), 300);
        assert_eq!(pictures.len(), moments.len());
        for (moment, picture) in moments.iter().zip(&pictures) {
            let middle = moment.poses[0].translation.vector;
            let [x, y] = stage.camera.project(&middle).map(|x| x as usize);
            let pixel = picture[y * 300 + x];
            for other in [THEME.sky, THEME.ground, THEME.grid, empty[y * 300 + x]] {
                assert!(!near(pixel, other), "{pixel:?} at {x}, {y}");
            }
            assert!(has(picture, THEME.ink));
            // The rim of the picture equals that of the empty scene, so nothing is cut off.
            for i in 0..300 {
                for place in [i, 299 * 300 + i, 300 * i, 300 * i + 299] {
                    // Blends of faded grid lines are not all in the palette.
                    let apart = |k: usize| picture[place][k].abs_diff(empty[place][k]);
                    assert!((0..3).all(|k| apart(k) < 16), "{place}");
                }
            }
        }
        // The drop has arrows once the cube has landed.
        assert_eq!(has(&pictures[pictures.len() - 1], THEME.force), !floating);
        assert!(!has(&pictures[0], THEME.force));
        // Without ground only the body is drawn.
        assert_eq!(empty.iter().all(|&pixel| pixel == THEME.sky), floating);
        // More ground pixels than blends of grid lines could produce.
        let ground = pictures[0].iter().filter(|&&pixel| near(pixel, THEME.ground)).count();
        assert_eq!(ground > 9000, !floating, "{ground}");
    }
}

#[test]
fn body_hides_only_the_arrow_behind_it() {
    let film = falling_cube(0);
    let settings = AnimationSettings { size: 300, ..AnimationSettings::default() };
    let mut moments = moments(&film, &settings).unwrap();
    // Upright and large in the picture. The camera sees all corners but one.
    let corner = |i: usize| film.bodies[0].shapes[0].core()[i];
    moments[0].poses = vec![Isometry3::identity()];
    let up = |i: usize| {
        let (from, vector) = (corner(i), Vector3::new(0.0, 0.0, 3.2));
        Arrow { from, to: from + vector, reach: 3f64.sqrt() }
    };
    moments[0].arrows = (0..8).map(up).collect();
    let mut stage = Backdrop::new(&film, &settings, &moments).unwrap();
    let mut paint = |arrows| {
        moments[0].arrows = arrows;
        let mut canvas = stage.empty().clone();
        stage.paint(&mut canvas, &moments[0]);
        canvas.colours().collect::<Vec<_>>()
    };
    let bare = paint(Vec::new());
    let is_body = |pixel: &Rgb| pixel[2].saturating_sub(pixel[0]) > 60;
    let covered: Vec<_> = (0..8)
        .map(|i| {
            let picture = paint(vec![up(i)]);
            assert!(has(&picture, THEME.force), "the tip of arrow {i} stands out");
            let pairs = bare.iter().zip(&picture).filter(|(before, _)| is_body(before));
            // An arrow behind the body changes the blends at its outline only. One in front of it
            // changes more than a hundred pixels.
            pairs.filter(|(before, now)| before != now).count() < 20
        })
        .collect();
    // Seen from x > 0, y < 0, z > 0, the corner at x = 0, y = 1, z = 0 is behind the body.
    let sides: Vec<_> = (0..4).map(|i| covered[i]).collect();
    assert_eq!(sides, [false, false, true, false]);
}

#[test]
fn one_row_is_one_frame() {
    let film = falling_cube(0);
    let pictures = pictures(
        &bytes(&film, &AnimationSettings { size: 120, ..AnimationSettings::default() }),
        120,
    );
    assert_eq!(pictures.len(), 1);
}

#[test]
fn other_views_and_other_bodies_are_drawn_too() {
    let mut film = falling_cube(300);
    let views = [(200.0, 0.0), (0.0, 90.0), (-720.0, 45.0)];
    for (azimuth, elevation) in views {
        let view = Some(View { azimuth, elevation });
        let bytes = bytes(&film, &AnimationSettings { size: 120, view, speed: 10.0, dark: false });
        assert_eq!(pictures(&bytes, 120).len(), 3);
    }
    film.bodies[0].shapes = vec![Shape::Points(vec![Vector3::x(), Vector3::y(), Vector3::z()])];
    let pictures = pictures(
        &bytes(&film, &AnimationSettings { size: 400, ..AnimationSettings::default() }),
        400,
    );
    let dot = super::palette::Hue::from_rgb(crate::palette::BODIES[0]).lit(0.3);
    assert!(has(&pictures[0], dot));
}

#[test]
fn animations_too_far_too_long_or_interrupted_are_errors() {
    let settings = AnimationSettings { size: 120, ..AnimationSettings::default() };
    let mut far = falling_cube(0);
    far.frames[0].states[0].position.x = 1e200;
    let go_on = |_, _| ControlFlow::Continue(());
    assert!(matches!(animate(&far, &settings, go_on), Err(AnimationError::TooFar)));
    let film = falling_cube(10);
    let slow = AnimationSettings { speed: 1e-4, ..settings };
    assert!(matches!(animate(&film, &slow, go_on), Err(AnimationError::TooLong { .. })));
    let stop = |_, _| ControlFlow::Break(());
    assert!(matches!(animate(&film, &settings, stop), Err(AnimationError::Interrupted)));
}

/// Ball of 5 cm that moves down a slope of pegs and sideways for two seconds and 1.6 m.
fn board() -> Film {
    let mut film = falling_cube(1000);
    film.bodies[0].shapes = vec![ball(Vector3::zeros(), 0.025)];
    for frame in &mut film.frames {
        let (s, state) = (frame.row.time / 2.0, &mut frame.states[0]);
        state.position = Vector3::new(0.1 * (20.0 * s).sin(), 1.6 * s - 0.8, 0.025);
        frame.contacts = std::sync::Arc::default();
    }
    let peg = |k: i32| {
        let place =
            Vector3::new(f64::from(k % 10) * 0.12 - 0.54, f64::from(k / 10) * 0.16 - 0.8, 0.0);
        Object { shapes: vec![ball(place, 0.01)], ..Object::default() }
    };
    film.fixed = (0..110).map(peg).collect();
    film
}

/// Relative size of the body in each frame, for the whole view and for the window of the frame.
/// Asserts that the body is in the picture.
fn shares(film: &Film) -> Vec<[f64; 2]> {
    let settings = AnimationSettings { size: 200, ..AnimationSettings::default() };
    let moments = moments(film, &settings).unwrap();
    let mut stage = Backdrop::new(film, &settings, &moments).unwrap();
    let mut share = |k: usize, whole: bool| {
        stage.aim(k);
        if whole {
            stage.camera.window = Window::WHOLE;
        }
        let middle = moments[k].poses[0].translation.vector;
        let spot = stage.camera.spot(&middle);
        let radius = stage.camera.pixels(film.bodies[0].reach(), spot);
        if !whole {
            for coordinate in &spot[..2] {
                assert!((radius..200.0 - radius).contains(coordinate), "{k}: {spot:?}");
            }
        }
        2.0 * radius / 200.0
    };
    (0..moments.len()).map(|k| [share(k, true), share(k, false)]).collect()
}

#[test]
fn moving_body_among_resting_ones_fills_a_tenth_of_the_picture() {
    for [whole, shown] in shares(&board()) {
        assert!(whole < 0.04, "{whole}");
        assert!((0.1..0.25).contains(&shown), "{shown}");
    }
}

/// A wall between the camera and a falling body hides the body at 20 degrees elevation, but not
/// higher up. A requested view is not changed.
#[test]
fn default_view_rises_until_resting_bodies_hide_no_moving_one() {
    let mut film = falling_cube(300);
    let View { azimuth, .. } = View::default();
    let (sin, cos) = azimuth.to_radians().sin_cos();
    // Across the line of sight, and tall enough to hide everything behind it below 40 degrees.
    let wall = |k: usize| {
        let across = 0.5 * k as f64 - 10.0;
        let foot = Vector3::new(5.0 * cos - across * sin, 5.0 * sin + across * cos, 0.0);
        let balls =
            (0..12).map(|level| ball(foot + Vector3::z() * (0.45 * f64::from(level)), 0.45));
        Object { shapes: balls.collect(), ..Object::default() }
    };
    film.fixed = (0..40).map(wall).collect();
    let hidden = |view| {
        let settings = AnimationSettings { size: 200, view, ..AnimationSettings::default() };
        let moments = moments(&film, &settings).unwrap();
        Backdrop::new(&film, &settings, &moments).unwrap().hidden(&moments)
    };
    assert!(hidden(Some(View::default())) > 0.5);
    assert!(hidden(None) <= 0.05);
}

#[test]
fn camera_follows_a_long_throw_and_shows_the_grid() {
    let mut film = falling_cube(1500);
    for frame in &mut film.frames {
        let time = frame.row.time;
        frame.states[0].position = Vector3::new(
            10.0 * time,
            40.0 * time,
            1.7 + (15.0 * time - 0.5 * 9.81 * time * time).max(0.0),
        );
        frame.contacts = std::sync::Arc::default();
    }
    for [whole, shown] in shares(&film) {
        assert!(whole < 0.04 && (0.1..0.25).contains(&shown), "{whole} {shown}");
    }
    let pictures = pictures(
        &bytes(&film, &AnimationSettings { size: 200, ..AnimationSettings::default() }),
        200,
    );
    for picture in pictures {
        // Lines thinner than a pixel appear as blends.
        let is_line = |pixel: &&Rgb| {
            let between = |k: usize| (THEME.grid[k]..THEME.ground[k] - 4).contains(&pixel[k]);
            (0..3).all(between)
        };
        let lines = picture.iter().filter(is_line).count();
        let ground = picture.iter().filter(|&&pixel| near(pixel, THEME.ground)).count();
        assert!(lines > 200 && ground > 20_000, "{lines} {ground}");
    }
}

#[test]
fn a_body_has_its_own_colour_and_its_label_above_it() {
    let settings = AnimationSettings { size: 300, ..AnimationSettings::default() };
    let mut film = falling_cube(0);
    let red = |picture: &[Rgb]| {
        let is_red = |pixel: &&Rgb| pixel[0] > 90 && pixel[0] / 2 > pixel[2];
        picture.iter().filter(is_red).count()
    };
    let plain = pictures(&bytes(&film, &settings), 300).remove(0);
    film.bodies[0].colour = Some([0xd0, 0x10, 0x10]);
    let own = pictures(&bytes(&film, &settings), 300).remove(0);
    assert!(red(&plain) == 0 && red(&own) > 1000, "{} {}", red(&plain), red(&own));
    film.bodies[0].label = "Würfel 1".to_owned();
    let labelled = pictures(&bytes(&film, &settings), 300).remove(0);
    let first = |other: &[Rgb]| (0..90_000).find(|&i| labelled[i] != other[i]).map(|i| i / 300);
    let top =
        (0..90_000).filter(|&i| own[i][0] > own[i][2].saturating_add(60)).min().unwrap() / 300;
    let written = first(&own).unwrap();
    assert!(written < top && written + 20 > top, "{written} {top}");
}
