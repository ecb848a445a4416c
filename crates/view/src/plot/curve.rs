//! SVG path data of curves and marks.

use super::thin::PlotPoint;
use std::fmt::Write as _;
use tumble_core::step::StepStatus;

/// Coordinates in hundredths of a unit, the precision of a path.
fn hundredths(x: f64, y: f64) -> [i64; 2] {
    [x, y].map(|value| (100.0 * value).round() as i64)
}

fn push(path: &mut String, command: char, [x, y]: [i64; 2]) {
    let _ = write!(path, "{command}{} {}", x as f64 / 100.0, y as f64 / 100.0);
}

/// Path through `points`, interrupted at gaps. Inner points of a horizontal stretch are omitted.
pub fn line(points: &[PlotPoint]) -> String {
    let mut path = String::new();
    for stretch in points.split(Option::is_none) {
        let stretch: Vec<_> =
            stretch.iter().flatten().copied().map(|(x, y)| hundredths(x, y)).collect();
        for (i, &point) in stretch.iter().enumerate() {
            let inside = 0 < i
                && i + 1 < stretch.len()
                && stretch[i - 1][1] == point[1]
                && stretch[i + 1][1] == point[1];
            if !inside {
                push(&mut path, if i == 0 { 'M' } else { 'L' }, point);
            }
        }
    }
    path
}

/// Points of a curve that keeps each value up to the next one.
pub fn steps(points: &[PlotPoint]) -> Vec<PlotPoint> {
    let corner = |pair: &[PlotPoint]| Some((pair.get(1)?.as_ref()?.0, pair[0]?.1));
    let windows = (0..points.len()).map(|i| &points[i..points.len().min(i + 2)]);
    windows.flat_map(|pair| [pair[0]].into_iter().chain(corner(pair).map(Some))).collect()
}

/// Dots at all points, or only at isolated points, which a line does not show.
pub fn dots(points: &[PlotPoint], all: bool) -> String {
    let mut path = String::new();
    for stretch in points.split(Option::is_none).filter(|stretch| all || stretch.len() == 1) {
        for point in stretch.iter().flatten().copied().map(|(x, y)| hundredths(x, y)) {
            push(&mut path, 'M', point);
            path.push_str("h.01");
        }
    }
    path
}

/// Mark of a status around (x, y): triangle, diamond, square, plus or cross.
pub fn mark_path(status: StepStatus, x: f64, y: f64) -> String {
    match status {
        StepStatus::Retried => format!("M{x:.2} {:.2}l4 7h-8z", y - 4.5),
        StepStatus::Fallback => format!("M{x:.2} {:.2}l4 5l-4 5l-4 -5z", y - 5.0),
        StepStatus::Substepped => format!("M{:.2} {:.2}h7v7h-7z", x - 3.5, y - 3.5),
        StepStatus::Wild => format!("M{:.2} {y:.2}h9m-4.5 -4.5v9", x - 4.5),
        _ => format!("M{:.2} {:.2}l8 8m0 -8l-8 8", x - 4.0, y - 4.0),
    }
}

#[cfg(test)]
#[path = "tests/curve.rs"]
mod tests;
