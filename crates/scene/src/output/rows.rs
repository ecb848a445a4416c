//! Writer of CSV rows, cell by cell.

use std::fmt::Display;
use std::io::{self, Write};
use tumble_core::step::StepStatus;

/// Size of the buffer before data go to the stream (bytes).
const BUFFER: usize = 1 << 16;

/// Selection of the steps that have rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct RowChoice {
    every: u64,
    first: u64,
}

impl RowChoice {
    /// All steps.
    pub const ALL: Self = Self { every: 1, first: 0 };

    /// Steps `first`, `first + every`, …, and the last state.
    pub fn new(every: u64, first: u64) -> Self {
        Self { every: every.max(1), first }
    }

    /// True if some steps have no rows.
    pub fn omits(self) -> bool {
        self.every > 1
    }

    /// True if the step `index` with this status has rows.
    pub fn has(self, index: u64, status: StepStatus) -> bool {
        status == StepStatus::End || index.wrapping_sub(self.first).is_multiple_of(self.every)
    }
}

/// Writes the rows of one table as CSV.
///
/// Numbers have the fewest digits that read back to the same double. Texts are quoted if necessary.
pub(crate) struct RowWriter<W> {
    stream: W,
    buffer: Vec<u8>,
    number: zmij::Buffer,
    whole: itoa::Buffer,
}

impl<W: Write> RowWriter<W> {
    /// Starts a table with the names of its `columns`.
    pub fn new<'a>(stream: W, columns: impl IntoIterator<Item = &'a str>) -> Self {
        let mut rows = Self::after(stream);
        columns.into_iter().for_each(|column| rows.text(column));
        rows.end();
        rows
    }

    /// Continues a table whose header is already in the stream.
    pub fn after(stream: W) -> Self {
        let buffer = Vec::with_capacity(BUFFER + BUFFER / 4);
        Self { stream, buffer, number: zmij::Buffer::new(), whole: itoa::Buffer::new() }
    }

    fn cell(&mut self, bytes: impl FnOnce(&mut Self)) {
        bytes(self);
        self.buffer.push(b',');
    }

    pub fn whole(&mut self, value: u64) {
        self.cell(|rows| rows.buffer.extend_from_slice(rows.whole.format(value).as_bytes()));
    }

    pub fn number(&mut self, value: f64) {
        // Fast path: a contact without force has mostly zeros.
        if value.to_bits() == 0 {
            self.buffer.extend_from_slice(b"0.0,");
            return;
        }
        self.cell(|rows| {
            let digits = rows.number.format(value).as_bytes();
            // Exponents have no plus sign in this format.
            let plus = (value.abs() >= 1e16).then(|| digits.iter().position(|byte| *byte == b'+'));
            match plus.flatten() {
                Some(at) => {
                    rows.buffer.extend_from_slice(&digits[..at]);
                    rows.buffer.extend_from_slice(&digits[at + 1..]);
                }
                None => rows.buffer.extend_from_slice(digits),
            }
        });
    }

    pub fn numbers<'a>(&mut self, values: impl IntoIterator<Item = &'a f64>) {
        values.into_iter().for_each(|value| self.number(*value));
    }

    pub fn text(&mut self, value: &str) {
        self.cell(|rows| match value.contains(['"', ',', '\n', '\r']) {
            true => {
                let quoted = value.replace('"', "\"\"");
                rows.buffer.push(b'"');
                rows.buffer.extend_from_slice(quoted.as_bytes());
                rows.buffer.push(b'"');
            }
            false => rows.buffer.extend_from_slice(value.as_bytes()),
        });
    }

    /// Removes the last cell of the row, whose text has no comma.
    pub fn drop_cell(&mut self) {
        self.buffer.pop();
        let before = self.buffer.iter().rposition(|byte| *byte == b',');
        self.buffer.truncate(before.map_or(0, |place| place + 1));
    }

    /// Adds a cell whose text has no comma, quote or line end.
    pub fn word(&mut self, value: &impl Display) {
        self.cell(|rows| {
            // Writing to memory cannot fail.
            let _ = write!(rows.buffer, "{value}");
        });
    }

    fn end(&mut self) {
        if let Some(last) = self.buffer.last_mut() {
            *last = b'\n';
        }
    }

    /// Ends the row.
    pub fn end_row(&mut self) -> io::Result<()> {
        self.end();
        if self.buffer.len() < BUFFER {
            return Ok(());
        }
        let written = self.stream.write_all(&self.buffer);
        self.buffer.clear();
        written
    }

    /// Writes the buffer and flushes the stream.
    pub fn flushed(&mut self) -> io::Result<&mut W> {
        self.stream.write_all(&self.buffer)?;
        self.buffer.clear();
        self.stream.flush()?;
        Ok(&mut self.stream)
    }

    /// Flushes and returns the stream.
    pub fn finish(mut self) -> io::Result<W> {
        self.flushed()?;
        Ok(self.stream)
    }
}

#[cfg(test)]
#[path = "tests/rows.rs"]
mod tests;
