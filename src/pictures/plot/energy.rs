//! The panels of the second sheet: energy, what touches, and how exact the steps are.

use super::panel::{Marks, Panel, PanelMaker, Series, steps};
use super::scale::Kind;
use crate::pictures::Film;
use nalgebra::Vector3;
use tumble::solver::StepStatus;
use tumble::trajectory::TrajectoryRow;

/// From top to bottom.
pub const PANELS: [PanelMaker; 5] = [energies, lowest_corner, slip_speed, certificate, iterations];

/// The statuses that are marked, and their colours.
const MARKED: [(StepStatus, &str); 3] = [
    (StepStatus::Retried, "#e69f00"),
    (StepStatus::Fallback, "#8250c4"),
    (StepStatus::Failed, "#cf222e"),
];

/// Kinetic ½ m v² + ½ ωᵀ I ω, potential −m gᵀ r, and their sum.
fn energies(film: &Film) -> Panel {
    let body = film.model.body();
    let kinetic = |row: &TrajectoryRow| {
        let (v, spin) = (row.state.velocity, row.state.spin);
        0.5 * (body.mass() * v.norm_squared() + spin.dot(&(body.inertia() * spin)))
    };
    let potential = |row: &TrajectoryRow| {
        -body.mass() * film.model.parameters().gravity.dot(&row.state.position)
    };
    let rows = || film.rows.iter();
    Panel {
        id: "energy",
        symbol: ("E", ""),
        unit: "J",
        words: "energy, the potential counted from the origin",
        kind: Kind::FromZero,
        height: 200.0,
        series: vec![
            Series::new("kinetic", 0, rows().map(kinetic)),
            Series::new("potential", 1, rows().map(potential)),
            Series::new("total", 7, rows().map(|row| kinetic(row) + potential(row))),
        ],
        legend: None,
        marks: Vec::new(),
        nothing: None,
    }
}

fn lowest_corner(film: &Film) -> Panel {
    let values = (0..film.rows.len()).map(|k| film.model.lowest_height(&film.ground_state(k)));
    Panel {
        id: "height",
        symbol: ("z", "min"),
        unit: "m",
        words: "height of the lowest corner",
        kind: Kind::FromZero,
        height: 110.0,
        series: vec![Series::new("", 0, values)],
        legend: None,
        marks: Vec::new(),
        nothing: None,
    }
}

fn slip_speed(film: &Film) -> Panel {
    let values = (1..film.rows.len()).map(|k| largest_slip(film, k - 1));
    Panel {
        id: "slip",
        symbol: ("c", "max"),
        unit: "m/s",
        words: "largest slip speed of the corners that touch",
        kind: Kind::FromZero,
        height: 110.0,
        series: vec![Series::new("", 2, values)],
        legend: None,
        marks: Vec::new(),
        nothing: Some("no corner that carries a force slips in this run"),
    }
}

/// max ‖c_xy‖ over the corners that touch in the step k → k + 1: those flagged α on the
/// force's side of complementarity, h f_z/m > z⁺/h (eq. 18c). NaN if none does.
fn largest_slip(film: &Film, k: usize) -> f64 {
    let (model, row) = (&film.model, &film.rows[k]);
    if !row.active.contains(&true) {
        return f64::NAN;
    }
    let (h, mass) = (model.time_step(), model.body().mass());
    let (state, next) = (film.ground_state(k), film.ground_state(k + 1));
    let old = model.contact_positions(&state);
    let new = model.contact_positions(&next);
    let push = |force: &Vector3<f64>| model.plane().normal().dot(force);
    old.zip(new)
        .zip(row.forces().zip(&row.active))
        .filter(|((_, new), (force, active))| **active && h * push(force) / mass > new[2] / h)
        .map(|((old, new), _)| (new - old).xy().norm() / h)
        .fold(f64::NAN, f64::max)
}

fn certificate(film: &Film) -> Panel {
    let values = steps(film).iter().map(|row| row.certificate);
    let marks = |(status, colour): (StepStatus, &'static str)| {
        let value = |row: &TrajectoryRow| {
            if row.status == status { row.certificate } else { f64::NAN }
        };
        Marks { status, colour, values: steps(film).iter().map(value).collect() }
    };
    let is_there = |marks: &Marks| marks.values.iter().any(|value| !value.is_nan());
    Panel {
        id: "certificate",
        symbol: ("certificate", ""),
        unit: "m/s",
        words: "distance of each step from an exact solution",
        kind: Kind::Log,
        height: 190.0,
        series: vec![Series::new("", 0, values)],
        legend: None,
        marks: MARKED.into_iter().map(marks).filter(is_there).collect(),
        nothing: Some("0 in every step"),
    }
}

fn iterations(film: &Film) -> Panel {
    let values = steps(film).iter().map(|row| f64::from(row.iterations));
    Panel {
        id: "iterations",
        symbol: ("iterations", ""),
        unit: "",
        words: "of the solver in each step",
        kind: Kind::FromZero,
        height: 110.0,
        series: vec![Series::new("", 7, values)],
        legend: None,
        marks: Vec::new(),
        nothing: Some(if steps(film).iter().all(|row| row.status == StepStatus::Free) {
            "no contact problem was solved in this run"
        } else {
            "0 in every step"
        }),
    }
}
