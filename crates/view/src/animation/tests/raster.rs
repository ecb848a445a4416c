//! Unit tests of `raster.rs`.

use super::*;

#[test]
fn depth_test_shows_the_nearer_of_crossing_faces() {
    let mut raster = Raster::new(20);
    raster.clear();
    let face = |left: f64, right: f64| {
        [[2.0, 2.0, left], [18.0, 2.0, right], [18.0, 18.0, right], [2.0, 18.0, left]]
    };
    let (red, blue) = ([255, 0, 0], [0, 0, 255]);
    raster.polygon(&face(1.0, 2.0), &Hue::from_rgb(red), &[1.0; 4]);
    raster.polygon(&face(2.0, 1.0), &Hue::from_rgb(blue), &[1.0; 4]);
    let mut canvas = Canvas::new(20, [255; 3]).unwrap();
    raster.compose(&mut canvas);
    let pixels: Vec<_> = canvas.colours().collect();
    // The shade nearest to a light of 1 is almost the colour itself.
    for (place, colour) in [(4, blue), (16, red)] {
        let pixel: Rgb = pixels[10 * 20 + place];
        assert!((0..3).all(|k| pixel[k].abs_diff(colour[k]) < 4), "{pixel:?}");
    }
    assert_eq!(pixels[0], [255; 3]);
    assert!(raster.hides([4.0, 10.0, 1.0], 0.1) && !raster.hides([4.0, 10.0, 1.0], 0.6));
    assert!(!raster.hides([2.0, 10.0, 0.5], 0.1), "at the outline");
    raster.clear();
    assert!(!raster.hides([4.0, 10.0, 1.0], 0.1));
}

#[test]
fn lines_have_the_requested_width() {
    let mut raster = Raster::new(20);
    raster.clear();
    raster.line([2.0, 10.0, 1.0], [18.0, 10.0, 1.0], 4.0, [0; 3]);
    let mut canvas = Canvas::new(20, [255; 3]).unwrap();
    raster.compose(&mut canvas);
    let pixels: Vec<_> = canvas.colours().collect();
    let dark = (0..20).filter(|y| pixels[y * 20 + 10] == [0; 3]).count();
    assert_eq!(dark, 4);
}
