//! Unit tests of `font.rs`.

use super::*;

#[test]
fn long_headings_keep_their_ends_and_fit() {
    let font = Font::bold().unwrap();
    let short = font.heading("drop scene, seed 42", 17.0, 1080.0);
    assert_eq!((short.text.as_str(), short.missing), ("drop scene, seed 42", 0));
    let long = format!("Motion: {} scene, seed 42, native", "wide ".repeat(200_000));
    let cut = font.heading(&long, 17.0, 1080.0).text;
    assert!(cut.starts_with("Motion: wide") && cut.ends_with("scene, seed 42, native"));
    assert!(cut.contains('…'));
    let width = font.width(&cut, 17.0);
    assert!((1050.0..=1080.0).contains(&width), "{width}");
}

#[test]
fn letters_are_drawn_within_their_measured_width() {
    let font = Font::bold().unwrap();
    let path = font.path("t = 0123456789.s ×", 20.0, [100.0, 50.0]).unwrap().bounds();
    let width = font.width("t = 0123456789.s ×", 20.0) as f32;
    assert!(path.left() >= 100.0 && path.right() <= 100.0 + width, "{path:?}");
    assert!(path.right() > 95.0 + width && path.top() > 30.0 && path.bottom() < 52.0);
    assert!(font.path(" ", 20.0, [0.0; 2]).is_none());
    // Digits of equal width keep the clock from jittering.
    assert!("0123456789".chars().all(|c| font.advance(c, 20.0) == font.advance('0', 20.0)));
}

#[test]
fn characters_without_a_glyph_are_counted() {
    let font = Font::bold().unwrap();
    let heading = font.heading("Würfel 立方体 Ωμ", 17.0, 1080.0);
    assert_eq!((heading.text.as_str(), heading.missing), ("Würfel ??? Ωμ", 3));
}
