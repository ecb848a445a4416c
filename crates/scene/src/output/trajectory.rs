//! A trajectory of one body as CSV: one row a step, from the step's [record](StepRecord), in
//! and out of any stream.
//!
//! Columns, for a body of n contact points: `k,t_s`, the 13 numbers of the state at step k, then
//! of the step k → k+1 what the tutorial's program has of each point (`fx…,fy…,fz…` in N,
//! world, `s1_…` in N m, `s2_…` in W, `lam…` in m/s, `alpha…`), then
//! `status,iterations,certificate_m_s`. A point that is no contact has zeros. `s1` and `s2` are
//! the least slacks of the row's forces and motion, `lam` its slip speed
//! ([`products`]), and `alpha` is 1 where the point carries a force. The last row is a state
//! without a step: its step columns are 0 and its status is `end`. Numbers have the fewest
//! digits that read back to the same double.
//!
//! In a world with restitution a last column, `restitution_share`, has the part of the coefficients
//! that the step took ([`StepRecord::restitution_share`]).

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

/// The names of the columns before the per-contact ones.
const STATE_COLUMNS: [&str; 15] = [
    "k", "t_s", "x_m", "y_m", "z_m", "qw", "qx", "qy", "qz", "vx_m_s", "vy_m_s", "vz_m_s",
    "wx_rad_s", "wy_rad_s", "wz_rad_s",
];

/// Prefix and suffix of the per-contact columns, in the order of the decision vector,
/// α last.
const CONTACT_COLUMNS: [(&str, &str); 7] = [
    ("fx", "_N"),
    ("fy", "_N"),
    ("fz", "_N"),
    ("s1_", ""),
    ("s2_", ""),
    ("lam", ""),
    ("alpha", ""),
];

/// The names of the columns after the per-contact ones.
const REPORT_COLUMNS: [&str; 3] = ["status", "iterations", "certificate_m_s"];

/// The last column in a world with restitution.
const SHARE_COLUMN: &str = "restitution_share";

/// The header for `contacts` contact points, which may bounce or not.
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
    /// What stands in a row between state and flags.
    step: Vec<f64>,
    carrying: Vec<bool>,
}

impl<W: Write> TrajectoryWriter<W> {
    /// Writes the header of a trajectory of the one body of `world`.
    ///
    /// # Errors
    /// A world of several bodies, whose steps are
    /// [tables](crate::output::tables::TablesWriter); the stream's.
    pub fn new(stream: W, world: &World) -> io::Result<Self> {
        let columns = columns(world)?;
        Self::of(RowWriter::new(stream, columns.iter().map(String::as_str)), world)
    }

    /// Goes on where the header stands in the stream already, and maybe rows.
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

    /// The same of each `every`-th step alone, counted from the step `first`, and of the last state; every one for 0.
    #[must_use]
    pub fn every(mut self, every: u64, first: u64) -> Self {
        self.kept = RowChoice::new(every, first);
        self
    }

    /// Writes the row of a step, if it is one that has a row.
    ///
    /// # Errors
    /// The stream's; a record without a state, or with a contact of a point that the body does not
    /// have, of which nothing is written.
    pub fn write(&mut self, record: &StepRecord) -> io::Result<()> {
        if !self.kept.has(record.index, record.report.status) {
            return Ok(());
        }
        let is_end = record.report.status == StepStatus::End;
        // k h in one rounding, so that times do not drift.
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

    /// Writes the row of a step of the [tables](crate::output::tables) of a run of one body and the ground, which ends at the
    /// state `next`: with the bytes that [`TrajectoryWriter::write`] writes of its record.
    ///
    /// # Errors
    /// The stream's; a step without a state, or with contacts that the body does not have.
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

    /// The columns of the contacts of a step between two states.
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
                return Err(refused("the record has a contact of a point that the body has not"));
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

    /// The stream, flushed: with all rows written so far.
    ///
    /// # Errors
    /// The stream's.
    pub fn flushed(&mut self) -> io::Result<&mut W> {
        self.rows.flushed()
    }

    /// Flushes and gives the stream back. Before, the last rows may not be in it.
    ///
    /// # Errors
    /// The stream's.
    pub fn finish(self) -> io::Result<W> {
        self.rows.finish()
    }
}

/// The contact points of the one body of `world`.
fn points(world: &World) -> io::Result<usize> {
    match world.bodies() {
        [body] => Ok(body.contact_points().len()),
        _ => Err(refused("a trajectory is of one body, and the world has several")),
    }
}

/// The columns of the one body of `world`.
fn columns(world: &World) -> io::Result<Vec<String>> {
    Ok(header(points(world)?, world.has_restitution()))
}

/// What the program has of a contact with the ground besides its force: the columns `s1`, `s2` and
/// `lam` of a step from `states` to `next`, of a contact of the first body with a force (N, world) that slips so fast (m/s).
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
    // A slip that moves the point by no more than rounding makes no product.
    let sticks = slip * h <= noise;
    Products { friction: if sticks { 0.0 } else { products.friction }, ..products }
}

fn refused(why: &'static str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, why)
}

/// A contact of a row.
struct WrittenContact<'a> {
    contact: &'a Contact,
    /// N, world.
    force: Vector3<f64>,
    /// m/s.
    slip: f64,
    carries_force: bool,
}

/// The first and the last columns of a row.
struct RowEnds {
    index: u64,
    /// s.
    time: f64,
    status: StepStatus,
    iterations: u32,
    /// m/s.
    residual: f64,
    /// The part of the rebounds that the step was given.
    share: f64,
}

/// One row as it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct TrajectoryRow {
    /// k.
    pub index: u64,
    /// t, s.
    pub time: f64,
    /// X at step k.
    pub state: State,
    /// f_x, f_y, f_z, s1, s2, λ of all points: the program's variables after X⁺.
    pub step: Vec<f64>,
    /// Whether each point carries a force: `alpha`.
    pub carrying: Vec<bool>,
    /// How the step ended.
    pub status: StepStatus,
    /// Iterations of the solver.
    pub iterations: u32,
    /// The residual as the file has it, m/s: `certificate_m_s`.
    pub residual: f64,
    /// `restitution_share`; 1 in a file without that column.
    pub restitution_share: f64,
}

impl TrajectoryRow {
    /// f_i, N, world, ground on body; NaN where the row has no point `i`.
    #[must_use]
    pub fn force(&self, i: usize) -> Vector3<f64> {
        let n = self.carrying.len();
        let component = |k: usize| self.step.get(i + k * n).filter(|_| i < n);
        Vector3::from_fn(|k, _| component(k).copied().unwrap_or(f64::NAN))
    }

    /// s1 (N m), s2 (W) and λ (m/s) of point `i`; NaN where the row has no such point.
    #[must_use]
    pub fn products(&self, i: usize) -> Products {
        let n = self.carrying.len();
        let value = |k: usize| self.step.get(i + k * n).filter(|_| i < n).copied();
        let [normal, friction, slip_speed] = [3, 4, 5].map(|k| value(k).unwrap_or(f64::NAN));
        Products { normal, friction, slip_speed }
    }

    /// f_i of all contacts, N.
    pub fn forces(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        (0..self.carrying.len()).map(|i| self.force(i))
    }
}

/// Reads a trajectory row by row, checking header, order and every field. A row may have
/// [`MOST_ROW_BYTES`](super::MOST_ROW_BYTES), so that memory is bounded whatever the stream
/// holds.
pub struct TrajectoryReader<R: Read> {
    sheet: TableReader<R>,
    contacts: usize,
    bounce: bool,
    steps: Steps,
    ended: bool,
}

impl<R: Read> TrajectoryReader<R> {
    /// Reads and checks the header; the number of contact points follows from it.
    ///
    /// # Errors
    /// [`RowsError::Header`], [`RowsError::TooLong`], or the stream's.
    pub fn new(stream: R) -> Result<Self, RowsError> {
        let (mut contacts, mut bounce) = (1, false);
        let sheet = TableReader::new("", stream, |found| {
            bounce = found.iter().next_back() == Some(SHARE_COLUMN);
            let fixed = STATE_COLUMNS.len() + REPORT_COLUMNS.len() + usize::from(bounce);
            // To the nearest, so that one missing column is named for what it is.
            let per_contact = CONTACT_COLUMNS.len();
            let found = (found.len() + per_contact / 2).saturating_sub(fixed);
            contacts = (found / per_contact).max(1);
            header(contacts, bounce)
        })?;
        Ok(Self { sheet, contacts, bounce, steps: Steps::default(), ended: false })
    }

    /// The same of rows whose first k is `index`.
    #[must_use]
    pub fn from_index(mut self, index: u64) -> Self {
        self.steps.begin_at(index);
        self
    }

    /// The same of rows whose first k may be any.
    #[must_use]
    pub fn of_part(mut self) -> Self {
        self.steps.begin_anywhere();
        self
    }

    /// The same of rows of each `every`-th step, and of the last state.
    #[must_use]
    pub fn every(mut self, every: u64) -> Self {
        self.steps.every(every);
        self
    }

    /// n.
    #[must_use]
    pub fn contacts(&self) -> usize {
        self.contacts
    }

    /// The next row; `None` after the `end` row.
    ///
    /// # Errors
    /// The first thing wrong with the row, by line and column.
    pub fn next_row(&mut self) -> Result<Option<TrajectoryRow>, RowsError> {
        let sheet = &mut self.sheet;
        if self.ended {
            sheet.need_end("there are rows after the one of status `end`")?;
            return Ok(None);
        }
        sheet.need_row("the file has no row of status `end`: it is cut off, or no trajectory")?;
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

/// The number of per-contact columns follows the decision vector's; if one changes, so
/// must the other.
const _: () = assert!(Layout::new(1).variables() - STATE.end + 1 == CONTACT_COLUMNS.len());
