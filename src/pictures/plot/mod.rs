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

pub use panel::{Panel, PanelMaker, Series, steps};
pub use scale::{Axis, Kind, Transform};
pub use thin::thin_rows;

use super::Film;

/// The sheets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sheet {
    /// Position, contact forces, slacks, multipliers.
    Motion,
    /// Energy, touch, certificates, iterations.
    Energy,
}

impl Sheet {
    /// What stands above it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Motion => "Motion and contact",
            Self::Energy => "Energy and certificate",
        }
    }

    /// Its panels from top to bottom.
    pub fn panels(self) -> &'static [PanelMaker] {
        match self {
            Self::Motion => &motion::PANELS,
            Self::Energy => &energy::PANELS,
        }
    }
}

/// A sheet of `film` as SVG. The same film gives the same bytes.
pub fn svg(film: &Film, sheet: Sheet) -> String {
    let name = sheet.name();
    let heading = match film.title.as_str() {
        "" => name.to_owned(),
        title => format!("{name}: {title}"),
    };
    svg::draw(film, &heading, &notes(film), sheet.panels())
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
    let slope = if model.plane().is_level() {
        String::new()
    } else {
        let angle = model.plane().normal()[2].clamp(-1.0, 1.0).acos().to_degrees();
        format!(", slope {}°", (angle * 100.0).round() / 100.0)
    };
    format!(
        "{} row{}, h = {} s, m = {} kg, μ = {}, {} corners{slope}",
        film.rows.len(),
        if film.rows.len() == 1 { "" } else { "s" },
        model.time_step(),
        model.body().mass(),
        model.friction(),
        model.contact_count()
    )
}
