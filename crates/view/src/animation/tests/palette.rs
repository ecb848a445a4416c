//! Unit tests of `palette.rs`.

use super::*;
use crate::film::Object;
use crate::palette::{DARK, LIGHT};
use crate::samples::{copies, falling_cube};

#[test]
fn flat_colours_are_in_the_palette_as_they_are() {
    for (theme, bodies, own) in [(LIGHT, 1, 0), (LIGHT, 100, 0), (DARK, 20, 9)] {
        let mut film = falling_cube(0);
        copies(&mut film, bodies);
        for (b, body) in film.bodies.iter_mut().enumerate().take(own) {
            body.colour = Some([28 * b as u8, 255 - 28 * b as u8, 128]);
        }
        if bodies > 1 {
            film.fixed = vec![Object::default()];
        }
        let mut palette = Palette::new(&film, &theme);
        assert!(palette.colours.len() <= usize::from(palette.transparent()));
        assert_eq!(palette.transparent(), if bodies == 1 { 127 } else { 255 });
        let Theme { sky, ground, grid, ink, seam, joint, force, .. } = theme;
        let flat = [sky, ground, grid, ink, seam, joint, force];
        for colour in flat.into_iter().chain(palette::body_colours(&film)) {
            let index = palette.index(colour);
            let found = palette.colours[usize::from(index)];
            let far = (0..3).map(|k| found[k].abs_diff(colour[k])).max().unwrap();
            // Colours of bodies are between two shades.
            let most = if flat.contains(&colour) { 4 } else { 16 };
            assert!(far <= most, "{colour:?} became {found:?}");
        }
    }
}

#[test]
fn shades_are_computed_in_linear_light() {
    let grey = Hue::from_rgb([188; 3]);
    // Half of the light of white.
    assert!(grey.lit(1.0)[0].abs_diff(188) <= 2, "{:?}", grey.lit(1.0));
    assert!(grey.lit(0.5)[0].abs_diff(137) <= 2, "{:?}", grey.lit(0.5));
    assert_eq!(grey.lit(-1.0), grey.lit(DARKEST));
    assert_eq!(grey.lit(9.0), grey.lit(BRIGHTEST));
}

#[test]
fn palette_is_capped_at_256_colours() {
    let mut film = falling_cube(0);
    copies(&mut film, 300);
    for (b, body) in (0u8..=255).zip(&mut film.bodies) {
        body.colour = Some([b, b.wrapping_mul(7), 255 - b]);
    }
    assert_eq!(Palette::new(&film, &LIGHT).bytes().len(), 3 * 256);
}
