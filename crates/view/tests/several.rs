//! Pictures of films with several bodies, through the public interface.

mod pile;

use std::ops::ControlFlow;
use tumble_view::animation::{AnimationSettings, animate};
use tumble_view::plot::{self, PlotSheet};
use tumble_view::view::page;

fn gif_of(film: &tumble_view::Film, settings: &AnimationSettings) -> Vec<u8> {
    animate(film, settings, |_, _| ControlFlow::Continue(())).unwrap()
}

/// Pixels of the last frame, row by row.
fn last_picture(bytes: &[u8], size: usize) -> Vec<[u8; 3]> {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes).unwrap();
    let mut screen = vec![[0; 3]; size * size];
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        let (width, left) = (usize::from(frame.width), usize::from(frame.left));
        for (i, pixel) in frame.buffer.chunks_exact(4).enumerate() {
            if pixel[3] != 0 {
                let place = (usize::from(frame.top) + i / width) * size + left + i % width;
                screen[place] = [pixel[0], pixel[1], pixel[2]];
            }
        }
    }
    screen
}

#[test]
fn a_hundred_bodies_are_animated() {
    let film = pile::film(100);
    let settings = AnimationSettings { size: 800, ..AnimationSettings::default() };
    let bytes = gif_of(&film, &settings);
    // Every colour occurs in some shade.
    let picture = last_picture(&bytes, 800);
    for colour in [[74, 111, 165], [220, 194, 140], [168, 88, 63], [91, 63, 99], [95, 160, 151]] {
        let near =
            |pixel: &[u8; 3]| pixel.iter().zip(colour).all(|(a, b): (_, u8)| a.abs_diff(b) < 30);
        assert!(picture.iter().filter(|pixel| near(pixel)).count() > 200, "{colour:?}");
    }
    assert!(bytes == gif_of(&film, &settings), "the same film gives the same bytes");
}

#[test]
fn plots_show_the_requested_body() {
    let film = pile::film(50);
    let svg = plot::svg(&film, PlotSheet::Motion, 60);
    assert!(svg.contains("Motion and contact of ball 60: a hundred bodies"));
    assert!(svg.contains("100 bodies, μ = 0.5"));
    assert_ne!(svg, plot::svg(&film, PlotSheet::Motion, 0));
    // An index beyond the end selects the last body.
    assert_eq!(plot::svg(&film, PlotSheet::Motion, 99), plot::svg(&film, PlotSheet::Motion, 4711));
    let energy = plot::svg(&film, PlotSheet::Energy, 60);
    assert_eq!(energy, plot::svg(&film, PlotSheet::Energy, 0), "the energy is that of all");
}

#[test]
fn the_page_has_the_plots_of_each_body() {
    let mut film = pile::film(600);
    film.bodies[3].colour = Some([1, 0x20, 0xff]);
    let page = page("0", &[&film]).unwrap();
    assert!(page.len() < 2_000_000, "{}", page.len());
    for b in 0..100 {
        assert!(page.contains(&film.bodies[b].name), "{b}");
    }
    assert!(page.contains("\"#0120ff\""), "a body's own colour");
}

#[test]
fn the_page_of_a_hundred_bodies_and_five_thousand_rows_is_small() {
    let mut film = pile::film(4999);
    // Noise on positions and forces.
    let mut seed = 1u64;
    let mut noise = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    for frame in &mut film.frames {
        for state in &mut frame.states {
            state.position.iter_mut().for_each(|x| *x += 1e-5 * noise());
        }
        for contact in std::sync::Arc::make_mut(&mut frame.contacts) {
            contact.force *= 1.0 + 0.01 * noise();
        }
    }
    let page = page("0", &[&film]).unwrap();
    assert!(page.len() < 6_000_000, "{}", page.len());
}
