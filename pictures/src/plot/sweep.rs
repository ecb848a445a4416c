//! A number and its derivative over what was varied.

use super::scale::{Axis, Kind};
use crate::chart::{Chart, SIZE};
use crate::markup::escape;

/// Numbers over one that goes through a range. What is NaN is a gap.
#[derive(Debug, Clone, Copy)]
pub struct Sweep<'a> {
    /// The heading of the picture.
    pub heading: &'a str,
    /// What is varied, with its unit.
    pub argument: &'a str,
    /// The number, with its unit.
    pub quantity: &'a str,
    /// What the derivative is called.
    pub slope: &'a str,
    /// The values of what is varied, growing.
    pub at: &'a [f64],
    /// The number at each.
    pub values: &'a [f64],
    /// Its derivative at each.
    pub derivatives: &'a [f64],
    /// A difference beside each, as a dot.
    pub differences: &'a [f64],
}

const STYLE: &str = "text{font-size:11px;fill:#1f2328}.axis{font-weight:700}.heading{font-size:13px;font-weight:700}\
    .grid{stroke:#e3e7ec;fill:none}.frame{stroke:#b8c0c9;fill:none}\
    .number{stroke:#0072b2;stroke-width:1.6;fill:none}.slope{stroke:#d55e00;stroke-width:1.6;fill:none}\
    .difference{fill:#3d3d3d}";
const HEADING: f64 = 26.0;

/// The picture as SVG.
#[must_use]
pub fn sweep(sweep: &Sweep<'_>) -> String {
    let Sweep { heading, argument, quantity, slope, at, .. } = *sweep;
    let ends = (at.first().copied().unwrap_or(0.0), at.last().copied().unwrap_or(1.0));
    let chart = |name: &str, class: &str, numbers: &[f64], dots: &[f64]| {
        let all = numbers.iter().chain(dots).copied().filter(|x| x.is_finite());
        let axis = Axis::new(Kind::FromZero, all, 6);
        let mut chart = Chart::new(Axis::linear(ends.0, ends.1, 0.0, 6), axis, (argument, name));
        chart.curve(class, at, numbers);
        for (at, dot) in at.iter().zip(dots).filter(|(_, dot)| dot.is_finite()) {
            chart.dot("difference", 1.6, (*at, *dot));
        }
        chart
    };
    let ((width, height), none) = (SIZE, []);
    let number = chart(quantity, "number", sweep.values, &none).part(HEADING);
    let slope = chart(slope, "slope", sweep.derivatives, sweep.differences).part(HEADING + height);
    let (all, title) = (HEADING + 2.0 * height, escape(heading));
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{all}\" viewBox=\"0 0 {width} {all}\" \
         font-family=\"'Noto Sans','DejaVu Sans',Helvetica,Arial,sans-serif\">\n<title>{title}</title>\n\
         <style>{STYLE}</style>\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n\
         <text class=\"heading\" x=\"4\" y=\"18\">{title}</text>\n{number}{slope}</svg>\n"
    )
}
