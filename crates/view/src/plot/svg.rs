//! SVG drawing of a sheet of panels.

use super::axes::PlotAxes;
use super::curve::{dots, line, mark_path, steps};
use super::number::back_to_line;
use super::panel::{Panel, PanelMaker, PlotSeries};
use super::scale::{PlotAxis, ScaleKind};
use crate::MARK;
use crate::film::Film;
use crate::font::{Font, Heading};
use crate::markup::escape;
use std::fmt::Write as _;

/// Layout of a picture. One unit is a pixel at normal size.
const WIDTH: f64 = 1200.0;
const LEFT: f64 = 88.0;
const RIGHT: f64 = 32.0;
const TOP: f64 = 66.0;
const HEADING: f64 = 34.0;
const HEADING_SIZE: f64 = 17.0;
const BOTTOM: f64 = 50.0;
/// Vertical space per label of the vertical axis.
const ROOM_OF_TICK: f64 = 22.0;
/// Number of columns for thinning curves.
const COLUMNS: usize = (WIDTH - LEFT - RIGHT) as usize;
/// Maximum number of rows for which every value has a dot.
const FEW: usize = 60;
/// Mean width of a letter in the legend.
const LETTER: f64 = 5.6;
/// Maximum number of curves named in the legend.
const NAMED: usize = 8;

const FONT: &str = "'Noto Sans','DejaVu Sans',Helvetica,Arial,sans-serif";
const INK: &str = "#1f2328";
const FAINT: &str = "#59636e";
const GRID: &str = "#e3e7ec";
const FRAME: &str = "#b8c0c9";

/// Picture under construction.
struct SvgSheet {
    times: Vec<f64>,
    time: PlotAxis,
    body: String,
    y: f64,
}

/// Sheet of `panels` of a body over time.
pub fn draw(film: &Film, body: usize, heading: &str, notes: &str, panels: &[PanelMaker]) -> String {
    let times: Vec<f64> = film.frames.iter().map(|frame| frame.row.time).collect();
    let start = times.first().copied().unwrap_or(0.0);
    // A single row still needs a range.
    let end = times.last().copied().unwrap_or(0.0).max(start + film.frame_time());
    let time = PlotAxis::linear(start, end, 0.0, 10);
    let mut sheet = SvgSheet { times, time, body: String::new(), y: TOP };
    let (written, notes) = written(heading, notes);
    let title = format!("font-weight=\"700\">{}", escape(&written));
    sheet.text(LEFT, 30.0, "start", HEADING_SIZE, INK, &title);
    sheet.text(LEFT, 51.0, "start", 13.0, FAINT, &format!(">{}", escape(&notes)));
    // Panels of joints have no curves for a body without such joints.
    let made = panels.iter().map(|make| make(film, body));
    let mut made =
        made.filter(|panel| !panel.series.is_empty() && panel.blank().is_none()).peekable();
    while let Some(panel) = made.next() {
        sheet.panel(&panel, made.peek().is_none());
    }
    sheet.finish(heading)
}

/// Heading as far as it fits and the font supports its characters, and notes with a remark on
/// missing characters.
fn written(heading: &str, notes: &str) -> (String, String) {
    let room = WIDTH - LEFT - RIGHT;
    let Some(Heading { text, missing }) =
        Font::bold().map(|font| font.heading(heading, HEADING_SIZE, room))
    else {
        return (heading.to_owned(), notes.to_owned());
    };
    let remark = match missing {
        0 => String::new(),
        1 => " (a “?” stands for a character that the picture's font lacks)".to_owned(),
        n => format!(" (“?” stands for {n} characters that the picture's font lacks)"),
    };
    (text, notes.to_owned() + &remark)
}

impl SvgSheet {
    fn finish(mut self, heading: &str) -> String {
        let y = self.y + 38.0;
        self.text(
            (LEFT + WIDTH - RIGHT) / 2.0,
            y,
            "middle",
            13.0,
            INK,
            "class=\"axis\">time t (s)",
        );
        let height = self.y + BOTTOM;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" \
             viewBox=\"0 0 {WIDTH} {height}\" font-family=\"{FONT}\">\n<!-- {MARK} -->\n<title>{}</title>\n\
             <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n{}</svg>\n",
            escape(heading),
            self.body
        )
    }

    /// Adds a text. `rest` contains further attributes, `>` and the text.
    fn text(&mut self, x: f64, y: f64, anchor: &str, size: f64, fill: &str, rest: &str) {
        let _ = writeln!(
            self.body,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" font-size=\"{size}\" \
             fill=\"{fill}\" {rest}</text>"
        );
    }

    fn panel(&mut self, panel: &Panel, is_last: bool) {
        let top = self.y + HEADING;
        let (left, right, bottom) = (LEFT, WIDTH - RIGHT, top + panel.height);
        let y = PlotAxis::with_least_range(
            panel.kind,
            panel.values(),
            panel.least_range,
            (panel.height / ROOM_OF_TICK).ceil() as usize,
        );
        let axes = PlotAxes { x: self.time.clone(), y, left, right, top, bottom };

        let _ = writeln!(self.body, "<g class=\"panel\" id=\"{}\">", panel.id);
        self.heading(panel, axes.y.remark(panel.unit), top - 9.0);
        self.grid(&axes, is_last);
        self.legend(panel, top - 9.0);
        self.curves(panel, &axes);
        self.body.push_str("</g>\n");
        self.y = bottom;
    }

    /// Symbol, unit, description and remark on the scale.
    fn heading(&mut self, panel: &Panel, remark: Option<String>, y: f64) {
        let (symbol, index) = panel.symbol;
        let mut label = format!("class=\"axis\"><tspan font-weight=\"700\">{symbol}");
        if !index.is_empty() {
            let index = format!("<tspan dy=\"3.5\" font-size=\"10\">{index}</tspan>");
            label += &(index + &back_to_line(-3.5));
        }
        if !panel.unit.is_empty() {
            let _ = write!(label, " ({})", panel.unit);
        }
        let remark = remark.map_or(String::new(), |remark| format!(" · {remark}"));
        let _ = write!(
            label,
            "</tspan><tspan fill=\"{FAINT}\" dx=\"8\" font-size=\"12\">{}{remark}</tspan>",
            panel.words
        );
        self.text(LEFT, y, "start", 14.0, INK, &label);
    }

    /// Legend, laid out from right to left.
    fn legend(&mut self, panel: &Panel, y: f64) {
        let mut entries: Vec<(String, String)> = Vec::new();
        if panel.series.len() > 1 {
            for series in panel.series.iter().take(NAMED) {
                let stroke = format!(
                    "d=\"M0 0h16\" fill=\"none\" stroke=\"{}\" stroke-width=\"3\"",
                    series.colour
                );
                entries.push((stroke, series.name.clone()));
            }
        }
        for marks in &panel.marks {
            let count = marks.values.iter().filter(|value| !value.is_nan()).count();
            let path = mark_path(marks.status, 8.0, 0.0);
            let stroke = format!("d=\"{path}\" {}", mark_style(marks.colour));
            entries.push((stroke, format!("{} ({count})", marks.status)));
        }
        if let Some(more) = panel.series.len().checked_sub(NAMED + 1) {
            let text = format!("and {} more in the same colours", more + 1);
            entries.push(("d=\"\"".to_owned(), text));
        }
        let mut x = WIDTH - RIGHT;
        for (path, name) in entries.iter().rev() {
            self.text(x, y, "end", 12.0, INK, &format!("class=\"legend\">{name}"));
            x -= LETTER * name.chars().count() as f64 + 24.0;
            let _ = writeln!(
                self.body,
                "<path transform=\"translate({x:.1} {:.1})\" {path}/>",
                y - 4.0
            );
            x -= 14.0;
        }
    }

    fn grid(&mut self, axes: &PlotAxes, is_last: bool) {
        let lines = axes.grid();
        let _ = writeln!(
            self.body,
            "<path class=\"grid\" d=\"{lines}\" stroke=\"{GRID}\" fill=\"none\"/>\n\
             <path class=\"frame\" d=\"{}\" stroke=\"{FRAME}\" fill=\"none\"/>",
            axes.outline()
        );
        let below = axes.labels_below(18.0).filter(|_| is_last);
        for (x, y, anchor, label) in below.chain(axes.labels_beside(8.0)) {
            self.text(x, y, anchor, 12.0, FAINT, &format!(">{label}"));
        }
    }

    fn curves(&mut self, panel: &Panel, axes: &PlotAxes) {
        let place = |values: &[f64]| axes.curve(&self.times, values, COLUMNS);
        let few = self.times.len() <= FEW;
        let mut paths = String::new();
        for (series, width) in with_widths(&panel.series) {
            let points = place(&series.values);
            let colour = series.colour;
            let path =
                if panel.kind == ScaleKind::Count { line(&steps(&points)) } else { line(&points) };
            let _ = writeln!(
                paths,
                "<path class=\"series\" d=\"{path}\" stroke=\"{colour}\" stroke-width=\"{width:.2}\" \
                 fill=\"none\" stroke-linejoin=\"round\"/>"
            );
            let dots = dots(&points, few);
            if !dots.is_empty() {
                let size = if few { 5.0 } else { 3.0 };
                let _ = writeln!(
                    paths,
                    "<path class=\"dots\" d=\"{dots}\" stroke=\"{colour}\" \
                     stroke-width=\"{size}\" fill=\"none\" stroke-linecap=\"round\"/>"
                );
            }
        }
        for marks in &panel.marks {
            let mut path = String::new();
            for (x, y) in place(&marks.values).into_iter().flatten() {
                path.push_str(&mark_path(marks.status, x, y));
            }
            let _ = writeln!(
                paths,
                "<path class=\"marks {}\" d=\"{path}\" {}/>",
                marks.status,
                mark_style(marks.colour)
            );
        }
        self.body.push_str(&paths);
    }
}

/// Curves in drawing order with their widths. Curves that stay at 0 come first. Among the others,
/// earlier ones are wider, so that coinciding curves remain visible. If there are more curves than
/// the legend names, all widths are equal.
fn with_widths(series: &[PlotSeries]) -> impl Iterator<Item = (&PlotSeries, f64)> {
    let (idle, busy): (Vec<_>, Vec<_>) = series.iter().partition(|series| series.is_idle());
    let count = busy.len();
    let most = if series.len() > NAMED { 0.0 } else { 0.6 };
    let step = (3.2 / count.saturating_sub(1).max(1) as f64).min(most);
    let wider = move |(i, series)| (series, 1.5 + step * (count - 1 - i) as f64);
    idle.into_iter().map(|series| (series, 1.5)).chain(busy.into_iter().enumerate().map(wider))
}

fn mark_style(colour: &str) -> String {
    format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"1.8\"")
}

#[cfg(test)]
#[path = "tests/svg.rs"]
mod tests;
