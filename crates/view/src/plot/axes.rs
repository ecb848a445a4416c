//! Pair of axes in a picture: positions of values, grid, and tick labels.

use super::scale::PlotAxis;
use super::thin::{PlotPoint, thin};
use std::fmt::Write as _;

/// Two axes and their rectangle, in units of the picture.
pub struct PlotAxes {
    pub x: PlotAxis,
    pub y: PlotAxis,
    pub left: f64,
    pub right: f64,
    pub top: f64,
    pub bottom: f64,
}

/// Tick label: position, text anchor and text.
type AxisLabel<'a> = (f64, f64, &'static str, &'a str);

impl PlotAxes {
    /// Position of a point.
    pub fn place(&self, x: f64, y: f64) -> (f64, f64) {
        (
            self.left + self.x.fraction(x) * (self.right - self.left),
            self.bottom - self.y.fraction(y) * (self.bottom - self.top),
        )
    }

    /// Positions of the points of a curve, thinned to `columns`.
    pub fn curve(&self, times: &[f64], values: &[f64], columns: usize) -> Vec<PlotPoint> {
        let points = thin(times, values, self.x.ends(), columns);
        points.into_iter().map(|point| point.map(|(x, y)| self.place(x, y))).collect()
    }

    /// Path data of the rectangle.
    pub fn outline(&self) -> String {
        let Self { left, right, top, bottom, .. } = self;
        format!("M{left} {top:.2}H{right}V{bottom:.2}H{left}Z")
    }

    /// Path data of a line at every tick.
    pub fn grid(&self) -> String {
        let Self { left, right, top, bottom, .. } = self;
        let mut lines = String::new();
        for (x, ..) in self.labels_below(0.0) {
            let _ = write!(lines, "M{x:.2} {top:.2}V{bottom:.2}");
        }
        for (value, _) in &self.y.ticks {
            let _ = write!(lines, "M{left} {:.2}H{right}", self.place(0.0, *value).1);
        }
        lines
    }

    /// Labels of the horizontal axis, at a distance `room` below it.
    pub fn labels_below(&self, room: f64) -> impl Iterator<Item = AxisLabel<'_>> {
        let ticks = self.x.ticks.iter();
        ticks.map(move |(x, label)| {
            (self.place(*x, 0.0).0, self.bottom + room, "middle", label.as_str())
        })
    }

    /// Labels of the vertical axis, at a distance `room` to its left. The baseline is lowered by
    /// half the height of a digit.
    pub fn labels_beside(&self, room: f64) -> impl Iterator<Item = AxisLabel<'_>> {
        let ticks = self.y.ticks.iter();
        ticks.map(move |(y, label)| {
            (self.left - room, self.place(0.0, *y).1 + 4.2, "end", label.as_str())
        })
    }
}
