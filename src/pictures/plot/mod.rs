//! A trajectory as curves over time: two sheets of panels, as SVG and as PNG.

pub(super) mod curve;
mod energy;
mod motion;
pub(super) mod number;
mod panel;
mod png;
pub(super) mod scale;
pub(super) mod svg;
pub(super) mod thin;

use super::Film;

/// The sheets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sheet {
    /// Position, contact forces, slacks, multipliers.
    Motion,
    /// Energy, touch, certificates, iterations.
    Energy,
}

/// A sheet of `film` as SVG. The same film gives the same bytes.
pub fn svg(film: &Film, sheet: Sheet) -> String {
    let (name, panels) = match sheet {
        Sheet::Motion => ("Motion and contact", motion::PANELS.as_slice()),
        Sheet::Energy => ("Energy and certificate", energy::PANELS.as_slice()),
    };
    let heading = match film.title.as_str() {
        "" => name.to_owned(),
        title => format!("{name}: {title}"),
    };
    svg::draw(film, &heading, &notes(film), panels)
}

/// An SVG of [`svg`] as PNG.
///
/// # Errors
/// Why it cannot be drawn, in words.
pub fn png(svg: &str) -> Result<Vec<u8>, String> {
    png::rasterise(svg)
}

/// The run in numbers.
fn notes(film: &Film) -> String {
    let model = &film.model;
    format!(
        "{} row{}, h = {} s, m = {} kg, μ = {}, {} corners",
        film.rows.len(),
        if film.rows.len() == 1 { "" } else { "s" },
        model.time_step(),
        model.body().mass(),
        model.friction(),
        model.contact_count()
    )
}
