//! Start points of Ipopt in the program's units, and steps' solutions from its end points.

use super::BODY;
use super::posed::{PosedContacts, gap};
use super::program::IpoptProgram;
use super::units::ProgramUnits;
use crate::step_nlp::point::{Products, products};
use crate::step_nlp::{ProgramPoint, SMOOTHING};
use nalgebra::Vector3;
use tumble_core::contact::{Contact, KeyIndex};
use tumble_core::mechanics::State;
use tumble_core::step::{ContactForce, Step, StepSolution};
use tumble_core::world::World;

/// Sets X of step k, and the contact values of the last solution. `known` is that solution as a
/// point.
pub(super) fn set_previous(
    x: &mut ProgramPoint,
    step: &Step<'_>,
    candidates: &[Contact],
    known: Option<&[f64]>,
    units: &ProgramUnits,
) {
    match known {
        Some(known) => x.as_mut_slice().copy_from_slice(known),
        None => x.as_mut_slice().fill(0.0),
    }
    x.set_state(&units.state(&step.states[BODY]));
    let before = &step.previous.contacts;
    let mut index = KeyIndex::new();
    for (place, contact) in candidates.iter().enumerate() {
        match index.place(before, &contact.key, place) {
            Some(_) if known.is_some() => {}
            Some(at) => set_contact(x, contact, &before[at], contact.gap, units),
            None => x.set_contact(contact.key.point, &Vector3::zeros(), &Products::default()),
        }
    }
}

/// Moves the state from step k by one step at its own velocities. A steadily sliding body is then
/// at its solution.
pub(super) fn coast(x: &mut ProgramPoint, world: &World) {
    x.set_state(&world.step_map().coasted(&x.state()));
}

pub(super) fn set_solution(
    x: &mut ProgramPoint,
    candidates: &[Contact],
    solution: &StepSolution,
    units: &ProgramUnits,
) {
    let next = &solution.states[BODY];
    x.set_free(&units.state(next));
    for (contact, force) in candidates.iter().zip(&solution.contacts) {
        set_contact(x, contact, force, gap(contact, next), units);
    }
}

/// Sets the state `free` with the weight of the body of `world` shared by the `posed` contacts.
/// State and world are in the program's units.
pub(super) fn share_weight(
    x: &mut ProgramPoint,
    free: &State,
    world: &World,
    candidates: &[Contact],
    posed: &PosedContacts,
) {
    x.set_free(free);
    let weight = world.bodies()[BODY].mass() * world.gravity().norm();
    let share = Vector3::new(0.0, 0.0, weight / posed.indices().len() as f64);
    for &index in posed.indices() {
        x.set_contact(candidates[index].key.point, &share, &Products::default());
    }
}

/// Writes the point `x` of `program` to `solution`, for the tutorial's program with its variables.
pub(super) fn write(
    x: &ProgramPoint,
    step: &Step<'_>,
    candidates: &[Contact],
    program: &IpoptProgram,
    solution: &mut StepSolution,
) {
    let next = program.next_state(step, x);
    solution.set_free(&[next]);
    if program.is_tutorials() {
        solution.variables.extend_from_slice(x.as_slice());
    }
    let from = step.states[BODY].pose();
    let to = next.pose();
    let map = step.world.step_map();
    solution.contacts.extend(candidates.iter().map(|contact| {
        let force = x.force(contact.key.point) * program.units.force();
        let normal = contact.normal();
        let u = contact.motion([&from, &to], None, &map);
        ContactForce {
            adhesion: 0.0,
            key: contact.key,
            force: contact.frame * force,
            normal_force: force[2],
            slip: u - normal * normal.dot(&u),
        }
    }));
}

/// Sets the values of a contact with `force` and the end gap `gap` (m). A force on Coulomb's cone is
/// moved to the smoothed cone of the program (eq. 13), where row (15) has no slack:
///
/// ```text
/// ‖f_xy‖_ε = μ f_z  ⇒  |f_xy|² = (μ f_z + ε)² − ε²
/// ```
///
/// The row would otherwise be violated by λ ε, which is large for a small force on a fast contact.
fn set_contact(
    x: &mut ProgramPoint,
    contact: &Contact,
    force: &ContactForce,
    gap: f64,
    units: &ProgramUnits,
) {
    let mut local = contact.frame.tr_mul(&force.force) / units.force();
    let cone = contact.law.friction * local[2];
    let tangential = local.xy().norm();
    if tangential > 0.0 && tangential >= cone * (1.0 - 1e-12) {
        let smoothed = (cone * (cone + 2.0 * SMOOTHING)).max(0.0).sqrt();
        (local[0], local[1]) = (local[0] * smoothed / tangential, local[1] * smoothed / tangential);
    }
    let slip = force.slip.norm() / units.speed();
    let gap = gap / units.length();
    let products = products(&local, slip, gap, contact.law.friction, SMOOTHING);
    x.set_contact(contact.key.point, &local, &products);
}
