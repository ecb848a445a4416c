//! A chart of a page: axes, curves, a legend.

use crate::markup::escape;
use crate::plot::curve::line;
use crate::plot::scale::Axis;
use crate::plot::thin::Point;
use std::fmt::Write as _;

/// The size of a chart and its margins. One unit is a pixel on a narrow screen.
const WIDTH: f64 = 440.0;
const HEIGHT: f64 = 290.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 30.0;
const BOTTOM: f64 = 46.0;
/// A chart in the making.
pub struct Chart {
    pub x: Axis,
    pub y: Axis,
    body: String,
}

impl Chart {
    /// An empty chart with its axes and their names.
    pub fn new(x: Axis, y: Axis, (x_name, y_name): (&str, &str)) -> Self {
        let mut chart = Self { x, y, body: String::new() };
        let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
        let (mut lines, mut labels) = (String::new(), String::new());
        for (value, label) in &chart.x.ticks {
            let (x, _) = chart.place((*value, 0.0));
            let _ = write!(lines, "M{x:.2} {TOP}V{bottom}");
            let y = bottom + 17.0;
            let _ = writeln!(
                labels,
                "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{label}</text>"
            );
        }
        for (value, label) in &chart.y.ticks {
            let (_, y) = chart.place((0.0, *value));
            let _ = write!(lines, "M{LEFT} {y:.2}H{right}");
            let (x, y) = (LEFT - 7.0, y + 4.2);
            let _ = writeln!(
                labels,
                "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"end\">{label}</text>"
            );
        }
        let middle = (LEFT + right) / 2.0;
        let _ = write!(
            chart.body,
            "<path class=\"grid\" d=\"{lines}\"/>\n\
             <path class=\"frame\" d=\"M{LEFT} {TOP}H{right}V{bottom}H{LEFT}Z\"/>\n{labels}\
             <text class=\"axis\" x=\"4\" y=\"16\">{}</text>\n\
             <text class=\"axis\" x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">{}</text>\n",
            escape(y_name),
            HEIGHT - 8.0,
            escape(x_name)
        );
        chart
    }

    /// Where a point is, in units of the chart.
    pub fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (
            LEFT + self.x.fraction(x) * (WIDTH - LEFT - RIGHT),
            HEIGHT - BOTTOM - self.y.fraction(y) * (HEIGHT - TOP - BOTTOM),
        )
    }

    /// A curve drawn as `class` says.
    pub fn line(&mut self, class: &str, points: &[Point]) {
        let placed: Vec<_> = points.iter().map(|p| p.map(|p| self.place(p))).collect();
        let _ = writeln!(self.body, "<path class=\"{class}\" d=\"{}\"/>", line(&placed));
    }

    /// Adds what is drawn by hand.
    pub fn draw(&mut self, markup: &str) {
        self.body.push_str(markup);
    }

    /// The figure, with its caption, which is markup.
    pub fn figure(self, words: &str, caption: &str) -> String {
        format!(
            "<figure>\n<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\">\n{}\
             </svg>\n<figcaption>{caption}</figcaption>\n</figure>\n",
            escape(words),
            self.body
        )
    }
}

/// An entry of a legend: what is drawn like `drawn`.
pub fn key(drawn: &str, name: &str) -> String {
    format!(
        "<span class=\"key\"><svg viewBox=\"0 0 26 10\" aria-hidden=\"true\">{drawn}</svg>{}</span> ",
        escape(name)
    )
}
