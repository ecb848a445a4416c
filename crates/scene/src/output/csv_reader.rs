//! Reader of a CSV table. It checks the header, the order of rows and every field.

use std::io::Read;
use tumble_core::step::StepStatus;

/// Error in the rows of a table.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RowsError {
    /// Truncated stream or malformed CSV.
    #[error("{table}: {error}")]
    Csv {
        /// Name of the table.
        table: &'static str,
        /// Underlying error.
        error: csv::Error,
    },
    /// Missing, misplaced or unknown column.
    #[error("{table}: column {position} of the header is {found:?}; expected {expected:?}")]
    Header {
        /// Name of the table.
        table: &'static str,
        /// Number of the column, from 1.
        position: usize,
        /// Expected name.
        expected: &'static str,
        /// Name in the file; empty at the end of the header.
        found: String,
    },
    /// Field that cannot be parsed.
    #[error("{table}, line {line}, column {column}: {found:?} is not {expected}")]
    Field {
        /// Name of the table.
        table: &'static str,
        /// Line of the file, from 1.
        line: u64,
        /// Name of the column.
        column: &'static str,
        /// Text of the field.
        found: String,
        /// Description of a valid field.
        expected: &'static str,
    },
    /// Row that is out of order, missing or duplicated.
    #[error("{table}, line {line}: {column} is {found}; expected {expected}")]
    Order {
        /// Name of the table.
        table: &'static str,
        /// Line of the file, from 1.
        line: u64,
        /// Name of the counting column.
        column: &'static str,
        /// Expected number.
        expected: u64,
        /// Number in the file.
        found: u64,
    },
    /// Row of more than the maximum number of bytes.
    #[error("{table}: the row that begins in line {line} has more than {MOST_ROW_BYTES} bytes")]
    TooLong {
        /// Name of the table.
        table: &'static str,
        /// Line of the file where the row begins, from 1.
        line: u64,
    },
    /// Missing or surplus rows at the end of the table.
    #[error("{table}: {why}")]
    End {
        /// Name of the table.
        table: &'static str,
        /// Description of the fault.
        why: &'static str,
    },
}

/// Maximum size of a row and of the header (bytes).
pub const MOST_ROW_BYTES: usize = 1 << 20;

/// Stream that fails if a row exceeds its limit of bytes.
struct Bounded<R> {
    stream: R,
    /// Remaining bytes of this row.
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

/// Expected index k and interval of the next row in a table of steps.
pub struct Steps {
    /// Index k of the last row; before the first row, the expected k of the first.
    pub at: u64,
    /// Distance of rows in steps.
    pub every: u64,
    /// True if the first row may have any k.
    pub anywhere: bool,
    /// Interval of the last row; `None` before the first row.
    interval: Option<u32>,
}

impl Default for Steps {
    fn default() -> Self {
        Self { at: 0, every: 1, anywhere: false, interval: None }
    }
}

impl Steps {
    /// Checks the order of the row just read, which has the given status and interval.
    pub fn next<R: Read>(
        &mut self,
        reader: &CsvReader<R>,
        status: StepStatus,
        interval: u32,
    ) -> Result<(), RowsError> {
        let found = reader.whole(0)?;
        let next = self.at.saturating_add(self.every);
        let is_end = status == StepStatus::End;
        let (fits, expected) = match self.interval {
            None => (self.anywhere || found == self.at, 0),
            Some(last) if found == self.at && !is_end => (true, last.saturating_add(1)),
            Some(_) if is_end => (self.at < found && found <= next, 0),
            Some(_) => (found == next, 0),
        };
        if !fits {
            reader.expect(0, if self.interval.is_some() { next } else { self.at })?;
        }
        if interval != expected
            && let Some(column) = reader.interval_column()
        {
            reader.expect(column, expected.into())?;
        }
        (self.at, self.interval) = (found, Some(interval));
        Ok(())
    }
}

/// Reader of one table. A row is limited to [`MOST_ROW_BYTES`], so that memory is bounded.
pub struct CsvReader<R: Read> {
    table: &'static str,
    columns: Vec<&'static str>,
    csv: csv::Reader<Bounded<R>>,
    record: csv::StringRecord,
    /// True if the row was read in advance.
    is_ahead: bool,
}

impl<R: Read> CsvReader<R> {
    /// Reads the header and compares it with the expected names `columns`.
    pub fn new(
        table: &'static str,
        stream: R,
        columns: Vec<&'static str>,
    ) -> Result<Self, RowsError> {
        let mut csv = csv::Reader::from_reader(Bounded { stream, left: MOST_ROW_BYTES });
        let found = csv.headers().cloned();
        let found = found.map_err(|error| or_too_long(table, &csv, 1, error))?;
        for position in 0..columns.len().max(found.len()) {
            let expected = columns.get(position).copied().unwrap_or("the end");
            let name = found.get(position).unwrap_or("");
            if name != expected {
                return Err(RowsError::Header {
                    table,
                    position: position + 1,
                    expected,
                    found: name.chars().take(40).collect(),
                });
            }
        }
        Ok(Self { table, columns, csv, record: csv::StringRecord::new(), is_ahead: false })
    }

    /// Reads a row; `false` at the end.
    pub fn next_row(&mut self) -> Result<bool, RowsError> {
        if std::mem::take(&mut self.is_ahead) {
            return Ok(true);
        }
        self.csv.get_mut().left = MOST_ROW_BYTES;
        let line = self.csv.position().line();
        let read = self.csv.read_record(&mut self.record);
        read.map_err(|error| or_too_long(self.table, &self.csv, line, error))
    }

    /// True if the next row belongs to this interval of step `index`. It stays the next row.
    pub fn next_is_of(&mut self, index: u64, interval: u32) -> Result<bool, RowsError> {
        self.is_ahead = self.next_row()?;
        let Some(column) = self.interval_column().filter(|_| self.is_ahead) else {
            return Ok(false);
        };
        Ok(self.whole::<u64>(0)? == index && self.whole::<u32>(column)? == interval)
    }

    /// Checks the columns of the interval.
    pub fn expect_interval(&self, interval: u32, length: f64) -> Result<(), RowsError> {
        let Some(column) = self.interval_column() else { return Ok(()) };
        self.expect(column, interval.into())?;
        if self.number(column + 1)? == length {
            return Ok(());
        }
        Err(self.invalid(column + 1, "the length of the same interval in the table steps"))
    }

    /// Column of the number of the interval. The length follows.
    fn interval_column(&self) -> Option<usize> {
        self.columns.iter().rposition(|column| *column == "interval")
    }

    /// Reads a required row; fails with `why` at the end.
    pub fn need_row(&mut self, why: &'static str) -> Result<(), RowsError> {
        if self.next_row()? { Ok(()) } else { Err(RowsError::End { table: self.table, why }) }
    }

    /// Checks that no row follows; fails with `why` otherwise.
    pub fn need_end(&mut self, why: &'static str) -> Result<(), RowsError> {
        if self.next_row()? { Err(RowsError::End { table: self.table, why }) } else { Ok(()) }
    }

    /// Text of a column.
    pub fn text(&self, column: usize) -> &str {
        self.record.get(column).unwrap_or("")
    }

    /// Checks that the number in this column is `expected`.
    pub fn expect(&self, column: usize, expected: u64) -> Result<(), RowsError> {
        let found = self.whole(column)?;
        if found == expected {
            return Ok(());
        }
        let (table, line, column) = (self.table, self.line(), self.columns[column]);
        Err(RowsError::Order { table, line, column, expected, found })
    }

    /// Whole number in a column; 0 in one that the table leaves out.
    pub fn whole<T: std::str::FromStr>(&self, column: usize) -> Result<T, RowsError> {
        let is_left_out = column >= self.columns.len();
        let number = |text: &str| if is_left_out { "0" } else { text }.parse().ok();
        self.field(column, "a whole number in its range", number)
    }

    /// Finite number in a column; 0 in one that the table leaves out.
    pub fn number(&self, column: usize) -> Result<f64, RowsError> {
        if column >= self.columns.len() {
            return Ok(0.0);
        }
        self.field(column, "a finite number", |text| {
            text.parse().ok().filter(|value: &f64| value.is_finite())
        })
    }

    /// `N` finite numbers, starting with the column `first`.
    pub fn numbers<const N: usize>(&self, first: usize) -> Result<[f64; N], RowsError> {
        let mut numbers = [0.0; N];
        for (place, number) in numbers.iter_mut().enumerate() {
            *number = self.number(first + place)?;
        }
        Ok(numbers)
    }

    /// Result of `parse` for a column.
    pub fn field<T>(
        &self,
        column: usize,
        expected: &'static str,
        parse: impl Fn(&str) -> Option<T>,
    ) -> Result<T, RowsError> {
        parse(self.text(column)).ok_or_else(|| self.invalid(column, expected))
    }

    /// Error for a column that is not `expected`.
    pub fn invalid(&self, column: usize, expected: &'static str) -> RowsError {
        RowsError::Field {
            table: self.table,
            line: self.line(),
            column: self.columns[column],
            found: self.text(column).chars().take(40).collect(),
            expected,
        }
    }

    fn line(&self) -> u64 {
        self.record.position().map_or(0, csv::Position::line)
    }
}

/// Error of a row that begins at `line`: too long if the limit is exhausted, or a CSV error.
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
