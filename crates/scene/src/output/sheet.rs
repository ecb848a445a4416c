//! A table in CSV that is being read, its header, order and every field checked: what the formats
//! have in common.

use std::io::Read;
use tumble_core::step::StepStatus;

/// Why rows cannot be read. `table` names the one of several that it is about, and is empty where
/// there is but one.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RowsError {
    /// The stream ended early or the CSV is malformed.
    #[error("{}{error}", of(.table, ": "))]
    Csv {
        /// Which table.
        table: &'static str,
        /// What is wrong.
        error: csv::Error,
    },
    /// A column is missing, misplaced or unknown.
    #[error(
        "{}column {position} of the header is {found:?} where {expected:?} belongs", of(.table, ": ")
    )]
    Header {
        /// Which table.
        table: &'static str,
        /// 1-based.
        position: usize,
        /// The name that is needed.
        expected: String,
        /// The name in the file, empty where the header ends.
        found: String,
    },
    /// A field that cannot be read.
    #[error("{}line {line}, column {column}: {found:?} is not {expected}", of(.table, ", "))]
    Field {
        /// Which table.
        table: &'static str,
        /// 1-based line of the file.
        line: u64,
        /// The column's name.
        column: String,
        /// What stands there.
        found: String,
        /// What is needed.
        expected: &'static str,
    },
    /// A row out of order, missing or double.
    #[error("{}line {line}: {column} is {found} where {expected} follows", of(.table, ", "))]
    Order {
        /// Which table.
        table: &'static str,
        /// 1-based line of the file.
        line: u64,
        /// The column that counts.
        column: String,
        /// What is needed.
        expected: u64,
        /// What stands there.
        found: u64,
    },
    /// A row of more bytes than one has.
    #[error(
        "{}the row that begins in line {line} has more than {MOST_ROW_BYTES} bytes", of(.table, ": ")
    )]
    TooLong {
        /// Which table.
        table: &'static str,
        /// 1-based line of the file where it begins.
        line: u64,
    },
    /// The table ends before its last row, or has rows after it.
    #[error("{}{why}", of(.table, ": "))]
    End {
        /// Which table.
        table: &'static str,
        /// What is wrong.
        why: &'static str,
    },
}

/// The name of a table before what is said of it.
fn of(table: &str, mark: &str) -> String {
    if table.is_empty() { String::new() } else { format!("{table}{mark}") }
}

/// Bytes of the longest row, and of the header: a thousand points have 7018 columns, and a double
/// at most 24 characters.
pub const MOST_ROW_BYTES: usize = 1 << 20;

/// A stream that ends with an error where a row does not end.
struct Bounded<R> {
    stream: R,
    /// Bytes that may still be read for this row.
    left: usize,
}

impl<R: Read> Read for Bounded<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        if self.left == 0 {
            return Err(std::io::Error::other("a row without end"));
        }
        let most = buffer.len().min(self.left);
        let read = self.stream.read(&mut buffer[..most])?;
        self.left -= read;
        Ok(read)
    }
}

/// Which k the next row of a table of steps has.
pub struct Steps {
    /// The k of the last row, or where none was read that of the first.
    at: u64,
    every: u64,
    /// Whether the first row may have any k.
    anywhere: bool,
    begun: bool,
}

impl Default for Steps {
    fn default() -> Self {
        Self { at: 0, every: 1, anywhere: false, begun: false }
    }
}

impl Steps {
    /// The first k is `index`.
    pub fn begin_at(&mut self, index: u64) {
        self.at = index;
    }

    /// The first k may be any.
    pub fn begin_anywhere(&mut self) {
        self.anywhere = true;
    }

    /// Only each `every`-th step has a row, and the last state.
    pub fn every(&mut self, every: u64) {
        self.every = every.max(1);
    }

    /// The k of the row that was read, which has this status.
    pub fn next<R: Read>(
        &mut self,
        sheet: &TableReader<R>,
        status: StepStatus,
    ) -> Result<u64, RowsError> {
        let found = sheet.whole(0)?;
        let next = self.at.saturating_add(self.every);
        let fits = match (self.begun, status) {
            (false, _) => self.anywhere || found == self.at,
            (true, StepStatus::End) => self.at < found && found <= next,
            (true, _) => found == next,
        };
        if !fits {
            sheet.expect(0, if self.begun { next } else { self.at })?;
        }
        (self.at, self.begun) = (found, true);
        Ok(found)
    }
}

/// One table that is being read. A row may have [`MOST_ROW_BYTES`], so that memory is bounded
/// whatever the stream holds.
pub struct TableReader<R: Read> {
    table: &'static str,
    columns: Vec<String>,
    csv: csv::Reader<Bounded<R>>,
    record: csv::StringRecord,
}

impl<R: Read> TableReader<R> {
    /// Reads the header and holds it against the names that `columns` says belong there.
    pub fn new(
        table: &'static str,
        stream: R,
        columns: impl FnOnce(&csv::StringRecord) -> Vec<String>,
    ) -> Result<Self, RowsError> {
        let mut csv = csv::Reader::from_reader(Bounded { stream, left: MOST_ROW_BYTES });
        let found = csv.headers().cloned();
        let found = found.map_err(|error| or_too_long(table, &csv, 1, error))?;
        let columns = columns(&found);
        for position in 0..columns.len().max(found.len()) {
            let expected = columns.get(position).map_or("the end", String::as_str);
            let name = found.get(position).unwrap_or("");
            if name != expected {
                return Err(RowsError::Header {
                    table,
                    position: position + 1,
                    expected: expected.to_owned(),
                    found: name.chars().take(40).collect(),
                });
            }
        }
        Ok(Self { table, columns, csv, record: csv::StringRecord::new() })
    }

    /// Reads a row; `false` at the end.
    pub fn next_row(&mut self) -> Result<bool, RowsError> {
        self.csv.get_mut().left = MOST_ROW_BYTES;
        let line = self.csv.position().line();
        let read = self.csv.read_record(&mut self.record);
        read.map_err(|error| or_too_long(self.table, &self.csv, line, error))
    }

    /// Reads a row that must be there; where it is not, `why`.
    pub fn need_row(&mut self, why: &'static str) -> Result<(), RowsError> {
        if self.next_row()? { Ok(()) } else { Err(RowsError::End { table: self.table, why }) }
    }

    /// Where no row may follow; where one does, `why`.
    pub fn need_end(&mut self, why: &'static str) -> Result<(), RowsError> {
        if self.next_row()? { Err(RowsError::End { table: self.table, why }) } else { Ok(()) }
    }

    /// The text of a column.
    pub fn text(&self, column: usize) -> &str {
        self.record.get(column).unwrap_or("")
    }

    /// The count in this column must be the one that follows.
    pub fn expect(&self, column: usize, expected: u64) -> Result<(), RowsError> {
        let found = self.whole(column)?;
        if found == expected {
            return Ok(());
        }
        let (table, line, column) = (self.table, self.line(), self.columns[column].clone());
        Err(RowsError::Order { table, line, column, expected, found })
    }

    /// A whole number.
    pub fn whole<T: std::str::FromStr>(&self, column: usize) -> Result<T, RowsError> {
        self.field(column, "a whole number in its range", |text| text.parse().ok())
    }

    /// A finite number.
    pub fn number(&self, column: usize) -> Result<f64, RowsError> {
        self.field(column, "a finite number", |text| {
            text.parse().ok().filter(|value: &f64| value.is_finite())
        })
    }

    /// As many finite numbers as there are, from this column on.
    pub fn numbers<const N: usize>(&self, first: usize) -> Result<[f64; N], RowsError> {
        let mut numbers = [0.0; N];
        for (place, number) in numbers.iter_mut().enumerate() {
            *number = self.number(first + place)?;
        }
        Ok(numbers)
    }

    /// What `parse` makes of a column.
    pub fn field<T>(
        &self,
        column: usize,
        expected: &'static str,
        parse: impl Fn(&str) -> Option<T>,
    ) -> Result<T, RowsError> {
        parse(self.text(column)).ok_or_else(|| self.odd(column, expected))
    }

    /// That a column is not what is needed.
    pub fn odd(&self, column: usize, expected: &'static str) -> RowsError {
        RowsError::Field {
            table: self.table,
            line: self.line(),
            column: self.columns[column].clone(),
            found: self.text(column).chars().take(40).collect(),
            expected,
        }
    }

    fn line(&self) -> u64 {
        self.record.position().map_or(0, csv::Position::line)
    }
}

/// What it means that `csv` could not read on after it began at `line`.
fn or_too_long<R: Read>(
    table: &'static str,
    csv: &csv::Reader<Bounded<R>>,
    line: u64,
    error: csv::Error,
) -> RowsError {
    match csv.get_ref().left {
        0 => RowsError::TooLong { table, line },
        _ => RowsError::Csv { table, error },
    }
}
