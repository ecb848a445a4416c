//! Plot panels as data for the page.

use super::encode::{PackedNumbers, packed_floats, packed_rows};
use crate::film::Film;
use crate::plot::{Panel, PanelMaker, PlotAxis, Transform, thin_rows};
use serde::Serialize;

/// Number of columns for thinning curves. Each column keeps its extremes. Up to four rows per
/// column are all kept.
pub const COLUMNS: usize = 1000;
/// Minimum number of columns if each of many bodies has its own plots. A plot of the page is about
/// 450 pixels wide, and each column has up to four points.
const FEWEST_COLUMNS: usize = 125;
/// Maximum number of marks of a status, thinned evenly.
pub const MOST_MARKS: usize = 5000;
/// Approximate number of labels on an axis.
const TICKS: usize = 6;
/// Plots that are initially open.
const OPEN: [&str; 9] =
    ["distance", "z", "force", "angle", "slide", "torque", "energy", "residual", "height"];

/// One pair of axes with the curves of all runs.
#[derive(Serialize)]
pub struct Plot {
    id: &'static str,
    /// Symbol of the vertical axis, and its subscript.
    symbol: (&'static str, &'static str),
    unit: &'static str,
    words: &'static str,
    open: bool,
    /// Message shown if there are no curves.
    nothing: Option<&'static str>,
    axis: AxisData,
    series: Vec<PageCurve>,
    marks: Vec<MarksData>,
}

#[derive(Serialize)]
struct AxisData {
    /// Scale: `linear`, `symlog` or `log`.
    scale: &'static str,
    /// Threshold below which a symlog axis is linear.
    threshold: Option<f64>,
    low: f64,
    high: f64,
    ticks: Vec<f64>,
    /// True if a logarithmic axis shows zeros, which it does at its lower end.
    has_zeros: bool,
}

#[derive(Serialize)]
struct PageCurve {
    run: usize,
    name: String,
    colour: &'static str,
    rows: PackedNumbers,
    /// Values; NaN is a gap.
    values: PackedNumbers,
}

#[derive(Serialize)]
struct MarksData {
    run: usize,
    status: &'static str,
    colour: &'static str,
    /// Number of marks, some of which may be missing in `rows`.
    count: usize,
    rows: PackedNumbers,
    values: PackedNumbers,
}

/// Plots of `makers` for body `body`. They are made one at a time, since panels of long runs are
/// large. If each of many bodies has its own plots, they are coarser.
pub fn plots(films: &[&Film], makers: &[PanelMaker], body: usize, bodies: usize) -> Vec<Plot> {
    let has_steps = films.iter().any(|film| !film.steps().is_empty());
    let columns = (COLUMNS / bodies).max(FEWEST_COLUMNS);
    let panels = |make: &PanelMaker| films.iter().map(|film| make(film, body)).collect();
    makers.iter().map(|make| plot(panels(make), has_steps, columns)).collect()
}

/// Plot of one panel of every run.
pub fn plot(panels: Vec<Panel>, has_steps: bool, columns: usize) -> Plot {
    let first = &panels[0];
    let blank = panels.iter().all(|panel| panel.blank().is_some());
    let nothing = if has_steps { first.nothing } else { Some("no step in this run") };
    let values = panels.iter().flat_map(Panel::values);
    let axis = PlotAxis::with_least_range(first.kind, values, first.least_range, TICKS);
    let series = panels.iter().enumerate().flat_map(|(run, panel)| {
        panel.series.iter().map(move |series| {
            let (rows, values) = thinned(&series.values, columns);
            PageCurve { run, name: series.name.clone(), colour: series.colour, rows, values }
        })
    });
    let marks = panels.iter().enumerate().flat_map(|(run, panel)| {
        panel.marks.iter().map(move |marks| {
            let all: Vec<usize> =
                (0..marks.values.len()).filter(|&i| !marks.values[i].is_nan()).collect();
            let kept = || all.iter().copied().step_by(all.len().div_ceil(MOST_MARKS).max(1));
            MarksData {
                run,
                status: marks.status.name(),
                colour: marks.colour,
                count: all.len(),
                rows: packed_rows(kept()),
                values: packed_floats(kept().map(|i| marks.values[i])),
            }
        })
    });
    Plot {
        id: first.id,
        symbol: first.symbol,
        unit: first.unit,
        words: first.words,
        open: OPEN.contains(&first.id) && !blank,
        nothing: nothing.filter(|_| blank),
        axis: AxisData::new(&axis),
        series: series.collect(),
        marks: marks.collect(),
    }
}

impl AxisData {
    fn new(axis: &PlotAxis) -> Self {
        let (scale, threshold) = match axis.transform() {
            Transform::Identity => ("linear", None),
            Transform::Symlog(threshold) => ("symlog", Some(threshold)),
            Transform::Log => ("log", None),
        };
        let [low, high] = axis.ends();
        let ticks = axis.ticks.iter().map(|(value, _)| *value).collect();
        Self { scale, threshold, low, high, ticks, has_zeros: axis.has_zeros() }
    }
}

/// Rows and values of a thinned curve. A gap becomes NaN at a row inside it. Inner points of
/// constant stretches are omitted. Values beyond the range of `f32` become NaN.
fn thinned(values: &[f64], columns: usize) -> (PackedNumbers, PackedNumbers) {
    let times: Vec<f64> = (0..values.len()).map(|i| i as f64).collect();
    let range = [0.0, values.len() as f64];
    let rows = thin_rows(&times, values, range, columns);
    let shown =
        |i: usize| if values[i].abs() <= f64::from(f32::MAX) { values[i] } else { f64::NAN };
    let mut points: Vec<(usize, f64)> = Vec::with_capacity(rows.len());
    let mut gap = false;
    for row in rows {
        let Some(i) = row else {
            gap = true;
            continue;
        };
        if std::mem::take(&mut gap) && i > 0 {
            points.push((i - 1, f64::NAN));
        }
        let value = shown(i);
        if let [.., before, last] = &mut points[..]
            && before.1 == value
            && last.1 == value
        {
            *last = (i, value);
        } else {
            points.push((i, value));
        }
    }
    let rows = packed_rows(points.iter().map(|point| point.0));
    (rows, packed_floats(points.iter().map(|point| point.1)))
}

#[cfg(test)]
#[path = "tests/curves.rs"]
mod tests;
