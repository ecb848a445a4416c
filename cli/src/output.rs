//! Atomic writes of files, and output to a possibly closed standard output.

use super::directory::OutputDirectory;
use super::file_names::{RANDOM, TEMPORARY, directory_of};
use super::outcome::{Failure, Outcome};
use anstream::AutoStream;
use anstyle::AnsiColor;
use indicatif::{ProgressBar, ProgressStyle};
use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, BufWriter, IsTerminal, Write};
use std::path::{Path, PathBuf};
use tempfile::NamedTempFile;
use tumble_model::shown;

/// A file under a temporary name. It is renamed when complete, and removed otherwise.
pub struct PendingFile {
    path: PathBuf,
    temporary: NamedTempFile,
}

impl PendingFile {
    /// Opens a temporary file in `directory` for the later `directory/name`.
    pub fn create(directory: &OutputDirectory, name: &str) -> Result<Self, Failure> {
        let path = directory.path().join(name);
        if path.is_dir() {
            return Err(Failure::Other(format!(
                "{} is a directory, not a file; move it, or choose another output",
                shown::path(&path)
            )));
        }
        directory.refuse_foreign(&path)?;
        let temporary = temporary()
            .tempfile_in(directory.path())
            .map_err(|error| cannot_write(&path, &error))?;
        Ok(Self { path, temporary })
    }

    /// Final name in its directory.
    pub fn name(&self) -> String {
        self.path.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Temporary name in its directory.
    pub fn temporary_name(&self) -> String {
        self.temporary.path().file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// Temporary path.
    pub fn temporary_path(&self) -> &Path {
        self.temporary.path()
    }

    /// Keeps the file under its temporary name.
    pub fn leave(self) {
        // A file that cannot be kept is removed.
        let _ = self.temporary.keep();
    }

    /// Opens the file for writing.
    pub fn open(&self) -> Result<File, Failure> {
        self.temporary.reopen().map_err(|error| self.failed(&error))
    }

    /// Opens a buffered stream into the file.
    pub fn stream(&self) -> Result<BufWriter<File>, Failure> {
        self.open().map(BufWriter::new)
    }

    /// Writes the whole file and syncs it, so that a full disk is noticed before the rename.
    pub fn write(&self, bytes: &[u8]) -> Result<(), Failure> {
        let mut stream = self.stream()?;
        stream
            .write_all(bytes)
            .and_then(|()| stream.flush())
            .and_then(|()| stream.get_ref().sync_all())
            .map_err(|error| self.failed(&error))
    }

    /// Converts an error of the stream to a failure.
    pub fn failed(&self, error: &io::Error) -> Failure {
        cannot_write(&self.path, error)
    }

    /// Renames the complete file to its final name.
    pub fn publish(self) -> Result<PathBuf, Failure> {
        match self.temporary.persist(&self.path) {
            Ok(_) => Ok(self.path),
            Err(error) => Err(cannot_write(&self.path, &error.error)),
        }
    }
}

/// Builder of a temporary file. Permissions follow the umask, as for other files.
pub fn temporary() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(TEMPORARY.0).suffix(TEMPORARY.1).rand_bytes(RANDOM);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder
}

/// Directory and file name of a picture: the file `out` with the ending of `usual` or one of `others`,
/// or else `usual` in the directory `out`, by default that of `file`.
pub fn target<'a>(
    out: Option<&'a Path>,
    file: &'a Path,
    usual: &'a str,
    others: &[&str],
) -> Result<(&'a Path, &'a str), Failure> {
    let named = out.filter(|out| {
        let bytes = out.as_os_str().as_encoded_bytes();
        out.extension().is_some() && !bytes.ends_with(b"/") && !out.is_dir()
    });
    let Some(path) = named else { return Ok((directory_of(out, file), usual)) };
    let refused =
        |needed: &str| Failure::Input(format!("--out {}: {needed} is needed", shown::path(path)));
    let usual = Path::new(usual).extension().and_then(OsStr::to_str);
    let endings = usual.iter().chain(others);
    if !endings.clone().any(|ending| path.extension() == Some(OsStr::new(ending))) {
        let endings: Vec<_> = endings.map(|ending| format!(".{ending}")).collect();
        let endings = endings.join(" or ");
        return Err(refused(&format!("a file name that ends in {endings} or a directory")));
    }
    let name = path.file_name().and_then(OsStr::to_str);
    let name = name.ok_or_else(|| refused("a Unicode file name"))?;
    Ok((directory_of(None, path), name))
}

fn cannot_write(path: &Path, error: &io::Error) -> Failure {
    Failure::Other(format!("{} cannot be written: {error}", shown::path(path)))
}

/// Reports a failure on standard error when the command continues.
pub fn complain(failure: &Failure) {
    // Standard error may be closed.
    let style = AnsiColor::Red.on_default().bold();
    let _ = writeln!(AutoStream::auto(io::stderr()), "{style}error{style:#}: {failure}");
}

/// Prints `text` to standard output, with its colours if that is a terminal that shows them.
pub fn say(text: &str) -> Result<(), Failure> {
    let mut stdout = AutoStream::auto(io::stdout().lock());
    stdout
        .write_all(text.as_bytes())
        .and_then(|()| stdout.flush())
        .map_err(|error| Failure::Other(format!("standard output cannot be written: {error}")))
}

/// Output of a command that still has files to write. A closed standard output does not prevent
/// this.
pub struct StderrReporter {
    quiet: bool,
    failure: Option<Failure>,
}

impl StderrReporter {
    pub fn new(quiet: bool) -> Self {
        Self { quiet, failure: None }
    }

    pub fn is_quiet(&self) -> bool {
        self.quiet
    }

    /// Prints `text`, unless it is quiet or an earlier print failed.
    pub fn say(&mut self, text: &str) {
        if !self.quiet && self.failure.is_none() {
            self.failure = say(text).err();
        }
    }

    /// Prints a note.
    pub fn note(&mut self, note: &str) {
        self.say(&format!("note: {}\n", shown::line(note)));
    }

    /// Result of a command that reached `outcome`.
    pub fn end(self, outcome: Outcome) -> Result<Outcome, Failure> {
        self.failure.map_or(Ok(outcome), Err)
    }
}

/// Progress line on standard error; hidden if that is not a terminal.
pub fn spinner(quiet: bool) -> ProgressBar {
    if quiet || !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    ProgressBar::new_spinner()
}

/// Progress bar on standard error for `length` items of `unit`; hidden if that is not a terminal.
pub fn progress_bar(length: u64, unit: &str, quiet: bool) -> ProgressBar {
    if quiet || !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(length);
    let template = format!("{{bar:40}} {{pos}}/{{len}} {unit}, {{eta}} left");
    if let Ok(style) = ProgressStyle::with_template(&template) {
        bar.set_style(style);
    }
    bar
}
