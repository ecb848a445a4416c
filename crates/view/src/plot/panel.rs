//! Content of a panel, independent of its drawing.

use super::scale::ScaleKind;
use crate::film::Film;
use tumble_core::step::StepStatus;

/// One pair of axes with its curves.
#[derive(Default)]
pub struct Panel {
    /// Identifier in the SVG.
    pub id: &'static str,
    /// Symbol of the vertical axis, and its subscript.
    pub symbol: (&'static str, &'static str),
    /// Unit of the vertical axis; empty for a count.
    pub unit: &'static str,
    /// Description of the quantity.
    pub words: &'static str,
    pub kind: ScaleKind,
    /// Smallest range of a linear axis, in its unit. Rounding errors then look like zero.
    pub least_range: f64,
    /// Height of the axes, in units of the picture.
    pub height: f64,
    pub series: Vec<PlotSeries>,
    /// Highlighted steps.
    pub marks: Vec<Marks>,
    /// Message shown if the panel has only zeros or gaps.
    pub nothing: Option<&'static str>,
}

/// Title of a vertical axis: symbol with subscript, unit, and description of the quantity.
pub type AxisTitle = ((&'static str, &'static str), &'static str, &'static str);

/// A curve. Value i belongs to frame i, and NaN is a gap.
pub struct PlotSeries {
    /// Name in the legend; a single curve needs none.
    pub name: String,
    pub colour: &'static str,
    pub values: Vec<f64>,
}

/// Steps with one status, each at its value. NaN for steps with another status.
pub struct Marks {
    pub status: StepStatus,
    pub colour: &'static str,
    pub values: Vec<f64>,
}

/// Function that creates a panel for a body of a film. Panels of long runs are large and therefore
/// created one at a time.
pub type PanelMaker = fn(&Film, usize) -> Panel;

/// Colours that are distinct for colour-blind readers (after Okabe and Ito).
pub const COLOURS: [&str; 8] =
    ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#7f5539", "#3d3d3d"];

/// Smallest range of an axis over the scale of its quantity: the weight of a body, its size, or a
/// radian.
pub const NEGLIGIBLE: f64 = 1e-6;

/// Largest magnitude in a picture.
pub const LARGEST: f64 = 1e150;

impl Panel {
    /// Panel with one curve.
    pub fn from_curve(
        id: &'static str,
        (symbol, unit, words): AxisTitle,
        height: f64,
        colour: usize,
        values: impl Iterator<Item = f64>,
    ) -> Self {
        let series = vec![PlotSeries::new("", colour, values)];
        Self {
            id,
            symbol,
            unit,
            words,
            kind: ScaleKind::FromZero,
            height,
            series,
            ..Self::default()
        }
    }

    /// Message to show if there is nothing to draw.
    pub fn blank(&self) -> Option<&'static str> {
        self.nothing.filter(|_| self.series.iter().all(PlotSeries::is_idle))
    }

    /// All values of all curves.
    pub fn values(&self) -> impl Iterator<Item = f64> + Clone {
        self.series.iter().flat_map(|series| series.values.iter().copied())
    }
}

impl PlotSeries {
    pub fn new(name: impl Into<String>, colour: usize, values: impl Iterator<Item = f64>) -> Self {
        let colour = COLOURS[colour % COLOURS.len()];
        Self { name: name.into(), colour, values: values.map(shown).collect() }
    }

    /// True if it has only zeros and gaps.
    pub fn is_idle(&self) -> bool {
        self.values.iter().all(|value| *value == 0.0 || value.is_nan())
    }
}

/// Returns `value`, or NaN if it is too large for a picture.
pub fn shown(value: f64) -> f64 {
    if value.abs() <= LARGEST { value } else { f64::NAN }
}
