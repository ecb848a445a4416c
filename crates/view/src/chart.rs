//! Chart of a page: axes, curves and legend.

use crate::markup::escape;
use crate::plot::axes::PlotAxes;
use crate::plot::curve::line;
use crate::plot::thin::PlotPoint;
use std::fmt::Write as _;

pub use crate::plot::scale::{PlotAxis, ScaleKind};

/// Size of a chart. One unit is a pixel on a narrow screen.
const WIDTH: f64 = 440.0;
const HEIGHT: f64 = 290.0;

/// Chart under construction.
pub struct Chart {
    axes: PlotAxes,
    body: String,
}

impl Chart {
    /// Empty chart with axes and their labels.
    pub fn new(x: PlotAxis, y: PlotAxis, x_name: &str, y_name: &str) -> Self {
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

    /// Adds a line through points, with the style `class`.
    pub fn line(&mut self, class: &str, points: impl IntoIterator<Item = (f64, f64)>) {
        let points = points.into_iter().map(|point| Some(self.axes.place(point.0, point.1)));
        self.path(class, &points.collect::<Vec<_>>());
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

    /// Completes the figure. `caption` is markup and `words` describe the figure.
    pub fn figure(self, words: &str, caption: &str) -> String {
        format!(
            "<figure>\n<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\">\n{}\
             </svg>\n<figcaption>{caption}</figcaption>\n</figure>\n",
            escape(words),
            self.body
        )
    }
}

/// Legend entry with a line.
pub fn line_key(class: &str, name: &str) -> String {
    key(&format!("<path class=\"{class}\" d=\"M0 5h26\"/>"), name)
}

/// Legend entry with the symbol `drawn`.
pub fn key(drawn: &str, name: &str) -> String {
    format!(
        "<span class=\"key\"><svg viewBox=\"0 0 26 10\" aria-hidden=\"true\">{drawn}</svg>{}</span> ",
        escape(name)
    )
}
