//! Trajectory of one body as CSV, one row per step [record](StepRecord).
//!
//! For a body with n contact points, the columns are:
//!
//! - `k,t_s` and the 13 numbers of the state at step k
//! - variables of the tutorial's program for each point in the step k → k+1: `fx…,fy…,fz…` (N,
//!   world), `s1_…` (N m), `s2_…` (W), `lam…` (m/s), `alpha…`
//! - `status,iterations,certificate_m_s`
//! - `restitution_share`, in a world with restitution: the share of the coefficients that was
//!   applied ([`StepRecord::restitution_share`])
//!
//! A point without contact has zeros. `s1` and `s2` are the smallest slacks for the row's forces
//! and motion, and `lam` is the slip speed ([`products`]). `alpha` is 1 if the point carries a
//! force.
//!
//! The last row is a state without a step, with zeros in the step columns and the status `end`.
//! Numbers have the fewest digits that read back to the same double.

use super::rows::{RowChoice, RowWriter};
use super::sheet::{RowsError, Steps, TableReader};
use super::tables::{ContactRow, StepRow, TableStep};
use nalgebra::Vector3;
use std::io::{self, Read, Write};
use tumble::step_nlp::SMOOTHING;
use tumble::step_nlp::layout::{Layout, STATE};
use tumble::step_nlp::point::{Products, products};
use tumble_core::contact::{Contact, rounding};
use tumble_core::mechanics::State;
use tumble_core::simulation::StepRecord;
use tumble_core::step::{StepReport, StepStatus};
use tumble_core::world::World;

/// Columns before the contact points.
const STATE_COLUMNS: [&str; 15] = [
    "k", "t_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "vx_m_s", "vy_m_s", "vz_m_s",
    "wx_rad_s", "wy_rad_s", "wz_rad_s",
];

/// Prefix and suffix of the columns of a contact point, in the order of the decision vector and
/// with α last.
const CONTACT_COLUMNS: [(&str, &str); 7] = [
    ("fx", "_N"),
    ("fy", "_N"),
    ("fz", "_N"),
    ("s1_", ""),
    ("s2_", ""),
    ("lam", ""),
    ("alpha", ""),
];

/// Columns after the contact points.
const REPORT_COLUMNS: [&str; 3] = ["status", "iterations", "certificate_m_s"];

/// Last column in a world with restitution.
const SHARE_COLUMN: &str = "restitution_share";

/// Header for `contacts` contact points, with or without restitution.
#[must_use]
pub fn header(contacts: usize, bounce: bool) -> Vec<String> {
    let per_contact = CONTACT_COLUMNS
        .iter()
        .flat_map(|(prefix, suffix)| (0..contacts).map(move |i| format!("{prefix}{i}{suffix}")));
    let fixed = |names: &'static [&str]| names.iter().map(|&name| name.to_owned());
    let share = bounce.then(|| SHARE_COLUMN.to_owned());
    fixed(&STATE_COLUMNS).chain(per_contact).chain(fixed(&REPORT_COLUMNS)).chain(share).collect()
}

/// Writes a trajectory of one body row by row.
pub struct TrajectoryWriter<W: Write> {
    rows: RowWriter<W>,
    world: World,
    kept: RowChoice,
    layout: Layout,
    /// Numbers of the row between the state and the flags `alpha`.
    step: Vec<f64>,
    carrying: Vec<bool>,
}

impl<W: Write> TrajectoryWriter<W> {
    /// Writes the header of a trajectory of the only body of `world`.
    ///
    /// # Errors
    /// A world of several bodies, which needs [tables](crate::output::tables::TablesWriter); the
    /// errors of the stream.
    pub fn new(stream: W, world: &World) -> io::Result<Self> {
        let columns = columns(world)?;
        Self::of(RowWriter::new(stream, columns.iter().map(String::as_str)), world)
    }

    /// Continues a trajectory that already has a header, and possibly rows.
    ///
    /// # Errors
    /// A world of several bodies.
    pub fn after(stream: W, world: &World) -> io::Result<Self> {
        Self::of(RowWriter::after(stream), world)
    }

    fn of(rows: RowWriter<W>, world: &World) -> io::Result<Self> {
        let points = points(world)?;
        let layout = Layout::new(points);
        Ok(Self {
            rows,
            world: world.clone(),
            kept: RowChoice::ALL,
            layout,
            step: vec![0.0; layout.variables() - STATE.end],
            carrying: vec![false; points],
        })
    }

    /// Writes only every `every`-th step, counted from the step `first`, and the last state.
    ///
    /// 0 means every step.
    #[must_use]
    pub fn every(mut self, every: u64, first: u64) -> Self {
        self.kept = RowChoice::new(every, first);
        self
    }

    /// Writes the row of a step, if the step is selected.
    ///
    /// # Errors
    /// The errors of the stream; a record without a state or with a contact of a nonexistent point.
    /// Nothing is written for such a record.
    pub fn write(&mut self, record: &StepRecord) -> io::Result<()> {
        if !self.kept.has(record.index, record.report.status) {
            return Ok(());
        }
        let is_end = record.report.status == StepStatus::End;
        // k h with one rounding, so that times do not drift.
        let time = record.index as f64 * self.world.time_step();
        let (Some(state), Some(next)) = (record.states.first(), record.solution.states.first())
        else {
            return Err(refused("the record has no state of a body"));
        };
        let contacts = record.contacts.iter().zip(&record.solution.contacts);
        let contacts = contacts.map(|(contact, found)| WrittenContact {
            contact,
            force: found.force,
            slip: found.slip.norm(),
            carries_force: found.carries_force(),
        });
        self.fill(state, next, contacts)?;
        let residual = if is_end { 0.0 } else { record.certificate.residual() };
        let StepReport { status, iterations, .. } = record.report;
        let share = record.restitution_share;
        self.row(RowEnds { index: record.index, time, status, iterations, residual, share }, state)
    }

    /// Writes the row of a step given as [tables](crate::output::tables), for one body and the
    /// ground.
    ///
    /// The step ends at the state `next`. The result equals that of [`TrajectoryWriter::write`] for
    /// the step's record.
    ///
    /// # Errors
    /// The errors of the stream; a step without a state or with a contact of a nonexistent point.
    pub fn write_step(&mut self, step: &TableStep, next: &State) -> io::Result<()> {
        let StepRow { index, time, status, iterations, residual, restitution_share, .. } = step.row;
        if !self.kept.has(index, status) {
            return Ok(());
        }
        let state = step.states.first();
        let state = state.ok_or_else(|| refused("the step has no state of a body"))?;
        let contact = |row: &ContactRow| row.contact(&self.world, &step.states);
        let contacts: Result<Vec<_>, _> = step.contacts.iter().map(contact).collect();
        let contacts =
            contacts.map_err(|_| refused("the step has a contact that the body does not have"))?;
        let found = contacts.iter().zip(&step.contacts).map(|(contact, row)| WrittenContact {
            contact,
            force: row.force,
            slip: row.slip.norm(),
            carries_force: row.normal.dot(&row.force) > 0.0,
        });
        self.fill(state, next, found)?;
        let share = restitution_share;
        self.row(RowEnds { index, time, status, iterations, residual, share }, state)
    }

    fn row(&mut self, ends: RowEnds, state: &State) -> io::Result<()> {
        let RowEnds { index, time, status, iterations, residual, share } = ends;
        let Self { rows, .. } = self;
        rows.whole(index);
        rows.number(time);
        rows.numbers(state.to_vector().as_slice());
        rows.numbers(&self.step);
        self.carrying.iter().for_each(|carries| rows.whole((*carries).into()));
        rows.text(status.name());
        rows.whole(iterations.into());
        rows.number(residual);
        if self.world.has_restitution() {
            rows.number(share);
        }
        rows.end_row()
    }

    /// Fills the columns of the contacts for a step between two states.
    fn fill<'c>(
        &mut self,
        state: &State,
        next: &State,
        contacts: impl Iterator<Item = WrittenContact<'c>>,
    ) -> io::Result<()> {
        self.step.fill(0.0);
        self.carrying.fill(false);
        let (states, next) = (std::slice::from_ref(state), std::slice::from_ref(next));
        for WrittenContact { contact, force, slip, carries_force } in contacts {
            if contact.key.body != 0 || contact.key.point >= self.carrying.len() {
                return Err(refused(
                    "the record has a contact at a point that the body does not have",
                ));
            }
            let products = program_columns(&self.world, contact, states, next, force, slip);
            let Products { normal, friction, slip_speed } = products;
            let values = [force[0], force[1], force[2], normal, friction, slip_speed];
            let places = self.layout.contact_variables(contact.key.point);
            for (place, value) in places.into_iter().zip(values) {
                self.step[place - STATE.end] = value;
            }
            self.carrying[contact.key.point] = carries_force;
        }
        Ok(())
    }

    /// Flushes and returns the stream, with all rows written so far.
    ///
    /// # Errors
    /// The errors of the stream.
    pub fn flushed(&mut self) -> io::Result<&mut W> {
        self.rows.flushed()
    }

    /// Flushes and returns the stream. The last rows may be missing from it before this call.
    ///
    /// # Errors
    /// The errors of the stream.
    pub fn finish(self) -> io::Result<W> {
        self.rows.finish()
    }
}

/// Number of contact points of the only body of `world`.
fn points(world: &World) -> io::Result<usize> {
    match world.bodies() {
        [body] => Ok(body.contact_points().len()),
        _ => Err(refused("a trajectory has one body, but the world has several")),
    }
}

/// Columns for the only body of `world`.
fn columns(world: &World) -> io::Result<Vec<String>> {
    Ok(header(points(world)?, world.has_restitution()))
}

/// Columns `s1`, `s2` and `lam` of a contact with the ground.
///
/// The first body has this contact in a step from `states` to `next`, with the force `force` (N,
/// world) and the slip speed `slip` (m/s).
#[must_use]
pub fn program_columns(
    world: &World,
    contact: &Contact,
    states: &[State],
    next: &[State],
    force: Vector3<f64>,
    slip: f64,
) -> Products {
    let (h, normal) = (world.time_step(), contact.normal());
    let pose = next[contact.key.body].pose();
    let opening = normal * (contact.gap_at(&pose, None) / h);
    let height = match contact.bounces() {
        true => h * normal.dot(&contact.law_motion(opening, world, states, next)),
        false => contact.gap_at(&pose, None),
    };
    let noise = rounding::gap(&normal, &pose.position, contact.features.offset, &contact.arm);
    let height = if height.abs() <= noise { 0.0 } else { height };
    let force = contact.frame.tr_mul(&force);
    let products = products(&force, slip, height, contact.law.friction, SMOOTHING);
    // Slip that moves the point by less than rounding counts as zero.
    let sticks = slip * h <= noise;
    Products { friction: if sticks { 0.0 } else { products.friction }, ..products }
}

fn refused(why: &'static str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, why)
}

/// Contact of a row.
struct WrittenContact<'a> {
    contact: &'a Contact,
    /// Force (N), world frame.
    force: Vector3<f64>,
    /// Slip speed (m/s).
    slip: f64,
    carries_force: bool,
}

/// First and last columns of a row.
struct RowEnds {
    index: u64,
    /// Time (s).
    time: f64,
    status: StepStatus,
    iterations: u32,
    /// Residual (m/s).
    residual: f64,
    /// Share of the restitution that was applied in the step.
    share: f64,
}

/// Row read from a trajectory.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectoryRow {
    /// Step index k.
    pub index: u64,
    /// Time t (s).
    pub time: f64,
    /// State X at step k.
    pub state: State,
    /// Variables of the program after X⁺: f_x, f_y, f_z, s1, s2, λ of all points.
    pub step: Vec<f64>,
    /// Column `alpha` of each point: true if it carries a force.
    pub carrying: Vec<bool>,
    /// Status of the step.
    pub status: StepStatus,
    /// Iterations of the solver.
    pub iterations: u32,
    /// Residual in the file (m/s), column `certificate_m_s`.
    pub residual: f64,
    /// Column `restitution_share`; 1 in a file without the column.
    pub restitution_share: f64,
}

impl TrajectoryRow {
    /// Force f_i of the ground on point `i` (N), world frame; NaN if there is no such point.
    #[must_use]
    pub fn force(&self, i: usize) -> Vector3<f64> {
        let n = self.carrying.len();
        let component = |k: usize| self.step.get(i + k * n).filter(|_| i < n);
        Vector3::from_fn(|k, _| component(k).copied().unwrap_or(f64::NAN))
    }

    /// Values s1 (N m), s2 (W) and λ (m/s) of point `i`; NaN if there is no such point.
    #[must_use]
    pub fn products(&self, i: usize) -> Products {
        let n = self.carrying.len();
        let value = |k: usize| self.step.get(i + k * n).filter(|_| i < n).copied();
        let [normal, friction, slip_speed] = [3, 4, 5].map(|k| value(k).unwrap_or(f64::NAN));
        Products { normal, friction, slip_speed }
    }

    /// Forces f_i of all points (N).
    pub fn forces(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        (0..self.carrying.len()).map(|i| self.force(i))
    }
}

/// Reads a trajectory row by row and checks the header, the order and every field.
///
/// A row is limited to [`MOST_ROW_BYTES`](super::MOST_ROW_BYTES), so that memory is bounded.
pub struct TrajectoryReader<R: Read> {
    sheet: TableReader<R>,
    contacts: usize,
    bounce: bool,
    steps: Steps,
    ended: bool,
}

impl<R: Read> TrajectoryReader<R> {
    /// Reads and checks the header, which determines the number of contact points.
    ///
    /// # Errors
    /// [`RowsError::Header`], [`RowsError::TooLong`], or the errors of the stream.
    pub fn new(stream: R) -> Result<Self, RowsError> {
        let (mut contacts, mut bounce) = (1, false);
        let sheet = TableReader::new("", stream, |found| {
            bounce = found.iter().next_back() == Some(SHARE_COLUMN);
            let fixed = STATE_COLUMNS.len() + REPORT_COLUMNS.len() + usize::from(bounce);
            // Rounded to the nearest number, so that one missing column is reported as such.
            let per_contact = CONTACT_COLUMNS.len();
            let found = (found.len() + per_contact / 2).saturating_sub(fixed);
            contacts = (found / per_contact).max(1);
            header(contacts, bounce)
        })?;
        Ok(Self { sheet, contacts, bounce, steps: Steps::default(), ended: false })
    }

    /// Requires `index` as the first k.
    #[must_use]
    pub fn from_index(mut self, index: u64) -> Self {
        self.steps.begin_at(index);
        self
    }

    /// Accepts any first k.
    #[must_use]
    pub fn of_part(mut self) -> Self {
        self.steps.begin_anywhere();
        self
    }

    /// Expects rows of every `every`-th step and of the last state.
    #[must_use]
    pub fn every(mut self, every: u64) -> Self {
        self.steps.every(every);
        self
    }

    /// Number of contact points n.
    #[must_use]
    pub fn contacts(&self) -> usize {
        self.contacts
    }

    /// Next row; `None` after the row of status `end`.
    ///
    /// # Errors
    /// The first fault of the row, with line and column.
    pub fn next_row(&mut self) -> Result<Option<TrajectoryRow>, RowsError> {
        let sheet = &mut self.sheet;
        if self.ended {
            sheet.need_end("there are rows after the one with status `end`")?;
            return Ok(None);
        }
        sheet.need_row(
            "the file has no row with status `end`: it is cut off, or not a trajectory",
        )?;
        let n = self.contacts;
        let first_step = STATE_COLUMNS.len();
        let first_alpha = first_step + 6 * n;
        let first_report = first_alpha + n;
        let status = sheet.field(first_report, "a status", StepStatus::from_name)?;
        let index = self.steps.next(sheet, status)?;
        let flag = |text: &str| match text {
            "0" => Some(false),
            "1" => Some(true),
            _ => None,
        };
        let share = |text: &str| text.parse().ok().filter(|share| (0.0..=1.0).contains(share));
        let row = TrajectoryRow {
            index,
            time: sheet.number(1)?,
            state: State::from_vector(&sheet.numbers::<13>(2)?.into()),
            step: (first_step..first_alpha).map(|k| sheet.number(k)).collect::<Result<_, _>>()?,
            carrying: (first_alpha..first_report)
                .map(|k| sheet.field(k, "0 or 1", flag))
                .collect::<Result<_, _>>()?,
            status,
            iterations: sheet.whole(first_report + 1)?,
            residual: sheet.number(first_report + 2)?,
            restitution_share: match self.bounce {
                true => sheet.field(first_report + 3, "a share from 0 to 1", share)?,
                false => 1.0,
            },
        };
        self.ended = row.status == StepStatus::End;
        Ok(Some(row))
    }
}

/// The columns of a contact point follow the decision vector: both must change together.
const _: () = assert!(Layout::new(1).variables() - STATE.end + 1 == CONTACT_COLUMNS.len());
