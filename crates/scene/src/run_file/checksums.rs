//! What shows that files of a run were changed after it wrote them, also where the change obeys the physics: CRC-32 (ISO 3309) of
//! the tables in run.json, and one of run.json itself. It shows accidents and edits; it is no signature.

use std::collections::BTreeMap;
use std::io::{self, Read, Write};

/// Checksums of files by their names, eight hexadecimal digits each.
pub type Checksums = BTreeMap<String, String>;

/// Before the checksum of a run.json, its last field.
const LAST_FIELD: &str = ",\n  \"checksum\": \"";
const END: &str = "\n}\n";
/// The one line that is another in every run: that of a clock.
const CLOCK: &str = "    \"solve_seconds\": ";

/// Whether a run.json is as it was written.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Seal {
    /// It has no checksum.
    #[default]
    None,
    /// It has the checksum of what it says.
    Whole,
    /// It has another.
    Broken,
}

/// A stream that keeps the checksum of what goes through it.
#[derive(Debug)]
pub struct Summed<W> {
    stream: W,
    hasher: crc32fast::Hasher,
}

impl<W> Summed<W> {
    /// That to or from `stream`, through which nothing has gone.
    pub fn new(stream: W) -> Self {
        Self { stream, hasher: crc32fast::Hasher::new() }
    }

    /// The stream.
    pub fn get_ref(&self) -> &W {
        &self.stream
    }

    /// The checksum of what went through so far.
    #[must_use]
    pub fn checksum(&self) -> String {
        format!("{:08x}", self.hasher.clone().finalize())
    }

    /// The stream, and the checksum of what went through.
    #[must_use]
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

/// The checksum of all that `from` has.
///
/// # Errors
/// Those of reading.
pub fn checksum_of(from: impl Read) -> io::Result<String> {
    let mut from = Summed::new(from);
    io::copy(&mut from, &mut io::sink())?;
    Ok(from.finish().1)
}

/// The text of an object with the checksum of its lines, but for the clock's, as a last field.
pub(super) fn sealed(object: &str) -> String {
    let fields = object.strip_suffix(END).unwrap_or(object);
    let mut hasher = crc32fast::Hasher::new();
    let lines = fields.split_inclusive('\n').filter(|line| !line.starts_with(CLOCK));
    lines.for_each(|line| hasher.update(line.as_bytes()));
    format!("{fields}{LAST_FIELD}{:08x}\"{END}", hasher.finalize())
}

/// Whether the `text` of an object is what was sealed.
pub(super) fn seal_of(text: &str) -> Seal {
    match text.rfind(LAST_FIELD) {
        Some(at) if sealed(&text[..at]) == text => Seal::Whole,
        Some(_) => Seal::Broken,
        // It may have been written anew.
        None if text.contains("\"checksum\"") => Seal::Broken,
        None => Seal::None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_sealed_is_whole_until_it_is_changed() {
        let text = sealed("{\n  \"seed\": 42\n}\n");
        assert!(serde_json::from_str::<serde_json::Value>(&text).is_ok(), "{text}");
        assert_eq!(seal_of(&text), Seal::Whole);
        assert_eq!(seal_of(&text.replace("42", "43")), Seal::Broken);
        assert_eq!(seal_of(&text.replace("{\n", "{\n\n")), Seal::Broken);
        assert_eq!(seal_of("{\n  \"seed\": 42\n}\n"), Seal::None);
    }

    /// The check value of CRC-32 in its catalogues is that of the digits 1 to 9.
    #[test]
    fn the_checksum_is_the_standards() {
        assert_eq!(checksum_of(&b"123456789"[..]).unwrap(), "cbf43926");
        let mut stream = Summed::new(Vec::new());
        stream.write_all(b"1234").unwrap();
        stream.write_all(b"56789").unwrap();
        assert_eq!(stream.finish(), (b"123456789".to_vec(), "cbf43926".to_owned()));
    }
}
