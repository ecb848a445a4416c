//! Reader of tables. It checks headers, the order of rows and every field.

use super::columns::{Cells, ContactRow, GearTableRow, JointRow, RowCells, StateRow, StepRow};
use super::{Streams, Table, TableShape};
use crate::output::csv_reader::{CsvReader, RowsError, Steps};
use std::io::Read;
use tumble_core::joint::JointForce;
use tumble_core::mechanics::State;
use tumble_core::step::StepStatus;

/// One step read from tables.
#[derive(Debug, Clone, PartialEq)]
pub struct TableStep {
    /// Row of the table `steps`.
    pub row: StepRow,
    /// States from which the step starts, one per body: X at step k, in a run with middle velocities
    /// with those.
    pub states: Vec<State>,
    /// States X at step k with the velocities of the instant; empty if `states` has them.
    pub instants: Vec<State>,
    /// State X of each body at step k+1. Empty for the last state and without a table `ends`.
    pub ends: Vec<State>,
    /// Contacts of the step k → k+1.
    pub contacts: Vec<ContactRow>,
    /// Row of each joint of the world.
    pub joints: Vec<JointRow>,
    /// Row of each gear of the world.
    pub gears: Vec<GearTableRow>,
}

impl TableStep {
    /// States X at step k with the velocities of the instant.
    #[must_use]
    pub fn instant_states(&self) -> &[State] {
        if self.instants.is_empty() { &self.states } else { &self.instants }
    }
}

impl JointRow {
    /// Force and torque of the joint, with the angles at k.
    #[must_use]
    pub fn forces(&self) -> JointForce {
        JointForce { force: self.force, torque: self.torque, angles: self.turns }
    }
}

const CUT_OFF: &str = "it ends before the row with status `end`: it is cut off, or from another \
                       run";
const TOO_LONG: &str = "there are rows after the step with status `end`";

/// Reads the tables of a run step by step. It keeps one step in memory.
pub struct TablesReader<R: Read> {
    readers: Streams<CsvReader<R>>,
    shape: TableShape,
    order: Steps,
    loaded_contacts: bool,
    ended: bool,
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
        Ok(Self { readers, shape, order, loaded_contacts: false, ended: false })
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

    /// Next step; `None` after the step of status `end`.
    ///
    /// # Errors
    /// The first fault, with table, line and column.
    pub fn next_step(&mut self) -> Result<Option<TableStep>, RowsError> {
        let Streams { states: of_bodies, contacts, steps, joints, gears, ends } = &mut self.readers;
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
        self.order.next(steps, status)?;
        let row = StepRow::read(&mut RowCells::from(steps, 0))?;
        // Grows with the rows in the file: the requested number is not trustworthy.
        let (states, instants) = if has_middles {
            let rows: Vec<StateRow> = rows_of(of_bodies, &row, bodies)?;
            rows.iter().map(|row| (row.at_the_middle(), row.instant)).unzip()
        } else {
            (rows_of(of_bodies, &row, bodies)?, Vec::new())
        };
        let ends = match ends {
            Some(reader) if status != StepStatus::End => rows_of(reader, &row, bodies)?,
            _ => Vec::new(),
        };
        let all = !self.loaded_contacts;
        let contacts = contacts.as_mut().map(|reader| contacts_of(reader, &row, all));
        let contacts = contacts.transpose()?.unwrap_or_default();
        let joints = joints.as_mut().map(|reader| rows_of(reader, &row, self.shape.joints));
        let gears = gears.as_mut().map(|reader| rows_of(reader, &row, self.shape.gears));
        let (joints, gears) = (joints.transpose()?, gears.transpose()?);
        let (joints, gears) = (joints.unwrap_or_default(), gears.unwrap_or_default());
        self.ended = status == StepStatus::End;
        Ok(Some(TableStep { row, states, instants, ends, contacts, joints, gears }))
    }
}

/// Reads the contacts of a step. Unless `all` are required, some may be missing.
fn contacts_of<R: Read>(
    reader: &mut CsvReader<R>,
    step: &StepRow,
    all: bool,
) -> Result<Vec<ContactRow>, RowsError> {
    let (mut rows, mut next) = (Vec::new(), 0);
    while next < step.contacts {
        if all {
            reader.need_row(CUT_OFF)?;
        } else if !reader.next_of_step(step.index)? {
            break;
        }
        reader.expect(0, step.index)?;
        if all {
            reader.expect(1, next as u64)?;
        }
        let row = ContactRow::read(&mut RowCells::from(reader, 1))?;
        if !(next..step.contacts).contains(&row.index) {
            return Err(reader.invalid(1, "the index of a later contact of the step"));
        }
        next = row.index + 1;
        rows.push(row);
    }
    Ok(rows)
}

/// Reads the rows of all bodies, joints or gears of a step, and checks their first three columns.
fn rows_of<R: Read, T: Cells>(
    reader: &mut CsvReader<R>,
    step: &StepRow,
    count: usize,
) -> Result<Vec<T>, RowsError> {
    let mut rows = Vec::with_capacity(count.min(1 << 12));
    for number in 0..count {
        reader.need_row(CUT_OFF)?;
        reader.expect(0, step.index)?;
        reader.expect(2, number as u64)?;
        if reader.number(1)? != step.time {
            return Err(reader.invalid(1, "the time of the same step in the table steps"));
        }
        rows.push(T::read(&mut RowCells::from(reader, 3))?);
    }
    Ok(rows)
}
