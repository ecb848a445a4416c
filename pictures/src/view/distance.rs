//! How far two runs are from each other.

use super::curves::{self, Plot};
use crate::film::{Film, Frame};
use crate::plot::{Kind, Panel, Series};
use nalgebra::Vector3;

/// The plot of ‖r_A − r_B‖ as long as both runs last, at the rows of the run with the
/// smaller time step, the other one interpolated.
pub fn plot(a: &Film, b: &Film) -> Plot {
    let finer = usize::from(b.time_step < a.time_step);
    let values = if finer == 0 { distances(a, b) } else { distances(b, a) };
    let mut panels = vec![panel(values)];
    if finer == 1 {
        // A curve belongs to the run whose rows it counts.
        panels.insert(0, panel(Vec::new()));
        panels[0].series.clear();
    }
    curves::plot(panels.into_iter(), true)
}

fn panel(values: Vec<f64>) -> Panel {
    Panel {
        id: "distance",
        symbol: ("‖r_A − r_B‖", ""),
        unit: "m",
        words: "distance between the centres of mass",
        kind: Kind::Log,
        height: 190.0,
        series: vec![Series::new("", 7, values.into_iter())],
        nothing: Some("0 at all times"),
        ..Panel::default()
    }
}

fn distances(fine: &Film, coarse: &Film) -> Vec<f64> {
    let ratio = fine.time_step / coarse.time_step;
    let frames = fine.frames.iter().enumerate();
    let distance = |(i, frame): (usize, &Frame)| {
        position_at(coarse, i as f64 * ratio).map(|other| (frame.pose().position - other).norm())
    };
    frames.map_while(distance).collect()
}

/// Between two rows, on the line between their positions; `None` after the last.
fn position_at(film: &Film, place: f64) -> Option<Vector3<f64>> {
    // Times that are equal may differ in their last digits.
    let nearest = place.round();
    let place = if (place - nearest).abs() < 1e-6 { nearest } else { place };
    let position = |i: usize| film.frames.get(i).map(|frame| frame.pose().position);
    let share = place.fract();
    let before = position(place as usize)?;
    if share == 0.0 {
        return Some(before);
    }
    position(place as usize + 1).map(|after| before.lerp(&after, share))
}
