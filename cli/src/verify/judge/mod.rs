//! Verification of an interval from the files alone.
//!
//! The world comes from run.json. The contacts are rebuilt from their rows and compared with their
//! keys ([`tumble_scene::output::tables`]). Those with a force must be where the pieces touch (eq.
//! 18g).
//!
//! The following recomputed values must equal those in the files:
//!
//! - the residual and its parts;
//! - the slips, the joint rows without forces, the overlap after the step, the placement of the
//!   contacts and the energy.
//!
//! The status must be possible for such a step.

mod energy;
mod joints;
mod lost;
mod rows;
mod status;

use crate::outcome::Failure;
use crate::recording::Recording;
use energy::{OTHER_ENERGY, RetryEnergy};
use nalgebra::Vector3;
use tumble_core::contact::certificate::{Certifier, Claim, certify_rk4_step};
use tumble_core::contact::{Candidates, Certificate, Contact, ContactLoad, rounding};
use tumble_core::joint::{Joint, JointForce, JointResidual, Knots};
use tumble_core::mechanics::{Load, State, Wrench};
use tumble_core::simulation::Stiffness;
use tumble_core::step::StepStatus;
use tumble_core::world::{Span, World};
use tumble_scene::output::tables::{IntervalRows, JointRow, StepRow, rounds};

/// Relative tolerance of recomputed values, in addition to the rounding error of an exact step.
const RELATIVE_TOLERANCE: f64 = 1e-9;

/// Tolerance of overlaps relative to the reach. The search for the axis of the smallest overlap
/// stops below this improvement (`geometry/manifold.rs`), so its result depends on its start.
const OVERLAP_FOUND_TO: f64 = 1e-7;

/// Difference of a residual from its column that changes no verdict, a hundredth of the limit of the
/// native solver (m/s, times the speed scale). Numbers of tables are rounded to a tenth of it
/// (`output/tables/digits.rs` of the scene's crate), and points on cones are known to 10⁻¹² of their size.
const NEGLIGIBLE: f64 = 1e-11;

/// Rounding error of a sum of some products, relative to the largest of them.
const ROUNDED: f64 = 16.0 * f64::EPSILON;

/// Depth at which no body has passed through another one, relative to the reach of the smaller one.
const SHALLOW: f64 = 0.01;

/// Result of verifying an interval.
pub struct Verified {
    pub index: u64,
    /// True for the first interval of a step.
    pub is_first: bool,
    pub status: StepStatus,
    /// Residual, m/s.
    pub residual: f64,
    /// Largest part of the residual.
    pub part: &'static str,
    /// Difference from the file, if any.
    pub differs: Option<String>,
    /// True if the step exceeds the residual limit of solved steps, whatever its status.
    pub inexact: bool,
    /// Overlap after the step, m.
    pub overlap: f64,
}

/// Difference of a row whose velocities of the instant do not follow from the step before (eq. 37).
pub const OTHER_INSTANTS: &str = "its velocities of the instant differ";

/// Verifier of a run.
pub struct StepJudge {
    world: World,
    loads: Vec<Load>,
    courses: Vec<(usize, Knots)>,
    floating: bool,
    /// True if slips have offsets (eq. 38), as with the native solver.
    turns_friction: bool,
    certifier: Certifier,
    stiffness: Stiffness,
    candidates: Candidates,
    /// Largest residual of a solved contact step, m/s.
    pub accepted: f64,
    /// Joint angles at the start of the step including full turns, rad; empty before the first
    /// step.
    angles: Vec<Vector3<f64>>,
    /// True if joints may have turned before the first step.
    turned_before: bool,
    /// Energy of the present substepped step so far.
    retry_energy: Option<RetryEnergy>,
    /// States at the end of the last interval, unless it was a retry.
    last_end: Option<Vec<State>>,
    /// True if rows between steps are omitted.
    has_gaps: bool,
    /// True if idle contacts have no rows.
    loaded_contacts: bool,
    /// True if numbers of the tables are rounded.
    is_rounded: bool,
}

/// A step of the tables with its contacts and their forces and moments.
struct JudgedStep<'a> {
    step: &'a IntervalRows,
    /// States at its end.
    next: &'a [State],
    /// Row after it.
    following: &'a StepRow,
    /// True if a body starts at the next row.
    next_starts: bool,
    wrenches: Vec<Wrench>,
    contacts: Vec<Contact>,
    loads: Vec<ContactLoad>,
    joints: Vec<JointForce>,
    gears: Vec<f64>,
    /// Error in the first row that cannot be a contact.
    wrong: Option<String>,
}

impl JudgedStep<'_> {
    fn claim(&self) -> Claim<'_> {
        let Self { step, next, wrenches, contacts, joints, gears, .. } = self;
        Claim { states: &step.states, next, wrenches, contacts, joints, gears }
    }
}

/// True if a recomputed number equals its column within the tolerances. A column is finite.
fn is_near(found: f64, column: f64, lost: f64) -> bool {
    found.is_finite() && (found - column).abs() <= lost + RELATIVE_TOLERANCE * column.abs()
}

impl StepJudge {
    pub fn new(recording: &Recording<'_>) -> Result<Self, Failure> {
        Ok(Self {
            world: recording.world.clone(),
            loads: recording.loads.clone(),
            courses: recording.courses.clone(),
            floating: recording.floating(),
            turns_friction: recording.run.solver.name == "native",
            certifier: Certifier::new(),
            stiffness: Stiffness::default(),
            candidates: Candidates::new(),
            accepted: recording.accepted()?,
            angles: Vec::new(),
            retry_energy: None,
            last_end: None,
            turned_before: recording.run.start_index > 0,
            has_gaps: recording.row_selection().has_gaps(),
            loaded_contacts: recording.row_selection().loaded_contacts,
            is_rounded: recording.row_selection().short && rounds(&recording.world),
        })
    }

    /// Initialises the full turns of joints at `step`, the first row or a row after omitted ones.
    /// They come from its rows if joints may have turned before.
    fn count(&mut self, step: &IntervalRows) {
        if !self.angles.is_empty() && !self.has_gaps {
            return;
        }
        self.angles = if self.turned_before || self.has_gaps {
            let joints = self.world.joints().iter().zip(&step.joints);
            let counted = |(joint, row): (&Joint, &JointRow)| {
                let at = joint.coordinates(&step.states);
                at.map_or(row.turns, |at| joint.counted(&at, &row.turns))
            };
            joints.map(counted).collect()
        } else {
            self.world.angles_near(&step.states, &[])
        };
    }

    /// Verifies the interval of `step`. The next rows are `following`.
    ///
    /// The states and forces of the rows are inserted in the equations of the step. The resulting
    /// certificate, slips, joint rows and energy are compared with the rows. Nothing is solved.
    pub fn interval(&mut self, step: &IntervalRows, following: &IntervalRows) -> Verified {
        let (states, row) = (&step.states[..], &step.row);
        // Without rows in `ends`, the next row starts at the end.
        let next = if step.ends.is_empty() { &following.states } else { &step.ends };
        self.world.set_span(step.span(&self.world));
        self.world.set_before(step.before.iter().copied());
        self.world.follow(&self.courses, self.world.time_after(row.index));
        self.count(step);
        let wrenches = self.wrenches(row.index, states);
        let judged = self.compare_rows(step, next, following, wrenches);
        let JudgedStep { contacts, loads, joints, wrong, .. } = &judged;
        let claim = judged.claim();
        let certificate = if self.floating {
            certify_rk4_step(&self.world, &claim)
        } else {
            let held = self.world.held_back(states, joints);
            self.certifier.contact_step(&held, &claim, loads.iter().copied())
        };
        let residual = if wrong.is_none() { certificate.residual() } else { f64::NAN };
        let of_forces = rounding::forces(&self.world, &claim, loads.iter().copied());
        let lost =
            (self.lost(contacts, states, next) + of_forces).min(rounding::largest(&self.world));
        let makes_energy = self.makes_energy(&judged);
        let status = self.another_status(&judged, lost, makes_energy);
        let (differs, overlap) = self.compare(&judged, &certificate, lost);
        let differs = differs.or(status);
        self.angles = joints.iter().map(|joint| joint.angles).collect();
        let is_retry = self.world.span().is_some_and(|span| span.is_retry);
        self.last_end = (!is_retry).then(|| next.to_vec());
        // Free flight is exact for every solver of contacts.
        let flies =
            row.status == StepStatus::Free && loads.iter().all(|load| load.force.amax() == 0.0);
        let accepted = if flies { 0.0 } else { self.accepted };
        // NaN is never within a limit.
        let is_exact = residual <= accepted.max(lost) + self.rounding();
        Verified {
            index: row.index,
            is_first: row.interval == 0,
            status: row.status,
            residual,
            part: certificate.worst_part(),
            differs,
            inexact: !is_exact,
            overlap,
        }
    }

    /// Largest error of a residual by rounded numbers of the tables (m/s); 0 if they have all digits.
    fn rounding(&self) -> f64 {
        if self.is_rounded { NEGLIGIBLE * self.world.speed_scale() } else { 0.0 }
    }

    /// The same for velocities (m/s) and spins (rad/s).
    pub fn rounding_of_velocities(&self) -> f64 {
        self.rounding() * (1.0 / self.world.reach()).max(1.0)
    }

    /// Verifies the last state: its energy, and that its row has no step. `follows` is true if its
    /// velocities of the instant are right. Returns `None` if it is correct.
    pub fn end(&mut self, end: &IntervalRows, follows: bool) -> Option<Verified> {
        let row = &end.row;
        self.world.set_span(None);
        self.world.set_before(end.before.iter().copied());
        self.world.follow(&self.courses, row.index as f64 * self.world.whole_step());
        let numbers =
            row.parts.iter().chain([&row.residual, &row.overlap, &row.placement, &row.stiffness]);
        let of_joint = |joint: &JointRow| {
            let JointRow { velocity, spin, force, torque, residual, .. } = joint;
            let still = [velocity, spin, force, torque].map(Vector3::amax);
            still == [0.0; 4] && *residual == JointResidual::default()
        };
        let is_bare = row.contacts == 0
            && end.joints.iter().all(of_joint)
            && row.iterations == 0
            && (row.interval, row.length, row.usual, row.error) == (0, 0.0, 0.0, 0.0)
            && row.works == [0.0; 6]
            && row.start.is_empty()
            && row.restitution_share == 1.0
            && numbers.copied().all(|number| number == 0.0);
        let has_energy = self.has_its_energy(end);
        self.count(end);
        let joint = self.another_joint(end, None).or_else(|| self.another_gear(end, None));
        let differs = match (is_bare, has_energy, joint) {
            (true, true, None) if follows => return None,
            (true, true, None) => OTHER_INSTANTS.to_owned(),
            (false, ..) => "no step begins at its state, but its row has one".to_owned(),
            (true, _, Some(joint)) => joint,
            (true, false, None) => OTHER_ENERGY.to_owned(),
        };
        Some(Verified {
            index: row.index,
            is_first: true,
            status: row.status,
            residual: 0.0,
            part: "dynamics",
            differs: Some(differs),
            inexact: false,
            overlap: 0.0,
        })
    }

    /// First difference between a step and its tables, and the overlap after the step, m. `lost` is
    /// the rounding error of a slip computed from exact numbers, m/s.
    fn compare(
        &mut self,
        judged: &JudgedStep<'_>,
        certificate: &Certificate,
        lost: f64,
    ) -> (Option<String>, f64) {
        let JudgedStep { step, next, contacts, joints, gears, wrong, .. } = judged;
        let (states, row) = (&step.states[..], &step.row);
        let (complete, mut differs) = (wrong.is_none(), wrong.clone());
        let mut differ = |what: String| differs = differs.take().or(Some(what));
        if self.has_another_rebound(judged) {
            differ("a contact rebounds differently from the restitution law".to_owned());
        }
        let slip_lost = lost + self.rounding();
        let negligible = NEGLIGIBLE * self.world.speed_scale();
        let lost = lost + self.lost_of_forces(judged) + negligible;
        let h = self.world.time_step();
        if !is_near(h, row.length, 0.0) {
            differ(format!("its length in the table is {} s, not {h} s", row.length));
        }
        let whole = self.world.whole_step();
        let is_possible =
            |span: Span| span.is_retry || span.length <= span.usual && span.usual <= whole;
        if !self.world.span().is_none_or(is_possible) {
            let usual = row.usual;
            differ(format!("its correction_s is {usual}, outside interval_s to {whole} s"));
        }
        if let Some(other) = self.another_joint(step, Some((next, joints))) {
            differ(other);
        }
        if let Some(other) = self.another_gear(step, Some((next, joints))) {
            differ(other);
        }
        if complete && !is_near(certificate.residual(), row.residual, lost) {
            differ(format!("its residual in the table is {:.3e} m/s", row.residual));
        }
        for ((part, found), column) in certificate.parts().into_iter().zip(row.parts) {
            if complete && !is_near(found, column, lost) {
                differ(format!("its {part} in the table is {column:.3e} m/s, not {found:.3e}"));
            }
        }
        for (contact, row) in contacts.iter().zip(&*step.contacts).filter(|_| complete) {
            if (contact.slip(&self.world, states, next) - row.slip).amax() > slip_lost {
                differ(format!("its contact {} has a different slip", row.index));
            }
        }
        if complete {
            let missing = self.missing_contact(judged, slip_lost);
            missing.into_iter().for_each(&mut differ);
            let misplaced = self.placement_error(judged);
            if !is_near(misplaced, row.placement, OVERLAP_FOUND_TO * self.world.reach()) {
                let column = row.placement;
                differ(format!(
                    "its loaded contacts are {misplaced:.3e} m off the pieces, not {column:.3e}"
                ));
            }
        }
        let overlap = self.candidates.deepest_overlap(&self.world, next);
        let overlap = overlap.map_or(0.0, |(depth, ..)| depth);
        if complete {
            let wrong = self.wrong_contacts(judged, row.placement, overlap);
            wrong.into_iter().for_each(&mut differ);
        }
        // The search also saw intervals that were not taken. Depths below the gap that contacts keep depend
        // on it.
        let kept = self.world.touching_gap();
        if !is_near(overlap, row.overlap, OVERLAP_FOUND_TO * self.world.reach() + kept) {
            differ(format!("its overlap in the table is {:.3e} m, not {overlap:.3e}", row.overlap));
        }
        let stiffness = self.stiffness.largest_in_step(&self.world, states, joints, gears);
        if !is_near(stiffness, row.stiffness, ROUNDED.sqrt()) {
            differ(format!(
                "its stiffness in the table is {:.3e}, not {stiffness:.3e}",
                row.stiffness
            ));
        }
        if !self.has_its_energy(step) {
            differ(OTHER_ENERGY.to_owned());
        }
        if !self.has_gaps && !self.has_its_works(judged) {
            differ("its energy terms differ".to_owned());
        }
        (differs, overlap)
    }

    /// Contact without a row that ends a solved step deeper than its residual and the rotation of its
    /// bodies allow. The search is that of the simulation, which may have found another plane. Two planes
    /// of one pair differ by the square of the rotation. A shallow contact is not missing if no pieces overlap.
    fn missing_contact(&mut self, judged: &JudgedStep<'_>, lost: f64) -> Option<String> {
        let JudgedStep { step: IntervalRows { row, states, .. }, next, contacts, .. } = judged;
        let depth = self.accepted.max(lost) * self.world.time_step();
        self.candidates.clear();
        self.candidates.extend(contacts.iter().copied());
        self.candidates.admit_missed(&self.world, states, next, depth);
        let turned = |body: usize| {
            let turned = next[body].pose().rotation - states[body].pose().rotation;
            self.world.bodies()[body].reach() * turned.norm_squared()
        };
        let kept = self.world.touching_gap();
        let allowed =
            |contact: &Contact| depth + kept + contact.key.bodies().map(turned).sum::<f64>();
        let mut missing = self.candidates.contacts()[contacts.len()..].iter();
        let missing = *missing.find(|contact| contact.gap_in(next) < -allowed(contact))?;
        let body = missing.key.body;
        let depth = -missing.gap_in(next);
        let least = allowed(&missing);
        let reaches = missing.key.bodies().map(|body| self.world.bodies()[body].reach());
        if depth < SHALLOW * reaches.fold(f64::INFINITY, f64::min) {
            let overlap = self.candidates.deepest_overlap(&self.world, next);
            if overlap.is_none_or(|(overlap, ..)| overlap <= least) {
                return None;
            }
        }
        let may_miss = [StepStatus::Wild, StepStatus::Failed];
        (!may_miss.contains(&row.status))
            .then(|| format!("a contact of body {body} that ends {depth:.3e} m deep has no row"))
    }

    /// Contradiction between the contacts of a solved step and its pieces: a force acts where they do not touch, with
    /// this `error` of the placement (18g), or pieces sink into each other (18h), with this `overlap` at the end (m).
    fn wrong_contacts(
        &mut self,
        judged: &JudgedStep<'_>,
        error: f64,
        overlap: f64,
    ) -> Option<String> {
        let JudgedStep { step: IntervalRows { row, states, .. }, next, loads, .. } = judged;
        if !row.status.is_solved() {
            return None;
        }
        let status = row.status.name();
        let forces = loads.iter().map(|load| load.force);
        if error != 0.0
            && let Some((contact, error)) =
                self.candidates.misplaced(&self.world, states, next, forces).first()
        {
            let body = contact.key.body;
            return Some(format!(
                "its status is `{status}`, but a contact of body {body} acts {error:.3e} m from where its pieces touch"
            ));
        }
        if overlap == 0.0 {
            return None;
        }
        let [one, other] = self.candidates.sunk_pair(&self.world, states, next)?;
        let body = one.body().or(other.body())?;
        Some(format!("its status is `{status}`, but body {body} sinks into what it touches"))
    }

    /// Largest error of the placement of a contact with a force (eq. 18g), m.
    fn placement_error(&mut self, judged: &JudgedStep<'_>) -> f64 {
        let JudgedStep { step, next, contacts, loads, .. } = judged;
        self.candidates.clear();
        self.candidates.extend(contacts.iter().copied());
        let forces = loads.iter().map(|load| load.force);
        self.candidates.placement_error(&self.world, &step.states, next, forces)
    }

    /// True if a contact's rebound speed is not between the step's share of the restitution and
    /// full restitution.
    fn has_another_rebound(&self, judged: &JudgedStep<'_>) -> bool {
        let JudgedStep { step, next, wrenches, contacts, loads, .. } = judged;
        let IntervalRows { states, row, .. } = step;
        let (world, share) = (&self.world, row.restitution_share);
        if !world.has_restitution() {
            return share != 1.0 || contacts.iter().any(Contact::bounces);
        }
        let free = self.free_flight(states, wrenches);
        let rounding = self.lost(contacts, states, &free) + self.rounding();
        let range =
            |contact: &Contact| [share, 1.0].map(|s| contact.rebound_of(world, states, &free, s));
        let mut pushed = vec![0.0; states.len()];
        for (contact, load) in contacts.iter().zip(loads) {
            let speed = contact.pushed_by(world, &load.force);
            contact.key.bodies().for_each(|body| pushed[body] += speed);
        }
        // A contact without own impact can be struck by another's impulse, if one arrives and it
        // was near.
        let arrives = contacts.iter().any(|contact| range(contact)[1] > 0.0);
        contacts.iter().any(|contact| {
            let mut ends = range(contact);
            let pushed = contact.key.bodies().map(|body| pushed[body]).sum();
            let may_be_struck = arrives && contact.could_close(world, states, next, pushed);
            if ends[1] == 0.0 && contact.bounces() && may_be_struck {
                ends = range(&Contact { struck: true, ..*contact });
            }
            let (least, most) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
            !(least - rounding..=most + rounding).contains(&contact.rebound)
        })
    }

    fn wrenches(&self, index: u64, states: &[State]) -> Vec<Wrench> {
        let world = &self.world;
        let pairs = self.loads.iter().zip(states).enumerate();
        let wrench = |(body, (load, state)): (usize, (&Load, &State))| {
            let [from, to] = world.load_interval(index, body);
            let share = if world.has_half_kicks() { world.kick(body) } else { 1.0 };
            let mean = load.mean(from, to, &state.attitude).scaled(share);
            mean.plus(&world.missing_kick(body, state))
        };
        pairs.map(wrench).collect()
    }

    /// Second halves of the changes of velocity (m/s) and spin (rad/s) by external forces in the interval `step`, which
    /// was verified last.
    pub fn late_halves(&self, step: &IntervalRows) -> Vec<[Vector3<f64>; 2]> {
        let free = self.free_flight(&step.states, &self.wrenches(step.row.index, &step.states));
        let pairs = free.iter().zip(&step.states).enumerate();
        let half = |(body, (free, state)): (usize, (&State, &State))| {
            let share = 0.5 / self.world.kick(body);
            [free.velocity - state.velocity, free.spin - state.spin].map(|change| change * share)
        };
        pairs.map(half).collect()
    }

    /// End states of the bodies without contact.
    fn free_flight(&self, states: &[State], wrenches: &[Wrench]) -> Vec<State> {
        let flights = states.iter().zip(wrenches).enumerate();
        flights.map(|(i, (state, wrench))| self.world.free_flight(i, state, wrench)).collect()
    }
}
