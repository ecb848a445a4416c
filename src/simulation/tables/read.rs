//! Rows become steps, every header, order and field checked.

use super::{KeyText, Streams, Table};
use crate::contact::Partner;
use crate::mechanics::State;
use crate::step::StepStatus;
use nalgebra::{SVector, Vector3};
use std::io::Read;

/// One step as it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct TableStep {
    /// Its row of the table `steps`.
    pub row: StepRow,
    /// X at step k, one a body.
    pub states: Vec<State>,
    /// The contacts of the step k → k+1.
    pub contacts: Vec<ContactRow>,
}

/// A row of the table `steps`.
#[derive(Debug, Clone, PartialEq)]
pub struct StepRow {
    /// k.
    pub index: u64,
    /// t, s.
    pub time: f64,
    /// How the step ended.
    pub status: StepStatus,
    /// Iterations of the solver.
    pub iterations: u32,
    /// The start that the solution came from; empty where no problem was solved.
    pub start: String,
    /// How many contacts the step had.
    pub contacts: usize,
    /// The residual, m/s.
    pub residual: f64,
    /// Its parts, m/s, in the order of [`Certificate::parts`](crate::contact::Certificate::parts).
    pub parts: [f64; 5],
    /// How deep pieces overlap at k+1, m.
    pub overlap: f64,
    /// The smallest part of the restitution that an island took.
    pub restitution_share: f64,
    /// The [energy](crate::simulation::energy) at k, J.
    pub energy: f64,
}

/// A row of the table `contacts`; vectors in the world.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactRow {
    /// The body that the force acts on.
    pub body: usize,
    /// What it touches.
    pub partner: Partner,
    /// The touching point at k, m.
    pub point: Vector3<f64>,
    /// At k, away from the partner.
    pub normal: Vector3<f64>,
    /// N, on `body`.
    pub force: Vector3<f64>,
    /// The mean slip over the step, m/s.
    pub slip: Vector3<f64>,
    /// At k, m.
    pub gap: f64,
    /// The radius by which the point is rounded, m.
    pub radius: f64,
    /// e c_n⁻ (eq. 29), m/s.
    pub rebound: f64,
    /// Which features touch.
    pub key: KeyText,
}

/// Why tables cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TablesError {
    /// The stream ended early or the CSV is malformed.
    #[error("{table}: {error}")]
    Csv {
        /// Which table.
        table: Table,
        /// What is wrong.
        error: csv::Error,
    },
    /// A column is missing, misplaced or unknown.
    #[error("{table}: column {position} of the header is {found:?} where {expected:?} belongs")]
    Header {
        /// Which table.
        table: Table,
        /// 1-based.
        position: usize,
        /// The name that is needed.
        expected: &'static str,
        /// The name in the file, empty where the header ends.
        found: String,
    },
    /// A field that cannot be read.
    #[error("{table}, line {line}, column {column}: {found:?} is not {expected}")]
    Field {
        /// Which table.
        table: Table,
        /// 1-based line of the file.
        line: u64,
        /// The column's name.
        column: &'static str,
        /// What stands there.
        found: String,
        /// What is needed.
        expected: &'static str,
    },
    /// A row out of order, missing or double.
    #[error("{table}, line {line}: {column} is {found} where {expected} follows")]
    Order {
        /// Which table.
        table: Table,
        /// 1-based line of the file.
        line: u64,
        /// `k`, `body` or `contact`.
        column: &'static str,
        /// What is needed.
        expected: u64,
        /// What stands there.
        found: u64,
    },
    /// The table ends before its last row, or has rows after it.
    #[error("{table}: {why}")]
    End {
        /// Which table.
        table: Table,
        /// What is wrong.
        why: &'static str,
    },
}

const CUT_OFF: &str = "it ends before the row of status `end`: it is cut off, or of another run";
const TOO_LONG: &str = "there are rows after the step of status `end`";

/// Reads the tables of a run step by step, in memory for one step.
pub struct TablesReader<R: Read> {
    states: Sheet<R>,
    contacts: Sheet<R>,
    steps: Sheet<R>,
    bodies: usize,
    next_index: u64,
    ended: bool,
}

impl<R: Read> TablesReader<R> {
    /// Reads and checks the headers of tables of so many `bodies`.
    ///
    /// # Errors
    /// [`TablesError::Header`], or a stream's.
    pub fn new(streams: Streams<R>, bodies: usize) -> Result<Self, TablesError> {
        Ok(Self {
            states: Sheet::new(Table::States, streams.states)?,
            contacts: Sheet::new(Table::Contacts, streams.contacts)?,
            steps: Sheet::new(Table::Steps, streams.steps)?,
            bodies,
            next_index: 0,
            ended: false,
        })
    }

    /// The next step; `None` after the one of status `end`.
    ///
    /// # Errors
    /// The first thing wrong, by table, line and column.
    pub fn next_step(&mut self) -> Result<Option<TableStep>, TablesError> {
        if self.ended {
            for sheet in [&mut self.states, &mut self.contacts, &mut self.steps] {
                if sheet.next()? {
                    return Err(TablesError::End { table: sheet.table, why: TOO_LONG });
                }
            }
            return Ok(None);
        }
        let row = self.step_row()?;
        // As many as the table has: the number that was asked for may be any.
        let mut states = Vec::with_capacity(self.bodies.min(1 << 12));
        for body in 0..self.bodies {
            let sheet = &mut self.states;
            sheet.need_row()?;
            sheet.expect(0, self.next_index)?;
            sheet.expect(2, body as u64)?;
            let mut state = SVector::<f64, 13>::zeros();
            for (place, value) in state.iter_mut().enumerate() {
                *value = sheet.number(3 + place)?;
            }
            if sheet.number(1)? != row.time {
                return Err(sheet.odd(1, "the time of the same step in the table steps"));
            }
            states.push(State::from_vector(&state));
        }
        let mut contacts = Vec::new();
        for index in 0..row.contacts {
            contacts.push(self.contact_row(index)?);
        }
        self.next_index += 1;
        self.ended = row.status == StepStatus::End;
        Ok(Some(TableStep { row, states, contacts }))
    }

    fn step_row(&mut self) -> Result<StepRow, TablesError> {
        let sheet = &mut self.steps;
        sheet.need_row()?;
        sheet.expect(0, self.next_index)?;
        let mut parts = [0.0; 5];
        for (place, part) in parts.iter_mut().enumerate() {
            *part = sheet.number(7 + place)?;
        }
        Ok(StepRow {
            index: self.next_index,
            time: sheet.number(1)?,
            status: sheet.field(2, "a status", StepStatus::from_name)?,
            iterations: sheet.whole(3)?,
            start: sheet.text(4).to_owned(),
            contacts: sheet.whole(5)?,
            residual: sheet.number(6)?,
            parts,
            overlap: sheet.number(12)?,
            restitution_share: sheet.number(13)?,
            energy: sheet.number(14)?,
        })
    }

    fn contact_row(&mut self, index: usize) -> Result<ContactRow, TablesError> {
        let sheet = &mut self.contacts;
        sheet.need_row()?;
        sheet.expect(0, self.next_index)?;
        sheet.expect(1, index as u64)?;
        let place = sheet.whole(4)?;
        let partner = sheet.field(3, "ground, fixed or body", |text| match text {
            "ground" => Some(Partner::Ground),
            "fixed" => Some(Partner::Fixed(place)),
            "body" => Some(Partner::Body(place)),
            _ => None,
        })?;
        let vector = |first: usize| -> Result<Vector3<f64>, TablesError> {
            let [x, y, z] = [0, 1, 2].map(|axis| sheet.number(first + axis));
            Ok(Vector3::new(x?, y?, z?))
        };
        Ok(ContactRow {
            body: sheet.whole(2)?,
            partner,
            point: vector(5)?,
            normal: vector(8)?,
            force: vector(11)?,
            slip: vector(14)?,
            gap: sheet.number(17)?,
            radius: sheet.number(18)?,
            rebound: sheet.number(19)?,
            key: sheet.field(20, "a key of a contact", KeyText::parse)?,
        })
    }
}

/// One table that is being read.
struct Sheet<R: Read> {
    table: Table,
    csv: csv::Reader<R>,
    record: csv::StringRecord,
}

impl<R: Read> Sheet<R> {
    fn new(table: Table, stream: R) -> Result<Self, TablesError> {
        let mut csv = csv::Reader::from_reader(stream);
        let found = csv.headers().map_err(|error| TablesError::Csv { table, error })?.clone();
        let columns = table.columns();
        for position in 0..columns.len().max(found.len()) {
            let expected = columns.get(position).copied().unwrap_or("the end");
            let name = found.get(position).unwrap_or("");
            if name != expected {
                let found = name.chars().take(40).collect();
                return Err(TablesError::Header { table, position: position + 1, expected, found });
            }
        }
        Ok(Self { table, csv, record: csv::StringRecord::new() })
    }

    /// Reads a row; `false` at the end.
    fn next(&mut self) -> Result<bool, TablesError> {
        let table = self.table;
        self.csv.read_record(&mut self.record).map_err(|error| TablesError::Csv { table, error })
    }

    fn need_row(&mut self) -> Result<(), TablesError> {
        if self.next()? {
            return Ok(());
        }
        Err(TablesError::End { table: self.table, why: CUT_OFF })
    }

    fn text(&self, column: usize) -> &str {
        self.record.get(column).unwrap_or("")
    }

    /// The count in this column must be the one that follows.
    fn expect(&self, column: usize, expected: u64) -> Result<(), TablesError> {
        let found = self.whole(column)?;
        if found == expected {
            return Ok(());
        }
        let (table, line) = (self.table, self.line());
        let column = table.columns()[column];
        Err(TablesError::Order { table, line, column, expected, found })
    }

    fn whole<T: std::str::FromStr>(&self, column: usize) -> Result<T, TablesError> {
        self.field(column, "a whole number in its range", |text| text.parse().ok())
    }

    fn number(&self, column: usize) -> Result<f64, TablesError> {
        self.field(column, "a finite number", |text| {
            text.parse().ok().filter(|value: &f64| value.is_finite())
        })
    }

    fn field<T>(
        &self,
        column: usize,
        expected: &'static str,
        parse: impl Fn(&str) -> Option<T>,
    ) -> Result<T, TablesError> {
        parse(self.text(column)).ok_or_else(|| self.odd(column, expected))
    }

    fn odd(&self, column: usize, expected: &'static str) -> TablesError {
        TablesError::Field {
            table: self.table,
            line: self.line(),
            column: self.table.columns()[column],
            found: self.text(column).chars().take(40).collect(),
            expected,
        }
    }

    fn line(&self) -> u64 {
        self.record.position().map_or(0, csv::Position::line)
    }
}
