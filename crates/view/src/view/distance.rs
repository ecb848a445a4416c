//! Distance between two runs.

use super::curves::{self, Plot};
use crate::film::Film;
use crate::plot::{Panel, PlotSeries, ScaleKind};
use nalgebra::Vector3;
use tumble_scene::output::tables::IntervalRows;

/// Plot of ‖r_A − r_B‖, the largest over all bodies, for the common duration of both runs. It has
/// the rows of the run with the smaller time step, with the other run interpolated.
pub fn plot(a: &Film, b: &Film) -> Plot {
    let finer = usize::from(b.frame_time() < a.frame_time());
    let values = if finer == 0 { distances(a, b) } else { distances(b, a) };
    let words = if a.bodies.len().min(b.bodies.len()) > 1 {
        "largest distance between the centres of mass of one body"
    } else {
        "distance between the centres of mass"
    };
    let mut panels = vec![panel(values, words)];
    if finer == 1 {
        // A curve belongs to the run whose rows it uses.
        panels.insert(0, panel(Vec::new(), words));
        panels[0].series.clear();
    }
    curves::plot(panels, true, curves::COLUMNS)
}

fn panel(values: Vec<f64>, words: &'static str) -> Panel {
    Panel {
        id: "distance",
        symbol: ("‖r_A − r_B‖", ""),
        unit: "m",
        words,
        kind: ScaleKind::Log,
        height: 190.0,
        series: vec![PlotSeries::new("", 7, values.into_iter())],
        nothing: Some("0 at all times"),
        ..Panel::default()
    }
}

fn distances(fine: &Film, coarse: &Film) -> Vec<f64> {
    let ratio = fine.frame_time() / coarse.frame_time();
    let frames = fine.frames.iter().enumerate();
    let distance = |(i, frame): (usize, &IntervalRows)| {
        let others = positions_at(coarse, i as f64 * ratio)?;
        let apart = frame.states.iter().zip(others).map(|(state, other)| state.position - other);
        Some(apart.map(|apart| apart.norm()).fold(0.0, f64::max))
    };
    frames.map_while(distance).collect()
}

/// Linear interpolation of positions between two rows. `None` after the last row.
fn positions_at(film: &Film, place: f64) -> Option<Vec<Vector3<f64>>> {
    // Equal times may differ by rounding.
    let nearest = place.round();
    let place = if (place - nearest).abs() < 1e-6 { nearest } else { place };
    let share = place.fract();
    let before = film.frames.get(place as usize)?;
    let after = if share == 0.0 { before } else { film.frames.get(place as usize + 1)? };
    let pairs = before.states.iter().zip(&after.states);
    Some(pairs.map(|(before, after)| before.position.lerp(&after.position, share)).collect())
}
