//! Chart of a page: axes, curves and legend.

use crate::markup::escape;
use crate::plot::axes::PlotAxes;
use crate::plot::curve::line;
use crate::plot::scale::{PlotAxis, ScaleKind};
use crate::plot::thin::PlotPoint;
use std::fmt::Write as _;

/// Size of a chart. One unit is a pixel on a narrow screen.
const WIDTH: f64 = 440.0;
const HEIGHT: f64 = 290.0;
/// Number of columns for thinning curves over time.
const COLUMNS: usize = 160;

/// Chart under construction.
pub struct Chart {
    axes: PlotAxes,
    body: String,
}

impl Chart {
    /// Empty chart with axes and their labels.
    pub(crate) fn new(x: PlotAxis, y: PlotAxis, x_name: &str, y_name: &str) -> Self {
        let axes =
            PlotAxes { x, y, left: 64.0, right: WIDTH - 16.0, top: 30.0, bottom: HEIGHT - 46.0 };
        let mut body = format!(
            "<path class=\"grid\" d=\"{}\"/>\n<path class=\"frame\" d=\"{}\"/>\n",
            axes.grid(),
            axes.outline()
        );
        for (x, y, anchor, label) in axes.labels_below(17.0).chain(axes.labels_beside(7.0)) {
            let _ = writeln!(
                body,
                "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{label}</text>"
            );
        }
        let _ = write!(
            body,
            "<text class=\"axis\" x=\"4\" y=\"16\">{}</text>\n\
             <text class=\"axis\" x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n",
            escape(y_name),
            (axes.left + axes.right) / 2.0,
            HEIGHT - 8.0,
            escape(x_name)
        );
        Self { axes, body }
    }

    /// Empty chart of `values` over time up to `end`.
    pub(crate) fn over_time(
        name: &str,
        end: f64,
        kind: ScaleKind,
        values: impl Iterator<Item = f64> + Clone,
    ) -> Self {
        let (time, axis) = (PlotAxis::linear(0.0, end, 0.0, 6), PlotAxis::new(kind, values, 6));
        Self::new(time, axis, "time t (s)", name)
    }

    /// Empty chart of `values` over time up to `end`, with a linear axis.
    pub fn linear_over_time(
        name: &str,
        end: f64,
        values: impl Iterator<Item = f64> + Clone,
    ) -> Self {
        Self::over_time(name, end, ScaleKind::Linear, values)
    }

    /// Empty chart for `points` with logarithmic axes.
    pub fn logarithmic(
        points: impl Iterator<Item = (f64, f64)> + Clone,
        x_name: &str,
        y_name: &str,
    ) -> Self {
        let x = PlotAxis::new(ScaleKind::Log, points.clone().map(|point| point.0), 4);
        let y = PlotAxis::new(ScaleKind::Log, points.map(|point| point.1), 6);
        Self::new(x, y, x_name, y_name)
    }

    /// Values at the ends of the vertical axis.
    #[must_use]
    pub fn heights(&self) -> [f64; 2] {
        self.axes.y.ends()
    }

    /// Adds a line through points, with the style `class`.
    pub fn line(&mut self, class: &str, points: impl IntoIterator<Item = (f64, f64)>) {
        let points = points.into_iter().map(|point| Some(self.axes.place(point.0, point.1)));
        self.path(class, &points.collect::<Vec<_>>());
    }

    /// Adds the thinned curve of `values` over `times`. NaN is a gap.
    pub fn curve(&mut self, class: &str, times: &[f64], values: &[f64]) {
        self.path(class, &self.axes.curve(times, values, COLUMNS));
    }

    fn path(&mut self, class: &str, points: &[PlotPoint]) {
        let _ = writeln!(self.body, "<path class=\"{class}\" d=\"{}\"/>", line(points));
    }

    /// Adds bars over `spans` of the horizontal axis, between two heights.
    pub fn bars(
        &mut self,
        class: &str,
        spans: impl Iterator<Item = (f64, f64)>,
        low: f64,
        high: f64,
    ) {
        let mut path = String::new();
        for (from, to) in spans {
            let ((left, bottom), (right, top)) =
                (self.axes.place(from, low), self.axes.place(to, high));
            let _ = write!(path, "M{left:.2} {bottom:.2}H{right:.2}V{top:.2}H{left:.2}z");
        }
        let _ = writeln!(self.body, "<path class=\"{class}\" d=\"{path}\"/>");
    }

    /// Adds a dot at a point.
    pub fn dot(&mut self, class: &str, radius: f64, x: f64, y: f64) {
        let (x, y) = self.axes.place(x, y);
        self.body += &dot(class, radius, x, y);
        self.body.push('\n');
    }

    /// Completes the figure. `caption` is markup and `words` describe the figure.
    #[must_use]
    pub fn figure(self, words: &str, caption: &str) -> String {
        format!(
            "<figure>\n<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\">\n{}\
             </svg>\n<figcaption>{caption}</figcaption>\n</figure>\n",
            escape(words),
            self.body
        )
    }
}

fn dot(class: &str, radius: f64, x: f64, y: f64) -> String {
    format!("<circle class=\"{class}\" cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius}\"/>")
}

/// Legend entry with a line.
#[must_use]
pub fn line_key(class: &str, name: &str) -> String {
    key(&format!("<path class=\"{class}\" d=\"M0 5h26\"/>"), name)
}

/// Legend entry with a dot.
#[must_use]
pub fn dot_key(class: &str, radius: f64, name: &str) -> String {
    key(&dot(class, radius, 13.0, 5.0), name)
}

/// Legend entry with the symbol `drawn`.
pub fn key(drawn: &str, name: &str) -> String {
    format!(
        "<span class=\"key\"><svg viewBox=\"0 0 26 10\" aria-hidden=\"true\">{drawn}</svg>{}</span> ",
        escape(name)
    )
}
