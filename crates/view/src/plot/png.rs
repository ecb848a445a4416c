//! Conversion of a plot's SVG to PNG. Texts become outlines of the built-in font, so that every
//! machine makes the same picture.

use crate::font::Font;
use crate::png::marked;
use resvg::tiny_skia::{PathSegment, Pixmap, Transform};
use resvg::usvg::{Options, Tree};
use roxmltree::{Document, Node};
use std::fmt::Write as _;

/// Pixels per user unit of the SVG (1/96 inch): 192 dpi, enough for dense screens and print.
pub const PIXELS_PER_UNIT: f32 = 2.0;

/// Rasterises the text `svg` and returns the bytes of a PNG file.
///
/// # Errors
/// An invalid SVG, or a picture of width or height 0. The error is a message for the user.
pub fn rasterise(svg: &str) -> Result<Vec<u8>, String> {
    let outlined = outlined(svg)?;
    let tree = Tree::from_str(&outlined, &Options::default()).map_err(|error| error.to_string())?;
    let transform = Transform::from_scale(PIXELS_PER_UNIT, PIXELS_PER_UNIT);
    let size = tree.size().to_int_size().scale_by(PIXELS_PER_UNIT).ok_or("it has no size")?;
    let mut pixmap = Pixmap::new(size.width(), size.height()).ok_or("it has no size")?;
    resvg::render(&tree, transform, &mut pixmap.as_mut());
    marked(&pixmap)
}

/// Copy of `svg` whose `text` elements are paths.
fn outlined(svg: &str) -> Result<String, String> {
    let document = Document::parse(svg).map_err(|error| error.to_string())?;
    let [regular, bold] = [Font::regular(), Font::bold()];
    let fonts = [regular.ok_or("no font")?, bold.ok_or("no font")?];
    let mut out = String::with_capacity(svg.len());
    let mut copied = 0;
    for text in document.descendants().filter(|node| node.has_tag_name("text")) {
        out += &svg[copied..text.range().start];
        outline(text, &fonts, &mut out);
        copied = text.range().end;
    }
    Ok(out + &svg[copied..])
}

/// Position of the next letter of a text.
struct Cursor {
    x: f64,
    y: f64,
}

/// Adds the paths of a text with its `tspan` elements. Of their attributes, `font-size`,
/// `font-weight`, `fill`, `dx` and `dy` have an effect.
fn outline(text: Node<'_, '_>, fonts: &[Font; 2], out: &mut String) {
    let number = |name| text.attribute(name).and_then(|value| value.parse().ok()).unwrap_or(0.0);
    let mut cursor = Cursor { x: number("x"), y: number("y") };
    let runs = || text.descendants().filter(Node::is_text);
    let widths = runs().map(|run| {
        let (font, size) = look(run, fonts);
        shift(run, "dx") + font.width(&letters(run, font, size), size)
    });
    cursor.x -= match text.attribute("text-anchor") {
        Some("end") => widths.sum(),
        Some("middle") => 0.5 * widths.sum::<f64>(),
        _ => 0.0,
    };
    for run in runs() {
        let (font, size) = look(run, fonts);
        cursor.x += shift(run, "dx");
        cursor.y += shift(run, "dy");
        let letters = letters(run, font, size);
        if let Some(path) = font.path(&letters, size as f32, [cursor.x as f32, cursor.y as f32]) {
            let fill = inherited(run, "fill").unwrap_or("#000000");
            let _ = write!(out, "<path fill=\"{fill}\" d=\"");
            for segment in path.segments() {
                let _ = match segment {
                    PathSegment::MoveTo(p) => write!(out, "M{} {}", p.x, p.y),
                    PathSegment::LineTo(p) => write!(out, "L{} {}", p.x, p.y),
                    PathSegment::QuadTo(a, p) => write!(out, "Q{} {} {} {}", a.x, a.y, p.x, p.y),
                    PathSegment::CubicTo(a, b, p) => {
                        write!(out, "C{} {} {} {} {} {}", a.x, a.y, b.x, b.y, p.x, p.y)
                    }
                    PathSegment::Close => write!(out, "Z"),
                };
            }
            out.push_str("\"/>");
        }
        cursor.x += font.width(&letters, size);
    }
}

/// Letters of a text. Those that the font lacks become `?`.
fn letters(run: Node<'_, '_>, font: &Font, size: f64) -> String {
    let text = run.text().unwrap_or_default().replace('\u{200b}', "");
    font.heading(&text, size, f64::INFINITY).text
}

/// Attribute `name` of the element that begins with these letters, a shift.
fn shift(run: Node<'_, '_>, name: &str) -> f64 {
    let element = run.parent().filter(|_| run.prev_sibling().is_none());
    let value = element.and_then(|element| element.attribute(name));
    value.and_then(|value| value.parse().ok()).unwrap_or(0.0)
}

/// Font and size of the letters of a text.
fn look<'f>(letters: Node<'_, '_>, fonts: &'f [Font; 2]) -> (&'f Font, f64) {
    let size = inherited(letters, "font-size").and_then(|size| size.parse().ok());
    let is_bold = inherited(letters, "font-weight") == Some("700");
    (&fonts[usize::from(is_bold)], size.unwrap_or(16.0))
}

/// Attribute of the nearest element around `node` that has it.
fn inherited<'a>(node: Node<'a, '_>, name: &str) -> Option<&'a str> {
    node.ancestors().find_map(|element| element.attribute(name))
}

#[cfg(test)]
#[path = "tests/png.rs"]
mod tests;
