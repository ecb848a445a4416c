//! Rows of contacts that stay the same over several steps.
//!
//! A resting contact has the same numbers in each step. The table `contacts` has one row for a run of
//! such steps, from `k` to `last_k`. A run has only whole steps, which are neighbours among the steps
//! with rows. All runs end after each [`LONGEST`] steps with rows. So the rows have the order of `k` and
//! `contact`, the writer holds back few, and the runs of a contact do not depend on other contacts.

use super::ContactRow;
use super::columns::{Cells, RowCells, StepRow};
use crate::output::csv_reader::{CsvReader, RowsError};
use crate::output::rows::RowWriter;
use serde::{Deserialize, Serialize};
use std::io::{self, Read, Write};

/// Largest number of steps of a run. With more, the writer would hold back more rows.
const LONGEST: u32 = 32;

/// A row of a contact, and the steps in which it holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct ContactRun {
    first: u64,
    last: u64,
    row: ContactRow,
}

/// Runs that are not written yet, because they or earlier ones may go on.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct OpenRuns {
    runs: Vec<ContactRun>,
    /// Places of the contacts of the last interval in `runs`; empty if none can go on.
    last: Vec<usize>,
    /// Number of intervals so far, modulo [`LONGEST`].
    intervals: u32,
}

impl OpenRuns {
    /// Adds the `rows` of the interval of `step`, which is a whole step if `is_whole`. Writes the runs
    /// before them to `table`, without the `missing` last columns, once none of them goes on.
    pub fn add<W: Write>(
        &mut self,
        step: &StepRow,
        is_whole: bool,
        rows: impl Iterator<Item = ContactRow>,
        table: &mut RowWriter<W>,
        missing: usize,
    ) -> io::Result<()> {
        let before = std::mem::take(&mut self.last);
        let goes_on = is_whole && self.intervals > 0;
        self.intervals = (self.intervals + 1) % LONGEST;
        let mut before = before.into_iter().filter(|_| goes_on).peekable();
        let first = self.runs.len();
        let mut has_long = false;
        for row in rows {
            let is_earlier = |place: &usize| self.runs[*place].row.index < row.index;
            while before.next_if(is_earlier).is_some() {}
            let place = match before.next_if(|place| is_same(&self.runs[*place].row, &row)) {
                Some(place) => {
                    self.runs[place].last = step.index;
                    has_long = true;
                    place
                }
                None => {
                    self.runs.push(ContactRun { first: step.index, last: step.index, row });
                    self.runs.len() - 1
                }
            };
            self.last.push(place);
        }
        if !has_long {
            self.write(first, table, missing)?;
            self.last.iter_mut().for_each(|place| *place -= first);
        }
        if !is_whole {
            self.last.clear();
        }
        Ok(())
    }

    /// Writes all runs.
    pub fn finish<W: Write>(&mut self, table: &mut RowWriter<W>, missing: usize) -> io::Result<()> {
        self.write(self.runs.len(), table, missing)
    }

    /// Writes the first `count` runs.
    fn write<W: Write>(
        &mut self,
        count: usize,
        table: &mut RowWriter<W>,
        missing: usize,
    ) -> io::Result<()> {
        for ContactRun { first, last, row } in self.runs.drain(..count) {
            table.whole(first);
            table.whole(last);
            row.write(table);
            (0..missing).for_each(|_| table.drop_cell());
            table.end_row()?;
        }
        Ok(())
    }
}

/// True if two rows have the same text: 0 and −0 differ.
fn is_same(one: &ContactRow, other: &ContactRow) -> bool {
    let signs = |row: &ContactRow| {
        let ContactRow { point, normal, force, slip, moment, gap, rebound, .. } = row;
        let vectors = [point, normal, force, slip, moment].map(|vector| vector.map(f64::to_bits));
        (vectors, gap.to_bits(), rebound.to_bits())
    };
    one == other && signs(one) == signs(other)
}

/// Reader of runs: those that go on after the interval read last.
#[derive(Debug, Default)]
pub(super) struct ReadRuns(Vec<ContactRun>);

impl ReadRuns {
    /// Reads the contacts of the interval of `step`. Unless `all` are required, some may be missing.
    pub fn next<R: Read>(
        &mut self,
        reader: &mut CsvReader<R>,
        step: &StepRow,
        all: bool,
    ) -> Result<Vec<ContactRow>, RowsError> {
        let Self(runs) = self;
        // Only the first interval of a step can be a whole one.
        let from = step.index + u64::from(step.interval > 0);
        runs.retain(|run| run.last >= from);
        let broken = "a row lasts into a step of several intervals, or of fewer contacts";
        let fits = |run: &ContactRun| {
            let ContactRow { index, interval, length, .. } = run.row;
            (interval, length) == (step.interval, step.length) && index < step.contacts
        };
        if !runs.iter().all(fits) {
            return Err(RowsError::End { table: "contacts", why: broken });
        }
        let lasting: Vec<_> = runs.iter().map(|run| run.row.index).collect();
        let free = |from: usize| (from..).find(|index| lasting.binary_search(index).is_err());
        let mut next = free(0).unwrap_or(0);
        while next < step.contacts {
            if !all && !reader.next_is_of(step.index, step.interval)? {
                break;
            }
            reader.need_row(CUT_OFF)?;
            reader.expect(0, step.index)?;
            reader.expect_interval(step.interval, step.length)?;
            if all {
                reader.expect(2, next as u64)?;
            }
            let last = reader.whole(1)?;
            if last < step.index {
                return Err(reader.invalid(1, "the same step as `k`, or a later one"));
            }
            let row = ContactRow::read(&mut RowCells::from(reader, 2))?;
            let is_free = lasting.binary_search(&row.index).is_err();
            if !((next..step.contacts).contains(&row.index) && is_free) {
                return Err(reader.invalid(2, "the index of a later contact without a row"));
            }
            next = free(row.index + 1).unwrap_or(step.contacts);
            runs.push(ContactRun { first: step.index, last, row });
        }
        runs.sort_by_key(|run| run.row.index);
        Ok(runs.iter().map(|run| run.row.clone()).collect())
    }
}

/// Description of a table that ends too early.
pub(super) const CUT_OFF: &str = "it ends before the row with status `end`: it is cut off, or from another \
                                  run";

#[cfg(test)]
#[path = "tests/contact_runs.rs"]
mod tests;
