//! One or two films as a page that plays them in any browser.
//!
//! The page is one HTML file that loads nothing: its style, its scripts and the data are in
//! it. `page/` holds its sources, `vendor/` the libraries that draw its motion and its plots.
//! The same films give the same bytes.

mod curves;
mod data;
mod distance;
mod encode;
mod facts;
mod poses;

use crate::film::Film;
use crate::markup::escape;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write as _;

const TEMPLATE: &str = include_str!("page/index.html");
const STYLES: [&str; 2] = [include_str!("vendor/uPlot.min.css"), include_str!("page/style.css")];
const PLOTTER_LICENCE: &str = include_str!("vendor/LICENSE-uPlot");
const PLOTTER: &str = include_str!("vendor/uPlot.iife.min.js");
const DRAWER_LICENCE: &str = include_str!("vendor/LICENSE-three");
const DRAWER: &str = include_str!("vendor/three.iife.min.js");
/// In the order of what needs what.
const SCRIPTS: [&str; 19] = [
    include_str!("page/vectors.js"),
    include_str!("page/numbers.js"),
    include_str!("page/runs.js"),
    include_str!("page/colours.js"),
    include_str!("page/camera.js"),
    include_str!("page/ground.js"),
    include_str!("page/trails.js"),
    include_str!("page/shapes.js"),
    include_str!("page/solids.js"),
    include_str!("page/overlays.js"),
    include_str!("page/occlusion.js"),
    include_str!("page/pace.js"),
    include_str!("page/stage.js"),
    include_str!("page/scenery.js"),
    include_str!("page/plots.js"),
    include_str!("page/sidebar.js"),
    include_str!("page/sharing.js"),
    include_str!("page/keys.js"),
    include_str!("page/main.js"),
];
/// Of the picture that stands where there is no WebGL or no JavaScript, pixels.
const STILL: u16 = 560;

/// The page of one or two `films`, made by `version` of tumble.
///
/// # Errors
/// Why the data cannot be written, in words.
pub fn page(version: &str, films: &[&Film]) -> Result<String, String> {
    let data = serde_json::to_string(&data::PageData::of(version, films))
        .map_err(|error| error.to_string())?;
    let scripts = format!("(() => {{\n\"use strict\";\n{}}})();\n", SCRIPTS.join("\n"));
    let mut page =
        String::with_capacity(data.len() + scripts.len() + DRAWER.len() + 2 * PLOTTER.len());
    let mut rest = TEMPLATE;
    // Only the template is searched: what is put in may hold anything.
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        page.push_str(before);
        match name {
            "title" => page.push_str(&escape(&title(films))),
            "style" => page.extend(STYLES),
            "plotter-licence" => page.push_str(PLOTTER_LICENCE),
            "plotter" => page.push_str(PLOTTER),
            "drawer-licence" => page.push_str(DRAWER_LICENCE),
            "drawer" => page.push_str(DRAWER),
            "stills" => page.extend(films.iter().enumerate().map(|(run, film)| still(run, film))),
            "script" => page.push_str(&scripts),
            "data" => page.push_str(&escape_json(&data)),
            other => return Err(format!("the page has no part {other:?}")),
        }
        rest = after;
    }
    page.push_str(rest);
    Ok(page)
}

/// The first moment of a run, as an image that is not seen unless the page says so.
fn still(run: usize, film: &Film) -> String {
    let picture = crate::animation::still(film, STILL);
    let source = picture.map(|png| format!("data:image/png;base64,{}", STANDARD.encode(png)));
    format!(
        "<img class=\"still\" id=\"still-{run}\" alt=\"{}\" src=\"{}\">",
        escape(&format!("The first moment: {}", known(film))),
        source.as_deref().unwrap_or("data:,"),
    )
}

fn title(films: &[&Film]) -> String {
    match films {
        [a, b] => format!("tumble: A {}, B {}", known(a), known(b)),
        [film] if !film.title.is_empty() => format!("tumble: {}", film.title),
        _ => "tumble".to_owned(),
    }
}

fn known(film: &Film) -> &str {
    if film.title.is_empty() { "without run.json" } else { &film.title }
}

/// JSON in which no character means anything to HTML. Outside its strings none of these
/// characters occurs.
fn escape_json(json: &str) -> String {
    json.chars().fold(String::with_capacity(json.len()), |mut out, c| {
        if matches!(c, '<' | '>' | '&' | '\u{2028}' | '\u{2029}') {
            let _ = write!(out, "\\u{:04x}", u32::from(c));
        } else {
            out.push(c);
        }
        out
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_part_ends_the_element_it_stands_in() {
        for script in SCRIPTS.iter().chain([&PLOTTER, &DRAWER]) {
            assert!(!script.contains("</script") && !script.contains("<!--"));
        }
        for style in STYLES {
            assert!(!style.contains("</style"));
        }
    }

    #[test]
    fn json_is_harmless_in_html() {
        let text = "</script><!-- & \u{2028}";
        let json = escape_json(&serde_json::to_string(text).unwrap());
        assert!(!json.contains(['<', '>', '&', '\u{2028}']));
        assert_eq!(serde_json::from_str::<String>(&json).unwrap(), text);
    }
}
