//! The panels of the first sheet: position, contact forces, slacks and multipliers.

use super::panel::{Panel, PanelMaker, Series};
use super::scale::Kind;
use crate::film::{Contact, Film};
use nalgebra::Vector3;

/// From top to bottom.
pub const PANELS: [PanelMaker; 7] = [
    |film| position(film, 0, "x"),
    |film| position(film, 1, "y"),
    |film| position(film, 2, "z"),
    normal_forces,
    |film| {
        corners(
            film,
            |contact| contact.slacks[0],
            "s1",
            ("s", "1"),
            "N m",
            "complementarity slack of each corner",
        )
    },
    |film| {
        corners(
            film,
            |contact| contact.slacks[1],
            "s2",
            ("s", "2"),
            "W",
            "friction slack of each corner",
        )
    },
    |film| {
        corners(
            film,
            |contact| contact.multiplier,
            "lambda",
            ("λ", ""),
            "m/s",
            "slip-speed multiplier of each corner",
        )
    },
];

fn position(film: &Film, axis: usize, id: &'static str) -> Panel {
    let values = film.frames.iter().map(|frame| frame.pose().position[axis]);
    Panel {
        id,
        symbol: (id, ""),
        unit: "m",
        words: "centre of mass",
        height: 84.0,
        series: vec![Series::new("", 0, values)],
        ..Panel::default()
    }
}

/// n · f of every corner, which on level ground is f_z.
fn normal_forces(film: &Film) -> Panel {
    let symbol = ("F", if film.inclined_ground().is_some() { "n" } else { "z" });
    let normal = film.ground.map_or(Vector3::z(), |ground| ground.normal);
    let push = |contact: &Contact| normal.dot(&contact.force);
    Panel {
        height: 170.0,
        nothing: Some("no contact force in this run"),
        ..corners(film, push, "fz", symbol, "N", "normal force on each corner")
    }
}

/// A quantity of every corner in every step, 0 where the corner does not touch.
fn corners(
    film: &Film,
    quantity: impl Fn(&Contact) -> f64,
    id: &'static str,
    symbol: (&'static str, &'static str),
    unit: &'static str,
    words: &'static str,
) -> Panel {
    let (steps, count) = (film.steps(), film.body().points.len());
    let mut values = vec![vec![0.0; steps.len()]; count];
    for (k, step) in steps.iter().enumerate() {
        for contact in step.touches() {
            if let Some(values) = values.get_mut(contact.point) {
                values[k] = quantity(contact);
            }
        }
    }
    let series = |(i, values): (usize, Vec<f64>)| Series::new(i.to_string(), i, values.into_iter());
    Panel {
        id,
        symbol,
        unit,
        words,
        kind: Kind::Spikes,
        height: 100.0,
        series: values.into_iter().enumerate().map(series).collect(),
        legend: Some("corner"),
        nothing: Some("0 in every step"),
        ..Panel::default()
    }
}
