//! Unit tests of `motion.rs`.

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
        ]
        .into();
    }
    for body in 0..2 {
        let panel = force(&film, body);
        assert_eq!(panel.series[0].values.len(), 3);
        assert!(panel.series[0].values.iter().all(|f| (f - weight).abs() < 1e-12 * weight));
    }
    let counts = [0, 1].map(|body| contacts(&film, body).series[0].values[0]);
    assert_eq!(counts, [3.0, 2.0]);
    // Same result with swapped partners.
    for contact in film
        .frames
        .iter_mut()
        .flat_map(|frame| &mut std::sync::Arc::make_mut(&mut frame.contacts)[1..])
    {
        (contact.body, contact.partner) = (0, Partner::Body(1));
        contact.force = -contact.force;
    }
    assert!((force(&film, 0).series[0].values[0] - weight).abs() < 1e-12 * weight);
}
