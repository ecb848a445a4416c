//! `tumble verify` of a run of several bodies: every step judged by its tables alone.
//!
//! The world comes from run.json. Contacts are rebuilt from their rows and held against the shapes
//! ([`tumble::simulation::tables`]); what the step then comes to, the residual, the slips, the
//! overlap of all pairs after it and the energy, must be what the tables say.

use super::tables::RunTables;
use crate::cli::args::VerifyArgs;
use crate::cli::outcome::{Failure, Outcome};
use crate::cli::output::say;
use std::fmt::Write as _;
use tumble::contact::certificate::{Certifier, Claim};
use tumble::contact::{Candidates, Contact, Partner, rounding};
use tumble::mechanics::{Load, State, Wrench};
use tumble::simulation::energy;
use tumble::simulation::tables::TableStep;
use tumble::step::StepStatus;
use tumble::world::World;

/// What is recomputed may differ from its column by this part of it, and by rounding.
const RELATIVE_TOLERANCE: f64 = 1e-9;

/// The search for the axis of the smallest overlap ends where the next one is no better by this
/// part of the reach, so that it depends so far on where it began.
const OVERLAP_FOUND_TO: f64 = 1e-9;

/// What was found of the steps.
#[derive(Default)]
struct Findings {
    steps: u64,
    failed: u64,
    inexact: u64,
    differing: u64,
    largest_overlap: f64,
    worst: Vec<Verified>,
}

/// One verified step.
struct Verified {
    index: u64,
    status: StepStatus,
    residual: f64,
    part: &'static str,
    /// What is not as the tables say, if anything.
    differs: Option<String>,
    inexact: bool,
    /// m, after the step.
    overlap: f64,
}

/// A run that is being verified.
struct Judge {
    world: World,
    loads: Vec<Load>,
    certifier: Certifier,
    candidates: Candidates,
    accepted: f64,
}

pub fn run(args: &VerifyArgs, mut tables: RunTables) -> Result<Outcome, Failure> {
    let accepted = tables.run.solver.accepted_residual(&tables.world);
    let (certifier, candidates) = (Certifier::new(), Candidates::new());
    let (world, loads) = (tables.world.clone(), tables.loads.clone());
    let mut judge = Judge { world, loads, certifier, candidates, accepted };
    let (mut findings, mut previous) = (Findings::default(), None::<TableStep>);
    while let Some(step) = tables.next_step()? {
        if let Some(previous) = previous {
            findings.add(judge.step(&previous, &step.states), args.worst);
        }
        previous = Some(step);
    }
    if let Some(end) = previous.filter(|end| !judge.has_its_energy(end)) {
        findings.differing += 1;
        let (index, status) = (end.row.index, end.row.status);
        let differs = Some("its energy is another".to_owned());
        let (residual, part, inexact, overlap) = (0.0, "dynamics", false, 0.0);
        let end = Verified { index, status, residual, part, differs, inexact, overlap };
        findings.keep(end, args.worst);
    }
    report(&tables.folder(), &judge, &findings)
}

impl Findings {
    fn add(&mut self, step: Verified, most: usize) {
        self.steps += 1;
        self.failed += u64::from(step.status == StepStatus::Failed);
        self.inexact += u64::from(step.inexact);
        self.differing += u64::from(step.differs.is_some());
        self.largest_overlap = self.largest_overlap.max(step.overlap);
        self.keep(step, most);
    }

    /// Keeps the step if it is among the `most` worst: those that differ first.
    fn keep(&mut self, step: Verified, most: usize) {
        let rank = |a: &Verified, b: &Verified| {
            let worst = b.residual.total_cmp(&a.residual);
            b.differs.is_some().cmp(&a.differs.is_some()).then(worst)
        };
        let place = self.worst.partition_point(|kept| rank(kept, &step).is_le());
        if place < most {
            self.worst.insert(place, step);
            self.worst.truncate(most);
        }
    }
}

impl Judge {
    fn step(&mut self, step: &TableStep, next: &[State]) -> Verified {
        let (states, row) = (&step.states[..], &step.row);
        let mut differs = None;
        let mut differ = |what: String| differs = differs.take().or(Some(what));
        let mut contacts = Vec::new();
        for (number, contact) in step.contacts.iter().enumerate() {
            match contact.contact(&self.world, states) {
                Ok(contact) => contacts.push(contact),
                Err(why) => differ(format!("its contact {number} {why}")),
            }
        }
        let wrenches = self.wrenches(row.index, states);
        let ends = (states, next);
        if self.has_another_rebound(&contacts, ends, &wrenches, row.restitution_share) {
            differ("a contact of it bounces as none of the world does".to_owned());
        }
        let claim = Claim { states, next, wrenches: &wrenches, contacts: &contacts };
        let forces = step.contacts.iter().map(|contact| contact.force);
        let complete = contacts.len() == step.contacts.len();
        let certificate = self.certifier.contact_step(&self.world, &claim, forces);
        let residual = if complete { certificate.residual() } else { f64::NAN };
        let lost = self.lost(&contacts, states, next);
        let is_near = |found: f64, column: f64, lost: f64| {
            (found - column).abs() <= lost + RELATIVE_TOLERANCE * column.abs()
        };
        if complete && !is_near(residual, row.residual, lost) {
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
        let found_to = OVERLAP_FOUND_TO * self.world.reach();
        if !is_near(overlap, row.overlap, found_to) {
            differ(format!("its overlap in the table is {:.3e} m, not {overlap:.3e}", row.overlap));
        }
        if !self.has_its_energy(step) {
            differ("its energy is another".to_owned());
        }
        // Free flight is exact, whoever solves the contacts.
        let flies = row.status == StepStatus::Free && step.contacts.is_empty();
        let accepted = if flies { 0.0 } else { self.accepted };
        // A NaN is within nothing.
        let is_exact = residual <= accepted.max(lost);
        Verified {
            index: row.index,
            status: row.status,
            residual,
            part: certificate.worst_part(),
            differs,
            inexact: !is_exact,
            overlap,
        }
    }

    /// What rounding may make of a residual, m/s: of the step's own (eq. 22), and, as a contact's
    /// plane is rebuilt from a gap and a gap computed from it, twice of a gap's (eq. 21).
    fn lost(&self, contacts: &[Contact], states: &[State], next: &[State]) -> f64 {
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
        let flights = states.iter().zip(wrenches).enumerate();
        let free: Vec<_> = flights.map(|(i, (s, w))| world.free_flight(i, s, w)).collect();
        let rounding = self.lost(contacts, states, &free);
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

    /// The mean slip of a contact over the step, m/s, world.
    fn slip(&self, contact: &Contact, states: &[State], next: &[State]) -> nalgebra::Vector3<f64> {
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

fn report(folder: &str, judge: &Judge, findings: &Findings) -> Result<Outcome, Failure> {
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{folder}: {} steps of {} bodies",
        findings.steps,
        judge.world.bodies().len()
    );
    let _ = writeln!(text, "  status `failed`: {}", findings.failed);
    let _ = writeln!(
        text,
        "  residuals above what a solved step may have, {:.1e} m/s: {}",
        judge.accepted, findings.inexact
    );
    let _ = writeln!(text, "  steps that are not what the tables say: {}", findings.differing);
    let _ = writeln!(text, "  largest overlap: {:.1e} m", findings.largest_overlap);
    if !findings.worst.is_empty() {
        let _ = writeln!(text, "  worst steps:");
    }
    for step in &findings.worst {
        let differs = step.differs.as_ref().map_or(String::new(), |what| format!(": {what}"));
        let _ = writeln!(
            text,
            "    k = {:<7} {:<9}  residual {:.3e} m/s ({}){differs}",
            step.index,
            step.status.name(),
            step.residual,
            step.part
        );
    }
    say(&text)?;
    Ok(if findings.differing > 0 {
        Outcome::Mismatch
    } else if findings.failed + findings.inexact > 0 {
        Outcome::Unconverged
    } else {
        Outcome::Done
    })
}
