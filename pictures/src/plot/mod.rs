//! A trajectory as curves over time: two sheets of panels, as SVG and as PNG.

pub(super) mod curve;
mod energy;
mod font;
mod motion;
pub(super) mod number;
pub(super) mod panel;
mod png;
pub(super) mod scale;
mod svg;
pub(super) mod thin;

pub(crate) use panel::{Panel, PanelMaker, Series};
pub(crate) use scale::{Axis, Kind, Transform};
pub(crate) use thin::thin_rows;

use crate::film::Film;

/// The sheets.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sheet {
    /// Position, contact forces, slacks, multipliers.
    Motion,
    /// Energy, touch, residuals, iterations.
    Energy,
}

impl Sheet {
    /// What stands above it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Motion => "Motion and contact",
            Self::Energy => "Energy and residual",
        }
    }

    /// Its panels from top to bottom.
    pub(crate) fn panels(self) -> &'static [PanelMaker] {
        match self {
            Self::Motion => &motion::PANELS,
            Self::Energy => &energy::PANELS,
        }
    }
}

/// A sheet of `film` as SVG. The same film gives the same bytes.
#[must_use]
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
    let slope = film.inclined_ground().map_or(String::new(), |ground| {
        format!(", slope {}°", (ground.slope() * 100.0).round() / 100.0)
    });
    let friction =
        if film.may_touch() { format!(", μ = {}", film.friction) } else { String::new() };
    format!(
        "{} row{}, h = {} s, m = {} kg{friction}, {} corners{slope}",
        film.frames.len(),
        if film.frames.len() == 1 { "" } else { "s" },
        film.time_step,
        film.body().mass,
        film.body().points.len()
    )
}
