//! Adhesion: suction cups, magnets, glue. The points of a pair that touch at the start of an interval share a
//! pull of at most F (N).
//!
//! With n touching points of the pair, each has the share a = κ F/n, with κ of (37). The law of hard contact
//! with friction holds for the pressing force, which is the force f beyond the whole pull:
//!
//! ```text
//! f̃ = f + a n,   0 ≤ f̃_n ⊥ φ⁺ ≥ 0,   |f̃_t| ≤ μ f̃_n                           (eq. 48)
//! ```
//!
//! A point that opens has f̃ = 0, and its pull acts until the end of the interval. It does not touch at the
//! start of the next one: a broken bond needs no memory. Equation numbers refer to `docs/formulation.md`.

use super::Contact;
use crate::world::{Coefficient, World, ordered};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Gap up to which points touch, over the reach of the smaller body. Solved steps leave gaps of 1e-12 m.
const TOUCHING: f64 = 1e-8;

impl Contact {
    /// f̃ (eq. 48) of the `force` on A (N, world).
    #[inline]
    pub fn pressing_force(&self, world: &World, force: &Vector3<f64>) -> Vector3<f64> {
        force + self.normal() * self.adhesion(world)
    }

    /// a: share of the adhesion (N).
    pub fn adhesion(&self, world: &World) -> f64 {
        self.law.adhesion * world.bodies()[self.key.body].mass() / world.time_step()
    }

    /// Gap at the start of the interval beyond the largest one that touches (m).
    fn gap_beyond_touching(&self, world: &World) -> f64 {
        let reaches = self.key.bodies().map(|body| world.bodies()[body].reach());
        let largest = TOUCHING * reaches.fold(f64::INFINITY, f64::min);
        self.gap + self.held_gap - largest.max(world.touching_gap())
    }

    /// Largest pull F of the pair (N).
    fn largest_pull(&self, world: &World) -> f64 {
        let pull = world.larger_between(Coefficient::Adhesion, self.key.body, self.key.partner);
        pull.map_or(0.0, |(_, pull)| pull)
    }

    /// Distance over h from a start at which it does or does not touch, which changes its adhesion (m/s).
    pub(crate) fn adhesion_margin(&self, world: &World) -> f64 {
        match self.largest_pull(world) {
            0.0 => f64::INFINITY,
            _ => self.gap_beyond_touching(world).abs() / world.time_step(),
        }
    }
}

/// Sets the shares of all `contacts` of an interval of `world` in the adhesion of their pairs.
pub fn share_adhesion(world: &World, contacts: &mut [Contact]) {
    if !world.has_adhesion() {
        return;
    }
    let pair = |contact: &Contact| ordered(contact.key.body, contact.key.partner);
    let touches = |contact: &Contact| contact.gap_beyond_touching(world) <= 0.0;
    let mut points = BTreeMap::<_, f64>::new();
    for contact in contacts.iter().filter(|contact| touches(contact)) {
        *points.entry(pair(contact)).or_default() += 1.0;
    }
    for contact in contacts {
        let kicks = contact.key.bodies().map(|body| world.kick(body));
        let share = contact.largest_pull(world) * kicks.fold(f64::INFINITY, f64::min);
        let to_impulse = world.time_step() / world.bodies()[contact.key.body].mass();
        contact.law.adhesion =
            if touches(contact) { share / points[&pair(contact)] * to_impulse } else { 0.0 };
    }
}
