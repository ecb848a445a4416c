//! Panels of the motion sheet: position, speed and contact forces of a body.

use super::panel::{Panel, PanelMaker};
use super::scale::ScaleKind;
use crate::film::{Film, is_of};
use nalgebra::Vector3;
use tumble_scene::output::tables::{ContactRow, IntervalRows};

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
    let sum = |step: &IntervalRows| {
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
    let count = |step: &IntervalRows| step.contacts.iter().filter(is_own).count() as f64;
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
#[path = "tests/motion.rs"]
mod tests;
