//! Contacts rebuilt from rows of tables.

use super::{JudgedStep, StepJudge};
use nalgebra::Vector3;
use std::collections::BTreeMap;
use tumble_core::contact::adhesion::share_adhesion;
use tumble_core::contact::{ContactKey, ContactLoad, InstantMotions, PairFeatures};
use tumble_core::geometry::Feature;
use tumble_core::joint::JointForce;
use tumble_core::mechanics::{State, Wrench};
use tumble_scene::output::tables::{IntervalRows, Misplaced};

impl StepJudge {
    /// Contacts and joint forces in the tables.
    pub(super) fn compare_rows<'a>(
        &self,
        step: &'a IntervalRows,
        next: &'a [State],
        following: &'a IntervalRows,
        wrenches: Vec<Wrench>,
    ) -> JudgedStep<'a> {
        let forces = step.joint_forces(&self.world);
        let joints = self.world.joints().iter().zip(forces).map(|(joint, force)| {
            let at = joint.coordinates(next);
            let unknown = Vector3::repeat(f64::NAN);
            let angles = at.map_or(unknown, |at| joint.counted(&at, &force.angles));
            JointForce { angles, ..force }
        });
        let gears =
            (0..step.gears.len()).map(|index| step.gear_force(&self.world, index)).collect();
        let (contacts, loads, joints) = (Vec::new(), Vec::new(), joints.collect());
        let mut touching = JudgedStep {
            step,
            next,
            following: &following.row,
            next_starts: following.before.contains(&0.0),
            wrenches,
            contacts,
            loads,
            joints,
            gears,
            wrong: None,
        };
        let mut planes = BTreeMap::new();
        if step.contacts.is_empty() {
            return touching;
        }
        let free = self.free_flight(&step.states, &touching.wrenches);
        let moved = self.moved(step, next, &free);
        let mut motions = InstantMotions::default();
        if self.turns_friction {
            motions.set(&step.instants, &free);
        }
        for row in &*step.contacts {
            let contact = row.contact(&self.world, &step.states).and_then(|contact| {
                row.is_there(&contact, &self.world, &step.states, moved)?;
                is_next_plane(&contact.key, &mut planes, !self.loaded_contacts)?;
                Ok(contact)
            });
            match contact {
                Ok(mut contact) => {
                    // The rows do not have the first solution, which may have held the contact.
                    if contact.may_have_friction(&self.world, &step.states, row.friction) {
                        contact.law.friction = row.friction;
                    } else {
                        let index = row.index;
                        touching.wrong.get_or_insert_with(|| {
                            format!("its contact {index} has another coefficient of friction")
                        });
                    }
                    motions.set_offsets(&self.world, &step.states, &mut contact);
                    touching.contacts.push(contact);
                }
                Err(why) => {
                    let index = row.index;
                    touching.wrong.get_or_insert_with(|| format!("its contact {index} {why}"));
                }
            }
            let kick = step.kick(row.body, row.partner.body());
            touching.loads.push(ContactLoad { force: row.force * kick, moment: row.moment * kick });
        }
        share_adhesion(&self.world, &mut touching.contacts);
        touching
    }

    /// Largest distance of a body's point during the step's contact detection, m. The point moves
    /// to its end or along free flight. The factor 2 covers bodies that are first pushed and later
    /// pushed back.
    fn moved(&self, step: &IntervalRows, next: &[State], free: &[State]) -> f64 {
        let pairs = step.states.iter().zip(next).chain(step.states.iter().zip(free));
        let pairs = pairs.zip(self.world.bodies().iter().cycle());
        let travels = pairs.map(|((from, to), body)| {
            let (from, to) = (from.pose(), to.pose());
            let turned = (to.rotation - from.rotation).norm();
            (to.position - from.position).norm() + body.reach() * turned
        });
        2.0 * travels.fold(0.0, f64::max)
    }
}

/// Checks the plane counter in a contact's key against the number of planes seen for these
/// features, unless `all` have rows their least number. Round features have no plane; their counter
/// starts at 1.
fn is_next_plane(
    key: &ContactKey,
    planes: &mut BTreeMap<ContactKey, u32>,
    all: bool,
) -> Result<(), Misplaced> {
    let Some(pair) = key.pair else { return Ok(()) };
    let features = ContactKey { pair: Some(PairFeatures { plane: 0, ..pair }), ..*key };
    let count = planes.entry(features).or_default();
    let of_round = matches!(pair.feature, Feature::Round(..)).then(|| (*count).max(1));
    let is_next = pair.plane == *count || Some(pair.plane) == of_round;
    let is_later = !all && pair.plane > *count;
    *count = if all { *count } else { pair.plane }.saturating_add(1);
    if is_next || is_later { Ok(()) } else { Err("has a wrong plane number for its features") }
}
