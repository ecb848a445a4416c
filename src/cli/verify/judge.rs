//! A step judged by the files alone.
//!
//! The world comes from run.json. A row of the tutorial's table has the forces of all points, whose
//! contacts follow from the state; tables have contacts, which are rebuilt from their rows and held
//! against the shapes ([`tumble::simulation::tables`]). What the step then comes to must be what the
//! files say: the residual, and of tables its parts, the slips, the overlap of all pairs after the
//! step and the energy.

use crate::cli::recording::{Recording, Step};
use nalgebra::Vector3;
use tumble::contact::certificate::{Certifier, Claim, certify_rk4_step};
use tumble::contact::detection::all_contacts;
use tumble::contact::restitution::set_rebounds;
use tumble::contact::{Candidates, Certificate, Contact, Partner, rounding};
use tumble::mechanics::{Load, State, Wrench};
use tumble::simulation::energy;
use tumble::simulation::tables::TableStep;
use tumble::simulation::trajectory::TrajectoryRow;
use tumble::step::StepStatus;
use tumble::world::World;

/// What is recomputed may differ from its column by this part of it, and by what rounding makes of
/// an exact step.
const RELATIVE_TOLERANCE: f64 = 1e-9;

/// The search for the axis of the smallest overlap ends where the next one is no better by this
/// part of the reach, so that it depends so far on where it began.
const OVERLAP_FOUND_TO: f64 = 1e-9;

/// One verified step.
pub struct Verified {
    pub index: u64,
    pub status: StepStatus,
    /// m/s.
    pub residual: f64,
    /// The largest part of the residual.
    pub part: &'static str,
    /// The residual that the file has, m/s.
    pub column: f64,
    /// What is not as the files say, if anything.
    pub differs: Option<String>,
    /// Whether the step is less exact than one that counts as solved, whatever its status says.
    pub inexact: bool,
    /// m, after the step.
    pub overlap: f64,
}

/// A run that is being verified.
pub struct Judge {
    world: World,
    loads: Vec<Load>,
    floating: bool,
    certifier: Certifier,
    candidates: Candidates,
    /// What a contact step that counts as solved may have, m/s.
    pub accepted: f64,
}

/// The contacts of a step and their forces.
#[derive(Default)]
struct Touching {
    contacts: Vec<Contact>,
    forces: Vec<Vector3<f64>>,
    /// What is wrong with a row of which no contact could be made.
    wrong: Option<String>,
}

/// Whether a number found again is its column.
fn is_near(found: f64, column: f64, lost: f64) -> bool {
    (found - column).abs() <= lost + RELATIVE_TOLERANCE * column.abs()
}

impl Judge {
    pub fn of(recording: &Recording<'_>) -> Self {
        Self {
            world: recording.world.clone(),
            loads: recording.loads.clone(),
            floating: recording.floating(),
            certifier: Certifier::new(),
            candidates: Candidates::new(),
            accepted: recording.accepted(),
        }
    }

    /// The step that ends at `next`.
    pub fn step(&mut self, step: &Step, next: &[State]) -> Verified {
        let states = step.states();
        let wrenches = self.wrenches(step.index(), states);
        let touching = match step {
            Step::Trajectory(row) => self.of_points(row, next, &wrenches),
            Step::Tables(step) => self.of_rows(step),
        };
        let Touching { contacts, forces, wrong } = &touching;
        let claim = Claim { states, next, wrenches: &wrenches, contacts, joints: &[] };
        let certificate = match self.floating {
            true => certify_rk4_step(&self.world, &claim),
            false => self.certifier.contact_step(&self.world, &claim, forces.iter().copied()),
        };
        let residual = if wrong.is_none() { certificate.residual() } else { f64::NAN };
        let lost = self.lost(step, contacts, next);
        let (differs, overlap) = match step {
            Step::Trajectory(row) => {
                let is_same = is_near(residual, row.residual, lost);
                ((!is_same).then(|| "its residual is another".to_owned()), 0.0)
            }
            Step::Tables(step) => self.compare(step, next, &wrenches, &touching, &certificate),
        };
        // Free flight is exact, whoever solves the contacts.
        let flies = step.status() == StepStatus::Free && forces.iter().all(|f| f.amax() == 0.0);
        let accepted = if flies { 0.0 } else { self.accepted };
        // A NaN is within nothing.
        let is_exact = residual <= accepted.max(lost);
        Verified {
            index: step.index(),
            status: step.status(),
            residual,
            part: certificate.worst_part(),
            column: step.residual(),
            differs,
            inexact: !is_exact,
            overlap,
        }
    }

    /// The last state, if it has another energy than its row says.
    pub fn end(&self, end: &Step) -> Option<Verified> {
        let Step::Tables(step) = end else { return None };
        (!self.has_its_energy(step)).then(|| Verified {
            index: step.row.index,
            status: step.row.status,
            residual: 0.0,
            part: "dynamics",
            column: step.row.residual,
            differs: Some(OTHER_ENERGY.to_owned()),
            inexact: false,
            overlap: 0.0,
        })
    }

    /// Every point of the one body, at the forces of the row.
    fn of_points(&self, row: &TrajectoryRow, next: &[State], wrenches: &[Wrench]) -> Touching {
        let (world, states) = (&self.world, [row.state]);
        let mut contacts = Vec::new();
        if !self.floating {
            all_contacts(world, &states, &mut contacts);
        }
        if world.has_restitution() {
            let free = self.free_flight(&states, wrenches);
            let share = [row.restitution_share];
            set_rebounds(world, &states, &free, &share, &mut contacts);
            if contacts.iter().any(Contact::bounces) {
                for (contact, force) in contacts.iter_mut().zip(row.forces()) {
                    let presses = contact.normal().dot(&force) > 0.0;
                    let closes = contact.could_close(world, &states, next);
                    contact.struck = presses && closes && contact.may_be_struck();
                }
                set_rebounds(world, &states, &free, &share, &mut contacts);
            }
        }
        Touching { contacts, forces: row.forces().collect(), wrong: None }
    }

    /// The contacts that the tables have.
    fn of_rows(&self, step: &TableStep) -> Touching {
        let mut touching = Touching::default();
        for (number, row) in step.contacts.iter().enumerate() {
            match row.contact(&self.world, &step.states) {
                Ok(contact) => touching.contacts.push(contact),
                Err(why) => {
                    touching.wrong.get_or_insert_with(|| format!("its contact {number} {why}"));
                }
            }
            touching.forces.push(row.force);
        }
        touching
    }

    /// What of a step is not what its tables say, and how deep pieces overlap after it, m.
    fn compare(
        &mut self,
        step: &TableStep,
        next: &[State],
        wrenches: &[Wrench],
        touching: &Touching,
        certificate: &Certificate,
    ) -> (Option<String>, f64) {
        let (states, row, contacts) = (&step.states[..], &step.row, &touching.contacts);
        let (complete, mut differs) = (touching.wrong.is_none(), touching.wrong.clone());
        let mut differ = |what: String| differs = differs.take().or(Some(what));
        if self.has_another_rebound(contacts, (states, next), wrenches, row.restitution_share) {
            differ("a contact of it bounces as none of the world does".to_owned());
        }
        let lost = self.lost_in(contacts, states, next);
        if complete && !is_near(certificate.residual(), row.residual, lost) {
            differ(format!("its residual in the table is {:.3e} m/s", row.residual));
        }
        for ((part, found), column) in certificate.parts().into_iter().zip(row.parts) {
            if complete && !is_near(found, column, lost) {
                differ(format!("its {part} in the table is {column:.3e} m/s, not {found:.3e}"));
            }
        }
        let pairs = contacts.iter().zip(&step.contacts).filter(|_| complete).enumerate();
        for (number, (contact, row)) in pairs {
            if (self.slip(contact, states, next) - row.slip).amax() > lost {
                differ(format!("its contact {number} has another slip"));
            }
        }
        let overlap = self.candidates.deepest_overlap(&self.world, next);
        let overlap = overlap.map_or(0.0, |(depth, ..)| depth);
        if !is_near(overlap, row.overlap, OVERLAP_FOUND_TO * self.world.reach()) {
            differ(format!("its overlap in the table is {:.3e} m, not {overlap:.3e}", row.overlap));
        }
        if !self.has_its_energy(step) {
            differ(OTHER_ENERGY.to_owned());
        }
        (differs, overlap)
    }

    /// What rounding may make of a residual, m/s: of the step's own (eq. 22) where contacts follow
    /// from the states; where they are rebuilt from rows, of theirs too.
    fn lost(&self, step: &Step, contacts: &[Contact], next: &[State]) -> f64 {
        match step {
            Step::Trajectory(_) => rounding::residual(&self.world, step.states(), next),
            Step::Tables(_) => self.lost_in(contacts, step.states(), next),
        }
    }

    /// The same of rebuilt contacts: as a contact's plane is rebuilt from a gap and a gap computed
    /// from it, twice of a gap's (eq. 21) comes to it.
    fn lost_in(&self, contacts: &[Contact], states: &[State], next: &[State]) -> f64 {
        let lost = rounding::residual(&self.world, states, next);
        let of_gaps = contacts.iter().map(|contact| {
            let position = &states[contact.key.body].position;
            let offset = contact.features.offset;
            rounding::gap(&contact.normal(), position, offset, &contact.arm)
        });
        let of_gap = of_gaps.fold(0.0, f64::max);
        (lost + 2.0 * of_gap / self.world.time_step()).min(rounding::LARGEST)
    }

    /// Whether a contact must part more slowly than the step's share of the restitution says, or
    /// faster than all of it does.
    fn has_another_rebound(
        &self,
        contacts: &[Contact],
        (states, next): (&[State], &[State]),
        wrenches: &[Wrench],
        share: f64,
    ) -> bool {
        let world = &self.world;
        if !world.has_restitution() {
            return share != 1.0 || contacts.iter().any(Contact::bounces);
        }
        let free = self.free_flight(states, wrenches);
        let rounding = self.lost_in(contacts, states, &free);
        let range =
            |contact: &Contact| [share, 1.0].map(|s| contact.rebound_of(world, states, &free, s));
        // What another's impulse closes: only where one arrives, and what was near enough.
        let arrives = contacts.iter().any(|contact| range(contact)[1] > 0.0);
        contacts.iter().any(|contact| {
            let mut ends = range(contact);
            let may_be_struck = arrives && contact.could_close(world, states, next);
            if ends[1] == 0.0 && contact.bounces() && may_be_struck {
                ends = range(&Contact { struck: true, ..*contact });
            }
            let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            !(least - rounding..=most + rounding).contains(&contact.rebound)
        })
    }

    fn wrenches(&self, index: u64, states: &[State]) -> Vec<Wrench> {
        let h = self.world.time_step();
        let pairs = self.loads.iter().zip(states);
        pairs.map(|(load, state)| load.wrench(index, h, &state.attitude)).collect()
    }

    /// Where the bodies would be without contact.
    fn free_flight(&self, states: &[State], wrenches: &[Wrench]) -> Vec<State> {
        let flights = states.iter().zip(wrenches).enumerate();
        flights.map(|(i, (state, wrench))| self.world.free_flight(i, state, wrench)).collect()
    }

    /// The mean slip of a contact over the step, m/s, world.
    fn slip(&self, contact: &Contact, states: &[State], next: &[State]) -> Vector3<f64> {
        let poses = |body: usize| (states[body].pose(), next[body].pose());
        let a = poses(contact.key.body);
        let b = match contact.key.partner {
            Partner::Body(index) => Some(poses(index)),
            Partner::Ground | Partner::Fixed(_) => None,
        };
        let b = b.as_ref().map(|b| (&b.0, &b.1));
        let u = contact.motion((&a.0, &a.1), b, self.world.time_step());
        u - contact.normal() * contact.normal().dot(&u)
    }

    /// The energy is a sum of large parts of both signs; rounding is of the largest of them.
    fn has_its_energy(&self, step: &TableStep) -> bool {
        let (gravity, h) = (self.world.gravity(), self.world.time_step());
        let parts = self.world.bodies().iter().zip(&step.states).map(|(body, state)| {
            let (velocity, position) = (&state.velocity, &state.position);
            let fallen = h * gravity.dot(velocity).abs() + gravity.dot(position).abs();
            let linear = velocity.norm_squared() + fallen;
            body.mass() * linear + energy::turning(&self.world, body, &state.spin)
        });
        let scale: f64 = parts.sum();
        let found = energy::total(&self.world, &step.states);
        (found - step.row.energy).abs() <= RELATIVE_TOLERANCE * scale
    }
}

const OTHER_ENERGY: &str = "its energy is another";
