//! Modes of contacts in a step: open, stick, slip.

use tumble_core::contact::{Contact, ContactKey};
use tumble_core::simulation::{Interval, StepRecord};
use tumble_core::world::World;

/// The part of the contact law that a contact is on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Mode {
    /// No force.
    Open,
    /// A normal force without slip.
    Stick,
    /// A normal force with slip.
    Slip,
}

impl Mode {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Stick => "stick",
            Self::Slip => "slip",
        }
    }
}

/// Mode of a contact in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactMode {
    /// Key of the contact.
    pub key: ContactKey,
    /// Mode of the contact.
    pub mode: Mode,
    /// Distance from the nearest other mode, m/s: half the difference of the two sides of (P7).
    pub margin: f64,
}

/// Modes of the contacts of a step in its first interval, in the order of the record. A plan's step has
/// one; another is not solved as one problem.
///
/// The impulse p is divided by the mass of body A. The motion of the contact point u has the normal
/// part φ⁺/h. The response of the contact is w:
///
/// ```text
/// open if w_n p_n ≤ u_n;  otherwise stick if |u_t| ≤ w_t (μ p_n − |p_t|);  otherwise slip       (P7)
/// ```
pub fn modes_of(world: &World, record: &StepRecord) -> Vec<ContactMode> {
    let taken = record.first();
    let pairs = taken.contacts.iter().zip(&taken.solution.contacts);
    pairs
        .map(|(contact, force)| {
            let (mode, margin) = mode_of(world, taken, contact, &force.force);
            ContactMode { key: contact.key, mode, margin }
        })
        .collect()
}

fn mode_of(
    world: &World,
    taken: &Interval,
    contact: &Contact,
    force: &nalgebra::Vector3<f64>,
) -> (Mode, f64) {
    let (h, normal) = (world.time_step(), contact.normal());
    let mass = world.bodies()[contact.key.body].mass();
    let impulse = force * (h / mass);
    let poses = |body: usize| (taken.states[body].pose(), taken.solution.states[body].pose());
    let a = poses(contact.key.body);
    let b = contact.key.partner.body().map(poses);
    let u = contact.motion([&a.0, &a.1], b.as_ref().map(|b| [&b.0, &b.1]), &world.step_map());
    let gap_speed = normal.dot(&u);
    let pressing = normal.dot(&impulse);
    let opening = gap_speed - contact.response.normal * pressing;
    if opening >= 0.0 {
        return (Mode::Open, 0.5 * opening);
    }
    let slip = contact.slip(world, &taken.states, &taken.solution.states).norm();
    let pull = (impulse - normal * pressing).norm();
    let room = contact.response.tangential * (contact.law.friction * pressing - pull);
    let mode = if slip <= room { Mode::Stick } else { Mode::Slip };
    (mode, 0.5 * (slip - room).abs().min(-opening))
}
