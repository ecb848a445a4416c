//! Checksums that detect later changes of a run's files, even if the changed data obey the physics.
//!
//! run.json has a CRC-32 (ISO 3309) of each table and one of itself. It detects accidents and
//! edits. It is not a signature.

use std::collections::BTreeMap;
use std::io::{self, Read, Write};

/// Checksums of files by file name, eight hexadecimal digits each.
pub type Checksums = BTreeMap<String, String>;

/// Text before the checksum of a run.json, its last field.
const LAST_FIELD: &str = ",\n  \"checksum\": \"";
const END: &str = "\n}\n";
/// Beginning of the line with the measured time, which differs between equal runs.
const CLOCK: &str = "    \"solve_seconds\": ";

/// Integrity of a run.json.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Seal {
    /// File without a checksum.
    #[default]
    None,
    /// Content that matches the checksum.
    Whole,
    /// Content that does not match the checksum.
    Broken,
}

/// Stream that computes the checksum of the data passed through it.
#[derive(Debug)]
pub struct Summed<W> {
    stream: W,
    hasher: crc32fast::Hasher,
}

impl<W> Summed<W> {
    /// Wraps `stream`.
    pub fn new(stream: W) -> Self {
        Self { stream, hasher: crc32fast::Hasher::new() }
    }

    /// Inner stream.
    pub fn get_ref(&self) -> &W {
        &self.stream
    }

    /// Checksum of all data so far.
    pub fn checksum(&self) -> String {
        format!("{:08x}", self.hasher.clone().finalize())
    }

    /// Inner stream and final checksum.
    pub fn finish(self) -> (W, String) {
        let checksum = self.checksum();
        (self.stream, checksum)
    }
}

impl<W: Write> Write for Summed<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let count = self.stream.write(bytes)?;
        self.hasher.update(&bytes[..count]);
        Ok(count)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.stream.flush()
    }
}

impl<R: Read> Read for Summed<R> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        let count = self.stream.read(bytes)?;
        self.hasher.update(&bytes[..count]);
        Ok(count)
    }
}

/// Checksum of all data of `from`.
///
/// # Errors
/// Errors of the reader.
pub fn checksum_of(from: impl Read) -> io::Result<String> {
    let mut from = Summed::new(from);
    io::copy(&mut from, &mut io::sink())?;
    Ok(from.finish().1)
}

/// Appends the checksum to the text of a JSON object as its last field. The line of the time is not
/// counted.
pub(super) fn sealed(object: &str) -> String {
    let fields = object.strip_suffix(END).unwrap_or(object);
    let mut hasher = crc32fast::Hasher::new();
    let lines = fields.split_inclusive('\n').filter(|line| !line.starts_with(CLOCK));
    lines.for_each(|line| hasher.update(line.as_bytes()));
    format!("{fields}{LAST_FIELD}{:08x}\"{END}", hasher.finalize())
}

/// Integrity of the `text` of a JSON object.
pub(super) fn seal_of(text: &str) -> Seal {
    match text.rfind(LAST_FIELD) {
        Some(at) if sealed(&text[..at]) == text => Seal::Whole,
        Some(_) => Seal::Broken,
        // The field exists but is not last: another program has rewritten the file.
        None if text.contains("\"checksum\"") => Seal::Broken,
        None => Seal::None,
    }
}

#[cfg(test)]
#[path = "tests/checksums.rs"]
mod tests;
