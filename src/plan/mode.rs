//! What contacts do in a step: open, sticking, slipping.

use super::axis::AxisMode;
use crate::contact::{Contact, ContactKey};
use crate::simulation::StepRecord;
use crate::world::World;

/// On which piece of its law a contact is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Mode {
    /// No force.
    Open,
    /// It presses and does not slip.
    Stick,
    /// It presses and slips.
    Slip,
}

impl Mode {
    /// The word of files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Open => "open",
            Self::Stick => "stick",
            Self::Slip => "slip",
        }
    }
}

/// A contact of a step with its mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactMode {
    /// Which features touch.
    pub key: ContactKey,
    /// What it does.
    pub mode: Mode,
    /// How far the law is from the next mode, m/s: half of what is between the two numbers that decide.
    pub margin: f64,
}

/// What contacts and the axes of joints do in every step of a run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Modes {
    /// The modes of the contacts of each step.
    pub contacts: Vec<Vec<ContactMode>>,
    /// The modes of the drives of joints in each step.
    pub axes: Vec<Vec<AxisMode>>,
}

impl Modes {
    /// In how many steps the contacts that press, or the parts of drives, do other than in another run.
    #[must_use]
    pub fn others(&self, other: &Self) -> usize {
        let pressing = |modes: &[ContactMode]| {
            let pressing = modes.iter().filter(|of| of.mode != Mode::Open);
            let mut pressing: Vec<_> = pressing.map(|of| (of.key, of.mode)).collect();
            pressing.sort_unstable();
            pressing
        };
        let sides = |modes: &[AxisMode]| {
            modes.iter().map(|of| (of.joint, of.axis, of.part, of.side)).collect::<Vec<_>>()
        };
        let contacts = self.contacts.iter().zip(&other.contacts);
        let axes = self.axes.iter().zip(&other.axes);
        let differs = contacts.zip(axes).filter(|((own, other), (axes, others))| {
            pressing(own) != pressing(other) || sides(axes) != sides(others)
        });
        differs.count()
    }
}

/// The modes of the contacts of a step, in their order. With the impulse p over the mass of A, the motion u of the touching
/// point (normal part φ⁺/h), and the contact's response w, all as speeds:
///
/// ```text
/// open where w_n p_n ≤ u_n;  else stick where |u_t| ≤ w_t (μ p_n − |p_t|);  else slip       (P9)
/// ```
#[must_use]
pub fn modes_of(world: &World, record: &StepRecord) -> Vec<ContactMode> {
    let pairs = record.contacts.iter().zip(&record.solution.contacts);
    pairs
        .map(|(contact, force)| {
            let (mode, margin) = mode_of(world, record, contact, &force.force);
            ContactMode { key: contact.key, mode, margin }
        })
        .collect()
}

fn mode_of(
    world: &World,
    record: &StepRecord,
    contact: &Contact,
    force: &nalgebra::Vector3<f64>,
) -> (Mode, f64) {
    let (h, normal) = (world.time_step(), contact.normal());
    let mass = world.bodies()[contact.key.body].mass();
    let impulse = force * (h / mass);
    let poses = |body: usize| (record.states[body].pose(), record.solution.states[body].pose());
    let a = poses(contact.key.body);
    let b = contact.key.partner.body().map(poses);
    let u = contact.motion((&a.0, &a.1), b.as_ref().map(|b| (&b.0, &b.1)), h);
    let gap_speed = normal.dot(&u);
    let pressing = normal.dot(&impulse);
    let opening = gap_speed - contact.response.normal * pressing;
    if opening >= 0.0 {
        return (Mode::Open, 0.5 * opening);
    }
    let slip = contact.slip(world, &record.states, &record.solution.states).norm();
    let pull = (impulse - normal * pressing).norm();
    let room = contact.response.tangential * (contact.law.friction * pressing - pull);
    let mode = if slip <= room { Mode::Stick } else { Mode::Slip };
    (mode, 0.5 * (slip - room).abs().min(-opening))
}
