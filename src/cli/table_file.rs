//! Files of tables: CSV, or CSV compressed by Zstandard.

use super::input;
use super::kept::Form;
use std::fs::File;
use std::io::{self, BufReader, BufWriter, IntoInnerError, Read, Write};
use std::path::Path;
use tumble::scenario::run_file::Summed;
use zstd::{Decoder, Encoder};

/// Compression level. A heap of 100 boxes (2000 steps, 204 MB of CSV) takes 20.3 MB at level 3 and 18.7 MB at 9.
const LEVEL: i32 = 9;

type Disk = BufWriter<Summed<File>>;

/// A table that is being written.
pub enum TableSink {
    Csv(Disk),
    Zstd(Encoder<'static, Disk>),
}

impl TableSink {
    pub fn new(file: File, form: Form) -> io::Result<Self> {
        let disk = BufWriter::new(Summed::new(file));
        Ok(match form {
            Form::Csv => Self::Csv(disk),
            Form::Zstd => Self::Zstd(Encoder::new(disk, LEVEL)?),
        })
    }

    /// Brings everything to the disk and returns the checksum of the file: a full disk must be noticed before the file
    /// gets its name.
    pub fn finish(self) -> io::Result<String> {
        let disk = match self {
            Self::Csv(disk) => disk,
            Self::Zstd(encoder) => encoder.finish()?,
        };
        let (file, checksum) = disk.into_inner().map_err(IntoInnerError::into_error)?.finish();
        file.sync_all()?;
        Ok(checksum)
    }
}

impl Write for TableSink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Csv(disk) => disk.write(bytes),
            Self::Zstd(encoder) => encoder.write(bytes),
        }
    }

    /// Compressed data reach the disk with [`TableSink::finish`]: a flush before would end a block, and the bytes would
    /// depend on when it came.
    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::Csv(disk) => disk.flush(),
            Self::Zstd(_) => Ok(()),
        }
    }
}

/// A table that is being read.
pub enum TableSource {
    Csv(File),
    Zstd(Decoder<'static, BufReader<File>>),
}

impl TableSource {
    /// Opens a file, compressed if its name ends in `.zst`.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = input::open(path)?;
        Ok(match path.extension() {
            Some(end) if end == "zst" => Self::Zstd(Decoder::new(file)?),
            _ => Self::Csv(file),
        })
    }
}

impl Read for TableSource {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Csv(file) => file.read(buffer),
            Self::Zstd(decoder) => decoder.read(buffer),
        }
    }
}
