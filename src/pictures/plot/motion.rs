//! The panels of the first sheet: position, contact forces, slacks and multipliers.

use super::panel::{Panel, PanelMaker, Series, steps};
use super::scale::Kind;
use crate::pictures::Film;

/// From top to bottom.
pub const PANELS: [PanelMaker; 7] = [
    |film| position(film, 0, "x"),
    |film| position(film, 1, "y"),
    |film| position(film, 2, "z"),
    normal_forces,
    |film| corners(film, 3, "s1", ("s", "1"), "N m", "complementarity slack of each corner"),
    |film| corners(film, 4, "s2", ("s", "2"), "W", "friction slack of each corner"),
    |film| corners(film, 5, "lambda", ("λ", ""), "m/s", "slip-speed multiplier of each corner"),
];

fn position(film: &Film, axis: usize, id: &'static str) -> Panel {
    let values = film.rows.iter().map(|row| row.state.position[axis]);
    Panel {
        id,
        symbol: (id, ""),
        unit: "m",
        words: "centre of mass",
        kind: Kind::Linear,
        height: 84.0,
        series: vec![Series::new("", 0, values)],
        legend: None,
        marks: Vec::new(),
        nothing: None,
    }
}

/// n · f of every corner, which on level ground is f_z.
fn normal_forces(film: &Film) -> Panel {
    let symbol = ("F", if film.model.plane().is_level() { "z" } else { "n" });
    let normal = film.model.plane().normal();
    let corner = |i: usize| {
        let values = steps(film).iter().map(move |row| normal.dot(&row.force(i)));
        Series::new(i.to_string(), i, values)
    };
    Panel {
        height: 170.0,
        nothing: Some("no contact force in this run"),
        series: (0..film.model.contact_count()).map(corner).collect(),
        ..corners(film, 2, "fz", symbol, "N", "normal force on each corner")
    }
}

/// A quantity of every corner: the `part`-th of (f_x, f_y, f_z, s1, s2, λ).
fn corners(
    film: &Film,
    part: usize,
    id: &'static str,
    symbol: (&'static str, &'static str),
    unit: &'static str,
    words: &'static str,
) -> Panel {
    let n = film.model.contact_count();
    let corner = |i: usize| {
        let values = steps(film).iter().map(|row| row.step[part * n + i]);
        Series::new(i.to_string(), i, values)
    };
    Panel {
        id,
        symbol,
        unit,
        words,
        kind: Kind::Spikes,
        height: 100.0,
        series: (0..n).map(corner).collect(),
        legend: Some("corner"),
        marks: Vec::new(),
        nothing: Some("0 in every step"),
    }
}
