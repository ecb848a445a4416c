//! Plots of a film over time: two sheets of panels, as SVG and PNG.

pub(super) mod axes;
pub(super) mod curve;
mod energy;
mod joints;
mod motion;
pub(super) mod number;
pub(super) mod panel;
mod png;
pub(super) mod scale;
mod svg;
pub(super) mod thin;

pub(crate) use panel::{Panel, PanelMaker, PlotSeries};
pub(crate) use scale::{PlotAxis, ScaleKind, Transform};
pub(crate) use thin::thin_rows;

use crate::film::{Film, slope};

/// Sheets of plots.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlotSheet {
    /// Position, speed and forces of a body.
    Motion,
    /// Energy, height, residuals and iterations of all bodies.
    Energy,
}

impl PlotSheet {
    /// Heading of the sheet.
    pub fn name(self) -> &'static str {
        match self {
            Self::Motion => "Motion and contact",
            Self::Energy => "Energy and residual",
        }
    }

    /// Panels from top to bottom.
    pub(crate) fn panels(self, film: &Film) -> &'static [PanelMaker] {
        match self {
            Self::Motion if film.joints.is_empty() => &motion::PANELS,
            Self::Motion => &joints::PANELS,
            Self::Energy => &energy::PANELS,
        }
    }

    /// True if the panels show one body of a film with several.
    pub(crate) fn is_of_one_body(self) -> bool {
        self == Self::Motion
    }
}

/// Sheet of `film` as SVG. The motion sheet shows the body with index `body`, or the last one if
/// there are fewer. Output is deterministic, byte for byte.
pub fn svg(film: &Film, sheet: PlotSheet, body: usize) -> String {
    let body = body.min(film.bodies.len() - 1);
    let mut heading = sheet.name().to_owned();
    if sheet.is_of_one_body() {
        heading = format!("{heading} of {}", film.name(body));
    }
    let title = film.full_title();
    if !title.is_empty() {
        heading = format!("{heading}: {title}");
    }
    svg::draw(film, body, &heading, &notes(film), sheet.panels(film))
}

/// Converts the result of [`svg`] to PNG.
///
/// # Errors
/// Failure to draw it, in words.
pub fn png(svg: &str) -> Result<Vec<u8>, String> {
    png::rasterise(svg)
}

/// Summary of the run's parameters.
fn notes(film: &Film) -> String {
    let slope = film.inclined_ground().map_or(String::new(), |ground| {
        format!(", slope {}°", (slope(ground) * 100.0).round() / 100.0)
    });
    let friction =
        if film.may_touch() { format!(", μ = {}", film.world.friction()) } else { String::new() };
    let bodies = match film.bodies.as_slice() {
        [_] => format!("1 body{friction}"),
        bodies => format!("{} bodies{friction}", bodies.len()),
    };
    let rows = film.frames.len();
    let s = if rows == 1 { "" } else { "s" };
    format!("{rows} row{s}, h = {} s, {bodies}{slope}", film.world.time_step())
}
