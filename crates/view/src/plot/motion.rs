//! Panels of the motion sheet: position, contact forces, slacks and multipliers.

use super::panel::{AxisTitle, Panel, PanelMaker, PlotSeries};
use super::scale::ScaleKind;
use crate::film::{Film, FilmContact, FilmFrame};
use nalgebra::Vector3;

/// Panels from top to bottom.
pub const PANELS: [PanelMaker; 7] = [
    |film, body| position(film, body, 0, "x"),
    |film, body| position(film, body, 1, "y"),
    |film, body| position(film, body, 2, "z"),
    |film, _| normal_forces(film),
    |film, _| {
        let said = (("s", "1"), "N m", "complementarity slack of each corner");
        corners(film, |contact| contact.slacks[0], "s1", said)
    },
    |film, _| {
        let said = (("s", "2"), "W", "friction slack of each corner");
        corners(film, |contact| contact.slacks[1], "s2", said)
    },
    |film, _| {
        let said = (("λ", ""), "m/s", "slip-speed multiplier of each corner");
        corners(film, |contact| contact.multiplier, "lambda", said)
    },
];

/// Panels for one of several bodies, from top to bottom.
pub const PANELS_OF_SEVERAL: [PanelMaker; 6] = [
    |film, body| position(film, body, 0, "x"),
    |film, body| position(film, body, 1, "y"),
    |film, body| position(film, body, 2, "z"),
    speed,
    force,
    contacts,
];

fn speed(film: &Film, body: usize) -> Panel {
    let values = film.frames.iter().map(|frame| frame.poses[body].velocity.norm());
    let said = (("|v|", ""), "m/s", "speed of the centre of mass");
    Panel::of_curve("speed", said, 100.0, 2, values)
}

/// Sum of the contact forces on the body, from ground, fixed objects and other bodies.
fn force(film: &Film, body: usize) -> Panel {
    let sum = |step: &FilmFrame| {
        let contacts = step.contacts.iter().filter(|contact| contact.is_of(body));
        contacts.map(|contact| contact.force_on(body)).sum::<Vector3<f64>>().norm()
    };
    let said = (("|F|", ""), "N", "sum of all contact forces on the body");
    Panel {
        kind: ScaleKind::Spikes,
        nothing: Some("no contact force on this body"),
        ..Panel::of_curve("force", said, 170.0, 5, film.steps().iter().map(sum))
    }
}

fn contacts(film: &Film, body: usize) -> Panel {
    let carrying = |contact: &&FilmContact| contact.carries_force && contact.is_of(body);
    let count = |step: &FilmFrame| step.contacts.iter().filter(carrying).count() as f64;
    let said = (("contacts", ""), "", "of the body that carry a force");
    Panel {
        nothing: Some("no contact of this body"),
        ..Panel::of_curve("contacts", said, 84.0, 7, film.steps().iter().map(count))
    }
}

fn position(film: &Film, body: usize, axis: usize, id: &'static str) -> Panel {
    let values = film.frames.iter().map(|frame| frame.poses[body].position[axis]);
    let said = ((id, ""), "m", "centre of mass");
    Panel { kind: ScaleKind::Linear, ..Panel::of_curve(id, said, 84.0, 0, values) }
}

/// Normal force n · f at every corner. On horizontal ground it is f_z.
fn normal_forces(film: &Film) -> Panel {
    let symbol = ("F", if film.inclined_ground().is_some() { "n" } else { "z" });
    let normal = film.ground.map_or(Vector3::z(), |ground| ground.normal);
    let push = |contact: &FilmContact| normal.dot(&contact.force);
    Panel {
        height: 170.0,
        nothing: Some("no contact force in this run"),
        ..corners(film, push, "fz", (symbol, "N", "normal force on each corner"))
    }
}

/// Quantity at every corner of a single body in every step; 0 without contact.
fn corners(
    film: &Film,
    quantity: impl Fn(&FilmContact) -> f64,
    id: &'static str,
    (symbol, unit, words): AxisTitle,
) -> Panel {
    let (steps, count) = (film.steps(), film.bodies[0].points.len());
    let mut values = vec![vec![0.0; steps.len()]; count];
    for (k, step) in steps.iter().enumerate() {
        for contact in &step.contacts {
            if let Some(values) = contact.corner().and_then(|corner| values.get_mut(corner)) {
                values[k] = quantity(contact);
            }
        }
    }
    let series =
        |(i, values): (usize, Vec<f64>)| PlotSeries::new(i.to_string(), i, values.into_iter());
    Panel {
        id,
        symbol,
        unit,
        words,
        kind: ScaleKind::Spikes,
        height: 100.0,
        series: values.into_iter().enumerate().map(series).collect(),
        legend: Some("corner"),
        nothing: Some("0 in every step"),
        ..Panel::default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::{FilmPartner, FilmPlace};
    use crate::samples::falling_cube;

    /// Two stacked cubes. By the third law the net contact force on the lower one is the ground
    /// force minus the weight m g of the upper one.
    #[test]
    fn the_force_on_a_body_is_the_sum_from_both_sides() {
        let mut film = falling_cube(3);
        film.bodies.push(film.bodies[0].clone());
        let weight = film.bodies[0].mass * film.gravity.norm();
        let contact = |body, partner, size: f64, key| FilmContact {
            body,
            partner,
            place: FilmPlace::At { point: Vector3::zeros(), key },
            force: Vector3::z() * size,
            normal: Vector3::z(),
            friction: 0.5,
            carries_force: true,
            slacks: [0.0; 2],
            multiplier: 0.0,
        };
        for frame in &mut film.frames {
            frame.poses.push(frame.poses[0]);
            frame.contacts = vec![
                contact(0, FilmPartner::Ground, 2.0 * weight, 0),
                contact(1, FilmPartner::Body(0), 0.25 * weight, 0),
                contact(1, FilmPartner::Body(0), 0.75 * weight, 1),
            ];
        }
        for body in 0..2 {
            let panel = force(&film, body);
            assert_eq!(panel.series[0].values.len(), 3);
            assert!(panel.series[0].values.iter().all(|f| (f - weight).abs() < 1e-12 * weight));
        }
        let counts = [0, 1].map(|body| contacts(&film, body).series[0].values[0]);
        assert_eq!(counts, [3.0, 2.0]);
        // Same result with swapped partners.
        for contact in film.frames.iter_mut().flat_map(|frame| &mut frame.contacts[1..]) {
            (contact.body, contact.partner) = (0, FilmPartner::Body(1));
            contact.force = -contact.force;
        }
        assert!((force(&film, 0).series[0].values[0] - weight).abs() < 1e-12 * weight);
    }
}
