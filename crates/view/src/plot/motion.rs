//! Panels of the motion sheet: position, speed and contact forces of a body.

use super::panel::{Panel, PanelMaker};
use super::scale::ScaleKind;
use crate::film::{Film, is_of};
use nalgebra::Vector3;
use tumble_scene::output::tables::{ContactRow, TableStep};

/// Panels of a body, from top to bottom.
pub const PANELS: [PanelMaker; 6] = [
    |film, body| position(film, body, 0, "x"),
    |film, body| position(film, body, 1, "y"),
    |film, body| position(film, body, 2, "z"),
    speed,
    force,
    contacts,
];

fn speed(film: &Film, body: usize) -> Panel {
    let values = film.frames.iter().map(|frame| frame.instant_states()[body].velocity.norm());
    let title = (("|v|", ""), "m/s", "speed of the centre of mass");
    Panel::from_curve("speed", title, 100.0, 2, values)
}

/// Force of a contact on one of its bodies (N).
fn force_on(contact: &ContactRow, body: usize) -> Vector3<f64> {
    if contact.body == body { contact.force } else { -contact.force }
}

/// Sum of the contact forces on the body, from ground, fixed objects and other bodies.
fn force(film: &Film, body: usize) -> Panel {
    let sum = |step: &TableStep| {
        let contacts = step.contacts.iter().filter(|contact| is_of(contact, body));
        contacts.map(|contact| force_on(contact, body)).sum::<Vector3<f64>>().norm()
    };
    let title = (("|F|", ""), "N", "sum of all contact forces on the body");
    Panel {
        kind: ScaleKind::Spikes,
        nothing: Some("no contact force on this body"),
        ..Panel::from_curve("force", title, 170.0, 5, film.steps().iter().map(sum))
    }
}

fn contacts(film: &Film, body: usize) -> Panel {
    let is_own = |contact: &&ContactRow| is_of(contact, body);
    let count = |step: &TableStep| step.contacts.iter().filter(is_own).count() as f64;
    let title = (("contacts", ""), "", "of the body that carry a force");
    Panel {
        kind: ScaleKind::Count,
        nothing: Some("no contact of this body"),
        ..Panel::from_curve("contacts", title, 84.0, 7, film.steps().iter().map(count))
    }
}

fn position(film: &Film, body: usize, axis: usize, id: &'static str) -> Panel {
    let values = film.frames.iter().map(|frame| frame.states[body].position[axis]);
    let title = ((id, ""), "m", "centre of mass");
    Panel { kind: ScaleKind::Linear, ..Panel::from_curve(id, title, 84.0, 0, values) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::{contact, copies, falling_cube};
    use tumble_core::contact::Partner;

    /// Two stacked cubes. By the third law the net contact force on the lower one is the ground
    /// force minus the weight m g of the upper one.
    #[test]
    fn the_force_on_a_body_is_the_sum_from_both_sides() {
        let mut film = falling_cube(3);
        copies(&mut film, 2);
        let weight = film.world.bodies()[0].mass() * film.world.gravity().norm();
        let contact = |body, partner, size: f64, key| {
            contact(body, partner, key, Vector3::zeros(), Vector3::z() * size)
        };
        for frame in &mut film.frames {
            frame.contacts = vec![
                contact(0, Partner::Ground, 2.0 * weight, 0),
                contact(1, Partner::Body(0), 0.25 * weight, 0),
                contact(1, Partner::Body(0), 0.75 * weight, 1),
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
            (contact.body, contact.partner) = (0, Partner::Body(1));
            contact.force = -contact.force;
        }
        assert!((force(&film, 0).series[0].values[0] - weight).abs() < 1e-12 * weight);
    }
}
