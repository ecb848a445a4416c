//! Conversion of the tutorial's table to the tables of several bodies.
//!
//! Its points become contacts with the ground, and a row becomes a step.

use super::tables::{ContactRow, KeyText, StepRow, TableStep};
use super::trajectory::TrajectoryRow;
use tumble_core::contact::certificate::{Certifier, Claim, certify_rk4_step};
use tumble_core::contact::detection::all_contacts;
use tumble_core::contact::restitution::set_rebounds;
use tumble_core::contact::{Contact, Detection};
use tumble_core::mechanics::{State, Wrench};
use tumble_core::simulation::energy;
use tumble_core::world::World;

impl TrajectoryRow {
    /// Contacts of all points of the body of `world` with the ground.
    ///
    /// The step leads to `next` under the external `wrench`. Bouncing contacts have their rebound
    /// speeds.
    #[must_use]
    pub fn contacts(&self, world: &World, next: &[State], wrench: &Wrench) -> Vec<Contact> {
        let (states, mut contacts) = ([self.state], Vec::new());
        all_contacts(world, &states, &mut contacts);
        if world.has_restitution() {
            let free = [world.free_flight(0, &self.state, wrench)];
            let share = [self.restitution_share];
            set_rebounds(world, &states, &free, &share, &mut contacts);
            if contacts.iter().any(Contact::bounces) {
                let pushes = contacts.iter().zip(self.forces());
                let pushed = pushes.map(|(contact, force)| contact.pushed_by(world, &force)).sum();
                for (contact, force) in contacts.iter_mut().zip(self.forces()) {
                    let presses = contact.normal().dot(&force) > 0.0;
                    let closes = contact.could_close(world, &states, next, pushed);
                    contact.struck = presses && closes && contact.may_be_struck();
                }
                set_rebounds(world, &states, &free, &share, &mut contacts);
            }
        }
        contacts
    }

    /// Step of the tables made from this row, which leads to a state under an external wrench.
    ///
    /// `step` is this state and wrench, or `None` for the last row. The residual is that of the
    /// file; its parts are recomputed. The contacts are the candidates of `detection` and all
    /// points with a nonzero number in the row. Without `detection` there are no contacts.
    #[must_use]
    pub fn as_table_step(
        &self,
        world: &World,
        step: Option<(&State, Wrench)>,
        detection: Option<Detection>,
    ) -> TableStep {
        let states = vec![self.state];
        let row = StepRow {
            index: self.index,
            time: self.time,
            status: self.status,
            iterations: self.iterations,
            start: String::new(),
            contacts: 0,
            residual: self.residual,
            parts: [0.0; 5],
            overlap: 0.0,
            placement: 0.0,
            restitution_share: self.restitution_share,
            energy: energy::total(world, &states),
            works: [0.0; 6],
            stiffness: 0.0,
        };
        let Some((next, wrench)) = step else {
            return TableStep {
                row,
                states,
                ends: Vec::new(),
                contacts: Vec::new(),
                joints: Vec::new(),
                gears: Vec::new(),
            };
        };
        let (next, wrenches) = (std::slice::from_ref(next), [wrench]);
        let (mut found, mut contacts) = (Vec::new(), Vec::new());
        if let Some(detection) = detection {
            let free = [world.free_flight(0, &self.state, &wrench)];
            detection.find(world, &states, &free, &mut found);
            contacts = self.contacts(world, next, &wrench);
        }
        let claim = Claim {
            states: &states,
            next,
            wrenches: &wrenches,
            contacts: &contacts,
            joints: &[],
            gears: &[],
        };
        let certificate = match detection {
            None => certify_rk4_step(world, &claim),
            Some(_) => Certifier::new().contact_step(world, &claim, self.forces()),
        };
        let is_one = |contact: &&Contact| {
            found.iter().any(|found| found.key == contact.key) || self.says_of(contact.key.point)
        };
        let candidates = contacts.iter().filter(is_one);
        let contacts: Vec<_> =
            candidates.map(|contact| self.contact_row(world, contact, next)).collect();
        let parts = certificate.contact_parts().map(|(_, part)| part);
        let row = StepRow { contacts: contacts.len(), parts, ..row };
        let (ends, joints, gears) = (Vec::new(), Vec::new(), Vec::new());
        TableStep { row, states, ends, contacts, joints, gears }
    }

    /// True if the row has a nonzero number for `point`.
    fn says_of(&self, point: usize) -> bool {
        let count = self.carrying.len();
        let numbers = self.step.iter().skip(point).step_by(count.max(1));
        self.carrying.get(point) == Some(&true) || numbers.into_iter().any(|n| *n != 0.0)
    }

    fn contact_row(&self, world: &World, contact: &Contact, next: &[State]) -> ContactRow {
        ContactRow {
            body: contact.key.body,
            partner: contact.key.partner,
            point: self.state.position + contact.arm,
            normal: contact.normal(),
            force: self.force(contact.key.point),
            slip: contact.slip(world, &[self.state], next),
            gap: contact.gap,
            radius: contact.features.radius,
            rebound: contact.rebound,
            key: KeyText::of(&contact.key),
        }
    }
}
