//! Conversion of SVG to PNG. Fonts are compiled in, so that every machine makes the same picture.

use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg::{Options, Tree, fontdb};
use std::sync::Arc;

/// Pixels per user unit of the SVG (1/96 inch): 192 dpi, enough for dense screens and print.
pub const PIXELS_PER_UNIT: f32 = 2.0;

/// Rasterises the text `svg` and returns the bytes of a PNG file.
///
/// # Errors
/// An invalid SVG, or a picture of width or height 0. The error is a message for the user.
pub fn rasterise(svg: &str) -> Result<Vec<u8>, String> {
    let mut fonts = fontdb::Database::new();
    for font in [notosans::REGULAR_TTF, notosans::BOLD_TTF] {
        fonts.load_font_source(fontdb::Source::Binary(Arc::new(font)));
    }
    let options = Options {
        fontdb: Arc::new(fonts),
        font_family: "Noto Sans".to_owned(),
        ..Options::default()
    };
    let tree = Tree::from_str(svg, &options).map_err(|error| error.to_string())?;
    let transform = Transform::from_scale(PIXELS_PER_UNIT, PIXELS_PER_UNIT);
    let size = tree.size().to_int_size().scale_by(PIXELS_PER_UNIT).ok_or("it has no size")?;
    let mut pixmap = Pixmap::new(size.width(), size.height()).ok_or("it has no size")?;
    resvg::render(&tree, transform, &mut pixmap.as_mut());
    pixmap.encode_png().map_err(|error| error.to_string())
}
