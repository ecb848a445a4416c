//! Files of tables: CSV, or CSV compressed by gzip.

use super::file_names;
use super::input;
use flate2::Compression;
use flate2::bufread::MultiGzDecoder;
use flate2::write::GzEncoder;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{self, BufReader, BufWriter, Cursor, IntoInnerError, Read, Write};
use std::path::Path;
use std::thread::{Builder, JoinHandle};
use tumble_scene::row_selection::TableForm;
use tumble_scene::run_file::Summed;

/// Bytes of CSV per member of a compressed file. Members are compressed as a whole, so that the file
/// does not depend on the times of its flushes. Much smaller members compress less.
const MEMBER: usize = 1 << 22;

/// A complete member of a gzip file. Its head has neither a time nor a name. The fastest level takes a
/// quarter of the default level's time, for files a seventh larger.
fn compressed(rows: &[u8]) -> io::Result<Vec<u8>> {
    let mut member = GzEncoder::new(Vec::new(), Compression::fast());
    member.write_all(rows)?;
    member.finish()
}

/// Members of a compressed file. A full one is compressed in a thread while the next one is filled.
#[derive(Default)]
struct Members {
    /// Rows of the current incomplete member.
    rows: Vec<u8>,
    /// The member before, until it is in the file.
    before: Option<JoinHandle<io::Result<Vec<u8>>>>,
}

impl Members {
    /// Adds rows to the current member, as many as it takes. Returns their number of bytes.
    fn add(&mut self, rows: &[u8], disk: &mut impl Write) -> io::Result<usize> {
        // A member has a fixed size and can end within a row.
        let rows = &rows[..rows.len().min(MEMBER - self.rows.len())];
        self.rows.extend_from_slice(rows);
        if self.rows.len() == MEMBER {
            self.wait(disk)?;
            let full = std::mem::replace(&mut self.rows, Vec::with_capacity(MEMBER));
            self.before = Some(Builder::new().spawn(move || compressed(&full))?);
        }
        Ok(rows.len())
    }

    /// Writes the member before to the file.
    fn wait(&mut self, disk: &mut impl Write) -> io::Result<()> {
        let Some(before) = self.before.take() else { return Ok(()) };
        let member = before.join().map_err(|_| io::Error::other("its compression failed"))??;
        disk.write_all(&member)
    }
}

/// A table being written.
pub struct TableSink {
    /// File for compressed members or plain rows.
    disk: BufWriter<Summed<File>>,
    /// `None` for an uncompressed file.
    members: Option<Members>,
    /// Counter and checksum of the rows.
    rows: Summed<CountedWriter>,
}

/// Counter of written bytes.
#[derive(Debug, Default)]
struct CountedWriter(u64);

impl Write for CountedWriter {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0 += bytes.len() as u64;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Rows of a table at some step, and their location.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct WrittenRows {
    /// Final name of the file.
    pub name: String,
    /// Temporary name in the same directory.
    pub temporary: String,
    /// Bytes of the rows as CSV.
    pub bytes: u64,
    /// CRC-32 of the rows.
    pub checksum: String,
    /// Bytes of the temporary file with rows.
    on_disk: u64,
    /// Rows after those of the temporary file.
    member: Vec<u8>,
}

impl TableSink {
    pub fn new(file: File, form: TableForm) -> Self {
        let members = match form {
            TableForm::Csv => None,
            TableForm::Gzip => Some(Members::default()),
        };
        let disk = BufWriter::new(Summed::new(file));
        Self { disk, members, rows: Summed::new(CountedWriter::default()) }
    }

    /// Rows so far of the table `name`, which is being written as `temporary`. The sink is flushed.
    pub fn rows(&self, name: String, temporary: String) -> io::Result<WrittenRows> {
        let on_disk = self.disk.get_ref().get_ref().metadata()?.len();
        let (bytes, checksum) = (self.rows.get_ref().0, self.rows.checksum());
        let member = self.members.as_ref().map_or(Vec::new(), |members| members.rows.clone());
        Ok(WrittenRows { name, temporary, bytes, checksum, on_disk, member })
    }

    /// Syncs the rows so far to the disk, except for those of the current member.
    pub fn sync(&mut self) -> io::Result<()> {
        self.disk.flush()?;
        self.disk.get_ref().get_ref().sync_data()
    }

    /// Syncs everything to the disk and returns the checksum of the file, so that a full disk is
    /// noticed before the rename.
    pub fn finish(mut self) -> io::Result<String> {
        if let Some(mut members) = self.members.take() {
            members.wait(&mut self.disk)?;
            if !members.rows.is_empty() {
                self.disk.write_all(&compressed(&members.rows)?)?;
            }
        }
        let (file, checksum) = self.disk.into_inner().map_err(IntoInnerError::into_error)?.finish();
        file.sync_all()?;
        Ok(checksum)
    }
}

impl Write for TableSink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let taken = match &mut self.members {
            Some(members) => members.add(bytes, &mut self.disk)?,
            None => {
                self.disk.write_all(bytes)?;
                bytes.len()
            }
        };
        self.rows.write(&bytes[..taken])
    }

    fn flush(&mut self) -> io::Result<()> {
        if let Some(members) = &mut self.members {
            members.wait(&mut self.disk)?;
        }
        self.disk.flush()
    }
}

impl WrittenRows {
    /// Converts to the rows of a complete file.
    pub fn in_place(self) -> Self {
        Self { temporary: String::new(), on_disk: 0, member: Vec::new(), ..self }
    }

    /// Copies the rows in `directory` to a new file. If a run was killed while it renamed its
    /// files, some have their final names.
    pub fn copy(&self, directory: &Path, to: &mut TableSink) -> io::Result<()> {
        let is_compressed = file_names::is_compressed(&self.name);
        let temporary = Some(&self.temporary).filter(|name| file_names::is_temporary(name));
        let temporary = temporary.map(|name| input::open(&directory.join(name)));
        let from: Box<dyn Read> = match temporary {
            Some(Ok(file)) if is_compressed && self.on_disk > 0 => {
                let members = MultiGzDecoder::new(BufReader::new(file.take(self.on_disk)));
                Box::new(members.chain(Cursor::new(&self.member)))
            }
            Some(Ok(_)) if is_compressed => Box::new(Cursor::new(&self.member)),
            Some(Ok(file)) => Box::new(file),
            _ => Box::new(TableSource::open(&directory.join(&self.name))?),
        };
        io::copy(&mut from.take(self.bytes), to)?;
        let found = (to.rows.get_ref().0, to.rows.checksum());
        if found == (self.bytes, self.checksum.clone()) {
            return Ok(());
        }
        Err(io::Error::other("they were changed after the run"))
    }
}

/// A table being read.
pub enum TableSource {
    Csv(File),
    Gzip(Box<MultiGzDecoder<BufReader<File>>>),
}

impl TableSource {
    /// Opens a file, compressed if its name ends in `.gz`.
    pub fn open(path: &Path) -> io::Result<Self> {
        let file = input::open(path)?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        if file_names::is_compressed(&name) {
            return Ok(Self::Gzip(Box::new(MultiGzDecoder::new(BufReader::new(file)))));
        }
        Ok(Self::Csv(file))
    }
}

impl Read for TableSource {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Csv(file) => file.read(buffer),
            Self::Gzip(decoder) => decoder.read(buffer),
        }
    }
}
