//! Panels of the energy sheet: energy, height and accuracy of the steps.

use super::panel::{Marks, Panel, PanelMaker, PlotSeries};
use super::scale::ScaleKind;
use crate::film::Film;
use tumble_core::step::StepStatus;
use tumble_scene::output::tables::IntervalRows;

/// Panels of all bodies together, from top to bottom.
pub const PANELS: [PanelMaker; 4] = [
    |film, _| energies(film),
    |film, _| lowest_point(film),
    |film, _| residual(film),
    |film, _| iterations(film),
];

/// Statuses with marks, and their colours.
const MARKED: [(StepStatus, &str); 5] = [
    (StepStatus::Retried, "#5a6675"),
    (StepStatus::Fallback, "#8250c4"),
    (StepStatus::Substepped, "#96650a"),
    (StepStatus::Wild, "#b4377f"),
    (StepStatus::Failed, "#cf222e"),
];

/// Kinetic, potential and total energy of all bodies. The potential energy is zero at the start, so
/// that its constant part does not flatten the curves.
fn energies(film: &Film) -> Panel {
    let frames = || film.frames.iter();
    let start = film.frames.first().map_or(0.0, |frame| film.potential(frame));
    let potential = move |frame: &IntervalRows| film.potential(frame) - start;
    Panel {
        id: "energy",
        symbol: ("E", ""),
        unit: "J",
        words: "energy of all bodies, potential relative to the start",
        kind: ScaleKind::FromZero,
        height: 200.0,
        series: vec![
            PlotSeries::new("kinetic", 0, frames().map(|frame| film.kinetic(frame))),
            PlotSeries::new("potential", 1, frames().map(potential)),
            PlotSeries::new(
                "total",
                7,
                frames().map(move |frame| film.kinetic(frame) + potential(frame)),
            ),
        ],
        ..Panel::default()
    }
}

fn lowest_point(film: &Film) -> Panel {
    let values = film.frames.iter().map(|frame| {
        let heights = (0..film.bodies.len()).map(|b| film.lowest_height(b, frame));
        heights.fold(f64::INFINITY, f64::min)
    });
    let title = (("z", "min"), "m", "height of the lowest point");
    Panel::from_curve("height", title, 110.0, 0, values)
}

fn residual(film: &Film) -> Panel {
    let values = film.steps().iter().map(|frame| frame.row.residual);
    let marks = |(status, colour): (StepStatus, &'static str)| {
        let value = |frame: &IntervalRows| {
            if frame.row.status == status { frame.row.residual } else { f64::NAN }
        };
        Marks { status, colour, values: film.steps().iter().map(value).collect() }
    };
    let is_there = |marks: &Marks| marks.values.iter().any(|value| !value.is_nan());
    let title = (("residual", ""), "m/s", "violation of the exact laws in each step");
    Panel {
        kind: ScaleKind::Log,
        marks: MARKED.into_iter().map(marks).filter(is_there).collect(),
        nothing: Some("0 in every step"),
        ..Panel::from_curve("residual", title, 190.0, 0, values)
    }
}

fn iterations(film: &Film) -> Panel {
    let values = film.steps().iter().map(|frame| f64::from(frame.row.iterations));
    let title = (("iterations", ""), "", "of the solver in each step");
    Panel {
        kind: ScaleKind::Count,
        nothing: Some(if film.steps().iter().all(|frame| frame.row.status == StepStatus::Free) {
            "no contact problem was solved in this run"
        } else {
            "0 in every step"
        }),
        ..Panel::from_curve("iterations", title, 110.0, 7, values)
    }
}
