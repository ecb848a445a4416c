//! A panel: what is drawn, before it is drawn.

use super::scale::ScaleKind;
use crate::film::{Film, Status};

/// One pair of axes with its curves.
#[derive(Default)]
pub struct Panel {
    /// Its name in the SVG.
    pub id: &'static str,
    /// The symbol of the vertical axis, and its index.
    pub symbol: (&'static str, &'static str),
    /// The unit of the vertical axis, empty for a count.
    pub unit: &'static str,
    /// The quantity in words.
    pub words: &'static str,
    pub kind: ScaleKind,
    /// Of the axes, in the units of the picture.
    pub height: f64,
    pub series: Vec<PlotSeries>,
    /// What the names of the curves are names of, where they are not words.
    pub legend: Option<&'static str>,
    /// Single steps made conspicuous.
    pub marks: Vec<Marks>,
    /// What the panel says instead when it has nothing but zeros or gaps to show.
    pub nothing: Option<&'static str>,
}

/// What is said of a vertical axis: its symbol with an index, its unit, the quantity in words.
pub type AxisTitle = ((&'static str, &'static str), &'static str, &'static str);

/// A curve: value i belongs to frame i; NaN is a gap.
pub struct PlotSeries {
    /// For the legend; a single curve needs none.
    pub name: String,
    pub colour: &'static str,
    pub values: Vec<f64>,
}

/// The steps of one status, each at its value; NaN where a step has another status.
pub struct Marks {
    pub status: Status,
    pub colour: &'static str,
    pub values: Vec<f64>,
}

/// Makes a panel of a film and one of its bodies. Panels are made one at a time: of a long run,
/// each is large.
pub type PanelMaker = fn(&Film, usize) -> Panel;

/// Colours that stay distinct for the colour-blind (after Okabe and Ito).
pub const COLOURS: [&str; 8] =
    ["#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#7f5539", "#3d3d3d"];

/// What is larger is beyond a picture.
pub const LARGEST: f64 = 1e150;

impl Panel {
    /// A panel of one curve in a colour.
    pub fn of_curve(
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

    /// What to say instead of drawing.
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

    /// Whether it has nothing but zeros and gaps.
    pub fn is_idle(&self) -> bool {
        self.values.iter().all(|value| *value == 0.0 || value.is_nan())
    }
}

/// `value`, or a gap for what is beyond a picture.
pub fn shown(value: f64) -> f64 {
    if value.abs() <= LARGEST { value } else { f64::NAN }
}
