//! HTML page that plays one or two films in a browser.
//!
//! The page is a single file without external resources. Styles, scripts and data are embedded.
//! `page/` contains the sources and `vendor/` the libraries for 3-D drawing and plots. Output is
//! deterministic, byte for byte.

mod curves;
mod data;
mod distance;
mod encode;
mod facts;
mod live;
mod poses;
mod scripts;

pub use live::{LiveParts, live_parts};

use crate::animation::{self, AnimationSettings};
use crate::film::Film;
use crate::forces::Scale;
use crate::markup::escape;
use crate::palette;
use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use std::fmt::Write as _;

const TEMPLATE: &str = include_str!("page/index.html");
const STYLES: [&str; 2] = [include_str!("vendor/uPlot.min.css"), include_str!("page/style.css")];
const PLOTTER_LICENCE: &str = include_str!("vendor/LICENSE-uPlot");
const PLOTTER: &str = include_str!("vendor/uPlot.iife.min.js");
const DRAWER_LICENCE: &str = include_str!("vendor/LICENSE-three");
const DRAWER: &str = include_str!("vendor/three.iife.min.js");
/// Size of the still picture shown without WebGL or JavaScript (pixels).
const STILL: u16 = 560;

/// Page of one or two `films`, made by `version` of tumble.
///
/// # Errors
/// Failure to serialise the data, in words.
pub fn page(version: &str, films: &[&Film]) -> Result<String, String> {
    let data = serde_json::to_string(&data::PageData::new(version, films))
        .map_err(|error| error.to_string())?;
    let scripts = format!(
        "(() => {{\n\"use strict\";\n{}}})();\n",
        scripts::joined(&scripts::page_scripts())
    );
    let mut page =
        String::with_capacity(data.len() + scripts.len() + DRAWER.len() + 2 * PLOTTER.len());
    let mut rest = TEMPLATE;
    // Only the template is searched, since inserted text may contain braces.
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").unwrap_or((after, ""));
        page.push_str(before);
        match name {
            "title" => page.push_str(&escape(&title(films))),
            "heading" => page.push_str(&escape(&heading(films))),
            "style" => {
                page.push_str(&palette::style());
                page.extend(STYLES);
            }
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

/// Bodies, fixed objects and ground of a `film` in the form that the scripts of the page draw, as
/// JSON.
///
/// # Errors
/// Failure to serialise the data, in words.
pub fn drawing(film: &Film) -> Result<String, String> {
    serde_json::to_string(&data::RunData::new(film, Scale::from_films(&[film])))
        .map_err(|error| error.to_string())
}

/// First frame of a run as an image, hidden unless the page shows it.
fn still(run: usize, film: &Film) -> String {
    let settings = AnimationSettings { size: STILL, ..AnimationSettings::default() };
    let start = film.frames.first().map_or(0.0, |frame| frame.row.time);
    let picture = animation::still(film, &settings, start).ok();
    let source = picture.map(|png| format!("data:image/png;base64,{}", STANDARD.encode(png)));
    format!(
        "<img class=\"still\" id=\"still-{run}\" alt=\"{}\" src=\"{}\">",
        escape(&format!("The first moment: {}", display_name(film))),
        source.as_deref().unwrap_or("data:,"),
    )
}

/// Title of the document.
fn title(films: &[&Film]) -> String {
    match films {
        [film] if film.title.is_empty() => "tumble".to_owned(),
        _ => heading(films),
    }
}

/// Heading of the page.
fn heading(films: &[&Film]) -> String {
    match films {
        [a, b] if a.title == b.title => format!("A {}, B {}", a.full_title(), b.full_title()),
        [a, b] => format!("A {}, B {}", display_name(a), display_name(b)),
        [film] => display_name(film).to_owned(),
        _ => String::new(),
    }
}

fn display_name(film: &Film) -> &str {
    if film.title.is_empty() { "untitled" } else { &film.title }
}

/// Escapes JSON for HTML. The escaped characters only occur inside JSON strings.
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
mod tests;
