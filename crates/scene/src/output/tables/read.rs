//! Reader of tables. It checks headers, the order of rows and every field.

use super::columns::{Cells, ContactRow, GearTableRow, JointRow, RowCells, StateRow, StepRow};
use super::contact_runs::{CUT_OFF, ReadRuns};
use super::{Streams, Table, TableShape};
use crate::output::csv_reader::{CsvReader, RowsError, Steps};
use std::io::Read;
use std::sync::Arc;
use tumble_core::joint::{Joint, JointForce};
use tumble_core::mechanics::State;
use tumble_core::simulation::kick;
use tumble_core::step::StepStatus;
use tumble_core::world::{Impacts, Span, World};

/// Rows of an interval.
#[derive(Debug, Clone, PartialEq)]
pub struct IntervalRows {
    /// Row of the table `steps`.
    pub row: StepRow,
    /// States from which the interval starts, one per body, in a run with middle velocities with
    /// those.
    pub states: Vec<State>,
    /// States at its start with the velocities of the instant; empty if `states` has them.
    pub instants: Vec<State>,
    /// Lengths of the intervals to whose middles the velocities in `states` belong (s), 0 for bodies that
    /// start, in a run with middle velocities.
    pub before: Box<[f64]>,
    /// State of each body at its end. Read from tables, it is empty if the next interval starts there.
    pub ends: Vec<State>,
    /// Contacts of the interval, in the memory of those before if they are equal.
    pub contacts: Arc<Vec<ContactRow>>,
    /// Flags of contacts that add nothing to the residual: without force and rebound, they end with a gap
    /// of 0 or more. Read from tables, it is empty.
    pub idle: Vec<bool>,
    /// Row of each joint of the world.
    pub joints: Vec<JointRow>,
    /// Row of each gear of the world.
    pub gears: Vec<GearTableRow>,
}

impl IntervalRows {
    /// Part of the step that this interval covers in a run of `world`; `None` for a whole step. A
    /// length that differs from the one of the step by rounding is the whole.
    pub fn span(&self, world: &World) -> Option<Span> {
        let Self { row: StepRow { index, time, length, usual, status, .. }, .. } = *self;
        let is_located = world.impacts() == Impacts::Located;
        let is_retry = status == StepStatus::Substepped && !is_located;
        let since = time - index as f64 * world.whole_step();
        // A shorter interval of a step that failed removes its share of what is left of a depth.
        let left = ((world.whole_step() - since) / length).round();
        let usual = match (is_located, is_retry) {
            (true, _) => usual,
            (false, true) => length * left,
            (false, false) => world.whole_step(),
        };
        let is_part = is_located || is_retry || length != world.whole_step();
        (is_part && length > 0.0).then_some(Span { since, length, usual, is_retry })
    }

    /// Time κ over which the forces on `body`, or between it and `other`, act, in lengths of the interval
    /// (eq. 37).
    pub fn kick(&self, body: usize, other: Option<usize>) -> f64 {
        kick(&self.before, self.row.length, body, other)
    }

    /// Forces of the joints of `world` in the problem of the interval, with the angles at k.
    pub fn joint_forces(&self, world: &World) -> Vec<JointForce> {
        let pairs = world.joints().iter().zip(&self.joints);
        let force = |(joint, row): (&Joint, &JointRow)| {
            let kick = self.kick(joint.body(), joint.other());
            JointForce { force: row.force * kick, torque: row.torque * kick, angles: row.turns }
        };
        pairs.map(force).collect()
    }

    /// Force of the gear with this `index` in the problem of the interval (N or N m).
    pub fn gear_force(&self, world: &World, index: usize) -> f64 {
        let joint = &world.joints()[world.gears()[index].axes()[0].joint];
        self.gears[index].force * self.kick(joint.body(), joint.other())
    }

    /// Leaves out what the rows of the `next` interval have too: its ends, and one of two equal lists of contacts.
    pub fn share_with(&mut self, next: &mut Self) {
        if self.ends == next.states {
            self.ends = Vec::new();
        }
        if self.contacts == next.contacts {
            next.contacts = Arc::clone(&self.contacts);
        }
    }

    /// Leaves out contacts and middle velocities, for a recording of the motion. All bodies then start at each row.
    pub fn keep_motion(&mut self) {
        if !self.instants.is_empty() {
            self.states = std::mem::take(&mut self.instants);
        }
        self.before.fill(0.0);
        (self.ends, self.idle) = (Vec::new(), Vec::new());
        (self.contacts, self.row.contacts) = (Arc::default(), 0);
    }

    /// States at its start with the velocities of the instant.
    pub fn instant_states(&self) -> &[State] {
        if self.instants.is_empty() { &self.states } else { &self.instants }
    }
}

const TOO_LONG: &str = "there are rows after the step with status `end`";

/// Reads the tables of a run interval by interval. It keeps one interval in memory.
pub struct TablesReader<R: Read> {
    readers: Streams<CsvReader<R>>,
    shape: TableShape,
    order: Steps,
    loaded_contacts: bool,
    is_short: bool,
    runs: ReadRuns,
    last: LastRows,
    ended: bool,
}

/// States in the last rows, with the number of their interval and its length.
#[derive(Default)]
struct LastRows {
    rows: Vec<StateRow>,
    interval: u32,
    length: f64,
}

impl<R: Read> TablesReader<R> {
    /// Reads and checks the headers of the tables of a run with the given numbers of objects.
    ///
    /// # Errors
    /// [`RowsError::Header`], the errors of a stream, or a missing table of contacts, joints or
    /// gears.
    pub fn new(streams: Streams<R>, shape: TableShape) -> Result<Self, RowsError> {
        let reader = Self::with_optional_tables(streams, shape)?;
        let Streams { contacts, joints, gears, .. } = &reader.readers;
        let mut needed = [
            (Table::Contacts, contacts.is_some()),
            (Table::Joints, joints.is_some() || shape.joints == 0),
            (Table::Gears, gears.is_some() || shape.gears == 0),
        ]
        .into_iter();
        match needed.find(|(_, is_there)| !is_there) {
            Some((table, _)) => Err(RowsError::End { table: table.name(), why: "it is missing" }),
            None => Ok(reader),
        }
    }

    /// Reader for a run with missing tables. The steps have no rows of these tables.
    ///
    /// # Errors
    /// [`RowsError::Header`], or the errors of a stream.
    pub fn with_optional_tables(streams: Streams<R>, shape: TableShape) -> Result<Self, RowsError> {
        let csv =
            |table: Table, stream| CsvReader::new(table.name(), stream, table.columns(&shape));
        let readers = streams.each(csv)?;
        let order = Steps::default();
        let runs = ReadRuns::default();
        Ok(Self {
            readers,
            shape,
            order,
            loaded_contacts: false,
            is_short: false,
            runs,
            last: LastRows::default(),
            ended: false,
        })
    }

    /// Requires `index` as the first k.
    #[must_use]
    pub fn from_index(mut self, index: u64) -> Self {
        self.order.at = index;
        self
    }

    /// Accepts any first k, for a part of a run.
    #[must_use]
    pub fn from_any_index(mut self) -> Self {
        self.order.anywhere = true;
        self
    }

    /// Expects rows of every `every`-th step and of the last state.
    #[must_use]
    pub fn every(mut self, every: u64) -> Self {
        self.order.every = every.max(1);
        self
    }

    /// If `idle` is true, contacts may have no rows, see [`TablesWriter::without_idle_contacts`].
    ///
    /// [`TablesWriter::without_idle_contacts`]: super::TablesWriter::without_idle_contacts
    #[must_use]
    pub fn without_idle_contacts(mut self, idle: bool) -> Self {
        self.loaded_contacts = idle;
        self
    }

    /// If `is_short` is true, unchanged states may have no rows, see [`TablesWriter::short`].
    ///
    /// [`TablesWriter::short`]: super::TablesWriter::short
    #[must_use]
    pub fn short(mut self, is_short: bool) -> Self {
        self.is_short = is_short;
        self
    }

    /// Next interval; `None` after the row of status `end`.
    ///
    /// # Errors
    /// The first fault, with table, line and column.
    pub fn next_interval(&mut self) -> Result<Option<IntervalRows>, RowsError> {
        let Self { readers, runs, last, .. } = self;
        let Streams { states: of_bodies, contacts, steps, joints, gears, ends } = readers;
        if self.ended {
            let some = [contacts, joints, gears, ends].into_iter().flatten();
            for reader in [of_bodies, steps].into_iter().chain(some) {
                reader.need_end(TOO_LONG)?;
            }
            return Ok(None);
        }
        let TableShape { bodies, has_middles, .. } = self.shape;
        steps.need_row(CUT_OFF)?;
        let status = steps.field(2, "a status", StepStatus::from_name)?;
        let row = StepRow::read(&mut RowCells::from(steps, 0))?;
        self.order.next(steps, status, row.interval)?;
        // Only a whole step after another one may lack rows.
        let follows = (row.interval, last.interval, row.length) == (0, 0, last.length);
        if !(self.is_short && follows) {
            last.rows.clear();
        }
        // Grows with the rows in the file: the requested number is not trustworthy.
        let mut rows = Vec::new();
        for body in 0..bodies {
            let known = last.rows.get(body);
            let has_row = known.is_none() || next_is_of_body(of_bodies, &row, body)?;
            rows.push(match known.filter(|_| !has_row) {
                Some(known) => *known,
                None if has_middles => read_row(of_bodies, &row, body)?,
                None => read_row(of_bodies, &row, body).map(StateRow::without_middle)?,
            });
        }
        let (states, mut instants, mut before) = rows
            .iter()
            .map(|row| (row.at_the_middle(), row.instant, row.before))
            .collect::<(Vec<_>, Vec<_>, Vec<_>)>();
        if !has_middles {
            (instants, before) = Default::default();
        }
        *last = LastRows { rows, interval: row.interval, length: row.length };
        let mut end_rows = Vec::new();
        if let Some(reader) = ends
            && reader.next_is_of(row.index, row.interval)?
        {
            end_rows = rows_of(reader, &row, bodies)?;
        }
        let all = !self.loaded_contacts;
        let contacts = contacts.as_mut().map(|reader| runs.next(reader, &row, all));
        let contacts = contacts.transpose()?.unwrap_or_default();
        let joints = joints.as_mut().map(|reader| rows_of(reader, &row, self.shape.joints));
        let gears = gears.as_mut().map(|reader| rows_of(reader, &row, self.shape.gears));
        let (joints, gears) = (joints.transpose()?, gears.transpose()?);
        let (joints, gears) = (joints.unwrap_or_default(), gears.unwrap_or_default());
        self.ended = status == StepStatus::End;
        Ok(Some(IntervalRows {
            row,
            states,
            instants,
            before: before.into(),
            ends: end_rows,
            idle: Vec::new(),
            contacts: Arc::new(contacts),
            joints,
            gears,
        }))
    }
}

/// Reads the rows of all bodies, joints or gears of an interval, and checks their first three columns and
/// their interval.
fn rows_of<R: Read, T: Cells>(
    reader: &mut CsvReader<R>,
    step: &StepRow,
    count: usize,
) -> Result<Vec<T>, RowsError> {
    let mut rows = Vec::with_capacity(count.min(1 << 12));
    for number in 0..count {
        rows.push(read_row(reader, step, number)?);
    }
    Ok(rows)
}

/// True if the next row is that of a body in an interval, and false if it is a later one.
fn next_is_of_body<R: Read>(
    reader: &mut CsvReader<R>,
    step: &StepRow,
    body: usize,
) -> Result<bool, RowsError> {
    if !reader.next_is_of(step.index, step.interval)? {
        return Ok(false);
    }
    if reader.whole::<usize>(2)? < body {
        reader.expect(2, body as u64)?;
    }
    Ok(reader.whole::<usize>(2)? == body)
}

/// Reads the row of the body, joint or gear `number` of an interval.
fn read_row<R: Read, T: Cells>(
    reader: &mut CsvReader<R>,
    step: &StepRow,
    number: usize,
) -> Result<T, RowsError> {
    reader.need_row(CUT_OFF)?;
    reader.expect(0, step.index)?;
    reader.expect(2, number as u64)?;
    if reader.number(1)? != step.time {
        return Err(reader.invalid(1, "the time of the same step in the table steps"));
    }
    reader.expect_interval(step.interval, step.length)?;
    T::read(&mut RowCells::from(reader, 3))
}
