//! Whole steps from the rows of their intervals.

use super::{ContactRow, GearTableRow, IntervalRows, JointRow};
use nalgebra::Vector3;
use std::borrow::Cow;
use std::sync::Arc;
use tumble_core::joint::Joint;
use tumble_core::simulation::{StepRecord, acting_times};
use tumble_core::step::StepStatus;
use tumble_core::world::World;

/// Rows of whole steps of `world`, from the `rows` of all their intervals.
///
/// - At the start of the step: states, coordinates, energy.
/// - Means over it: forces, rates, slips.
/// - Sums: works, errors, iterations.
/// - Largest values: residuals, overlap, placement, stiffness, status.
pub fn whole_steps<'a>(world: &World, rows: &'a [IntervalRows]) -> Cow<'a, [IntervalRows]> {
    if rows.iter().all(|rows| rows.row.interval == 0) {
        return Cow::Borrowed(rows);
    }
    let is_same_step = |a: &IntervalRows, b: &IntervalRows| a.row.index == b.row.index;
    Cow::Owned(rows.chunk_by(is_same_step).filter_map(|rows| whole_step(world, rows)).collect())
}

/// Rows of a whole step of `world` from those of its intervals.
fn whole_step(world: &World, intervals: &[IntervalRows]) -> Option<IntervalRows> {
    let [first, later @ ..] = intervals else { return None };
    if later.is_empty() {
        return Some(first.clone());
    }
    let length: f64 = intervals.iter().map(|rows| rows.row.length).sum();
    let lengths = intervals.iter().map(|rows| (&rows.before[..], rows.row.length));
    let acting = acting_times(first.states.len(), lengths);
    let scaled = |rows: &IntervalRows| {
        let share = |body: usize, other: Option<usize>| {
            let acting = |body: usize| acting.get(body).copied().unwrap_or(f64::INFINITY);
            let acting = other.map_or(f64::INFINITY, acting).min(acting(body));
            let own = rows.row.length;
            TableShares { time: own / length, forces: rows.kick(body, other) * own / acting }
        };
        let mut scaled = rows.clone();
        scaled.scale(world, share);
        scaled
    };
    let mut whole = scaled(first);
    for rows in later {
        whole.add(scaled(rows));
    }
    let last = &intervals[intervals.len() - 1];
    whole.ends.clone_from(&last.ends);
    whole.row.length = length;
    whole.idle.clear();
    whole.row.contacts = whole.contacts.len();
    // Numbers do not depend on contacts without a force, which tables may lack.
    let contacts = Arc::make_mut(&mut whole.contacts);
    contacts.sort_by_key(|contact| contact.force == Vector3::zeros());
    for (number, contact) in contacts.iter_mut().enumerate() {
        (contact.index, contact.interval, contact.length) = (number, 0, length);
    }
    Some(whole)
}

/// Shares of an interval in its step: of its length, and of the time over which forces act.
#[derive(Debug, Clone, Copy)]
struct TableShares {
    time: f64,
    forces: f64,
}

/// Adds the mean force and slip of a contact to the same one of `contacts`, or appends it. Contacts have the order
/// and the places of their first forces, whether or not the tables have rows without a force.
fn add_contact(contacts: &mut Vec<ContactRow>, contact: ContactRow) {
    let is_same = |known: &ContactRow| {
        (known.body, known.partner, &known.key) == (contact.body, contact.partner, &contact.key)
    };
    let Some(place) = contacts.iter().position(is_same) else {
        contacts.push(contact);
        return;
    };
    let known = &mut contacts[place];
    if known.force == Vector3::zeros() && contact.force != Vector3::zeros() {
        contacts.remove(place);
        contacts.push(contact);
        return;
    }
    known.force += contact.force;
    known.moment += contact.moment;
    known.slip += contact.slip;
}

impl ContactRow {
    /// Contacts of a step of several intervals, with means of forces and slips over the step.
    pub fn from_divided_step(record: &StepRecord) -> Vec<Self> {
        let mut contacts = Vec::new();
        for (share, interval) in record.shares() {
            for mut contact in Self::from_interval(interval) {
                let body = contact.body;
                let other = contact.partner.body();
                let kick = interval.kick(body, other);
                let forces = share.forces(body, other) * kick;
                contact.scale(TableShares { time: share.time(), forces });
                add_contact(&mut contacts, contact);
            }
        }
        contacts
    }

    /// Scales by the `share` of an interval. Tables may lack contacts without a force, so that their slip
    /// does not count.
    fn scale(&mut self, share: TableShares) {
        let acts = self.force != Vector3::zeros();
        self.force *= share.forces;
        self.moment *= share.forces;
        self.slip *= if acts { share.time } else { 0.0 };
    }
}

impl IntervalRows {
    /// Scales forces, rates and slips of `world` by the `share` of this interval in the step for a body and
    /// another one.
    fn scale(&mut self, world: &World, share: impl Fn(usize, Option<usize>) -> TableShares) {
        for contact in Arc::make_mut(&mut self.contacts) {
            contact.scale(share(contact.body, contact.partner.body()));
        }
        let of_joint = |joint: &Joint| share(joint.body(), joint.other());
        for (row, joint) in self.joints.iter_mut().zip(world.joints()) {
            let JointRow { velocity, spin, force, torque, .. } = row;
            let share = of_joint(joint);
            [velocity, spin].into_iter().for_each(|vector| *vector *= share.time);
            [force, torque].into_iter().for_each(|vector| *vector *= share.forces);
        }
        for (row, gear) in self.gears.iter_mut().zip(world.gears()) {
            row.force *= of_joint(&world.joints()[gear.axes()[0].joint]).forces;
        }
    }

    /// Adds a later interval of the step, which is scaled.
    fn add(&mut self, later: Self) {
        let (row, more) = (&mut self.row, &later.row);
        let larger = |most: &mut f64, number: f64| {
            if number.is_nan() || number > *most {
                *most = number;
            }
        };
        row.status = row.status.max(more.status);
        row.iterations = row.iterations.saturating_add(more.iterations);
        larger(&mut row.residual, more.residual);
        row.parts.iter_mut().zip(more.parts).for_each(|(most, part)| larger(most, part));
        larger(&mut row.overlap, more.overlap);
        larger(&mut row.placement, more.placement);
        larger(&mut row.stiffness, more.stiffness);
        row.restitution_share = row.restitution_share.min(more.restitution_share);
        row.works.iter_mut().zip(more.works).for_each(|(sum, work)| *sum += work);
        row.error += more.error;
        let contacts = Arc::make_mut(&mut self.contacts);
        later.contacts.iter().for_each(|contact| add_contact(contacts, contact.clone()));
        for (joint, more) in self.joints.iter_mut().zip(&later.joints) {
            joint.velocity += more.velocity;
            joint.spin += more.spin;
            joint.force += more.force;
            joint.torque += more.torque;
            larger(&mut joint.residual.locked, more.residual.locked);
            larger(&mut joint.residual.drive, more.residual.drive);
        }
        for (gear, GearTableRow { force, residual, .. }) in self.gears.iter_mut().zip(&later.gears)
        {
            gear.force += force;
            larger(&mut gear.residual, *residual);
        }
    }

    /// True if the row is the last one, a state without a step.
    pub fn is_end(&self) -> bool {
        self.row.status == StepStatus::End
    }
}
