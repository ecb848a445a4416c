//! The output directory: created, locked, and cleared of outdated files.

use super::file_names::{self, CHECKPOINT, RUN_JSON};
use super::input;
use super::outcome::Failure;
use std::ffi::OsStr;
use std::fs::{self, File, Metadata, TryLockError};
use std::io::{self, Read as _, Seek as _, SeekFrom};
use std::path::{Path, PathBuf};
use tumble_model::shown;
use tumble_scene::run_file::{self, RunFile};
use tumble_scene::written;
use tumble_view::MARK;

/// Extensions of files. A new directory with one of them is refused as a mistake.
const FILES: [&str; 10] = ["png", "svg", "pdf", "gif", "mp4", "webm", "html", "csv", "json", "zst"];

/// Marks of single files, by their endings.
const MARKS: [(&str, &str); 8] = [
    ("csv", "directory,"),
    ("gif", MARK),
    ("html", "<!doctype html>\n<!-- tumble -->"),
    ("mp4", MARK),
    ("png", MARK),
    ("svg", MARK),
    ("webm", MARK),
    ("toml", written::HEAD),
];
/// Length of the beginning and of the end of a file that may have the mark (bytes).
const MARKED: u64 = 1024;

/// A locked output directory. While it exists, no run of another process writes there. The
/// operating system releases the lock at the end of the process; there is no lock file.
pub struct OutputDirectory {
    path: PathBuf,
    claim: Option<File>,
    /// True for pictures and scenarios, which no run.json lists.
    has_single_files: bool,
    /// Files of the previous run, and files that could be mistaken for them.
    former: Vec<String>,
    /// Temporary files of killed runs.
    leftovers: Vec<PathBuf>,
}

/// Files of a run in its directory.
pub struct OutputClaims {
    /// Names of the files that it writes.
    pub files: Vec<String>,
    /// Names of files that could be mistaken for its own.
    pub alike: Vec<String>,
    /// True if it may replace and remove such files even if they are not from an earlier run.
    pub overwrite: bool,
    /// True if it continues the run that was killed there.
    pub continues: bool,
}

impl OutputDirectory {
    /// Locks the directory for a run, exclusively. The run may replace and remove files in the
    /// directory's run.json, and other files only with `overwrite`.
    pub fn for_run(path: &Path, claims: OutputClaims) -> Result<Self, Failure> {
        let mut directory = Self::claim(path, File::try_lock)?;
        let OutputClaims { files, alike, overwrite, continues } = claims;
        if !continues && !overwrite && fs::symlink_metadata(path.join(CHECKPOINT)).is_ok() {
            return Err(is_unfinished(path));
        }
        let run_json = input::text(&path.join(RUN_JSON), run_file::LARGEST_FILE);
        let mut listed = run_json.map_or_else(|_| Vec::new(), |text| RunFile::listed_files(&text));
        // A link or a directory with a file's name does not belong to the run.
        let kind = |name: &String| fs::symlink_metadata(path.join(name));
        listed.retain(|name| kind(name).is_ok_and(|metadata| metadata.is_file()));
        for name in files.iter().chain(&alike) {
            let Ok(metadata) = kind(name) else { continue };
            if !listed.contains(name) && (!overwrite || metadata.is_dir()) {
                return Err(is_foreign(&path.join(name), &metadata));
            }
        }
        let others = listed.into_iter().chain(alike);
        directory.former = others.collect();
        directory.former.sort();
        directory.former.dedup();
        directory.leftovers = directory.temporary_files();
        if !continues {
            directory.remove_leftovers();
        }
        Ok(directory)
    }

    /// Locks the directory for single files such as pictures. Others can write such files too, but
    /// a run cannot.
    pub fn for_pictures(path: &Path) -> Result<Self, Failure> {
        Ok(Self { has_single_files: true, ..Self::claim(path, File::try_lock_shared)? })
    }

    /// Creates and locks the directory.
    fn claim(
        path: &Path,
        lock: impl Fn(&File) -> Result<(), TryLockError>,
    ) -> Result<Self, Failure> {
        let ends = path.extension().and_then(OsStr::to_str).unwrap_or_default();
        if FILES.contains(&ends) && !path.is_dir() {
            let path = shown::path(path);
            return Err(Failure::Input(format!("--out {path}: a directory is needed, not a file")));
        }
        fs::create_dir_all(path).map_err(|error| {
            let path = shown::path(path);
            let why = format!("the output directory {path} cannot be created: {error}");
            Failure::Input(format!("{why}; choose another --out"))
        })?;
        // The lock is optional: some file systems have none, and a directory can be writable but
        // not readable. Files are complete in any case.
        let claim = match File::open(path).map(|directory| (lock(&directory), directory)) {
            Ok((Err(TryLockError::WouldBlock), _)) => return Err(in_use(path)),
            Ok((Ok(()), directory)) => Some(directory),
            Ok((Err(TryLockError::Error(_)), _)) | Err(_) => None,
        };
        Ok(Self {
            path: path.to_owned(),
            claim,
            has_single_files: false,
            former: Vec::new(),
            leftovers: Vec::new(),
        })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Refuses to replace a single file without the mark of those of tumble. Files of runs are checked
    /// by [`OutputDirectory::for_run`].
    pub fn refuse_foreign(&self, file: &Path) -> Result<(), Failure> {
        let ending = file.extension().and_then(OsStr::to_str);
        let mark = MARKS.iter().find(|(of, _)| self.has_single_files && ending == Some(*of));
        let (Some((_, mark)), true) = (mark, file.exists()) else { return Ok(()) };
        let found = ends_of(file).unwrap_or_else(|_| vec![0]);
        if found.is_empty() || found.windows(mark.len()).any(|part| part == mark.as_bytes()) {
            return Ok(());
        }
        Err(Failure::Input(format!(
            "{} was not written by tumble; move it, or choose another output",
            shown::path(file)
        )))
    }

    /// Temporary files in the directory. With the lock, no other process is writing them.
    fn temporary_files(&self) -> Vec<PathBuf> {
        if self.claim.is_none() {
            return Vec::new();
        }
        let names = names_in(&self.path).into_iter().filter(|name| file_names::is_temporary(name));
        let is_file = |file: &PathBuf| fs::symlink_metadata(file).is_ok_and(|data| data.is_file());
        names.map(|name| self.path.join(name)).filter(is_file).collect()
    }

    /// Removes temporary files and the checkpoint of killed runs. Failures are harmless.
    fn remove_leftovers(&self) {
        let checkpoint = self.path.join(CHECKPOINT);
        for file in [&checkpoint].into_iter().chain(&self.leftovers) {
            let _ = fs::remove_file(file);
        }
    }

    /// Removes outdated files after this run has written its own: its checkpoint, and files of the
    /// previous run that are not in `written`. Returns the names of the latter.
    pub fn remove_former(&self, written: &[PathBuf]) -> Result<Vec<String>, Failure> {
        self.remove_leftovers();
        let mut removed = Vec::new();
        for name in &self.former {
            let file = self.path.join(name);
            let is_there = fs::symlink_metadata(&file).is_ok_and(|metadata| !metadata.is_dir());
            if is_there && !written.contains(&file) {
                fs::remove_file(&file).map_err(|error| cannot_be_removed(&file, &error))?;
                removed.push(name.clone());
            }
        }
        Ok(removed)
    }
}

/// Beginning and end of a file.
fn ends_of(file: &Path) -> io::Result<Vec<u8>> {
    let (mut file, mut found) = (input::open(file)?, Vec::new());
    file.by_ref().take(MARKED).read_to_end(&mut found)?;
    let length = file.seek(SeekFrom::End(0))?;
    file.seek(SeekFrom::Start(length.saturating_sub(MARKED).max(found.len() as u64)))?;
    file.take(MARKED).read_to_end(&mut found)?;
    Ok(found)
}

fn is_foreign(file: &Path, metadata: &Metadata) -> Failure {
    let shown = shown::path(file);
    if metadata.is_dir() {
        return Failure::Input(format!(
            "{shown} is a directory, not a file; move it, or choose another --out"
        ));
    }
    Failure::Input(format!(
        "{shown} was not written by an earlier run: no run.json lists it; move it, choose another \
         --out, or replace it with --overwrite"
    ))
}

fn is_unfinished(path: &Path) -> Failure {
    let path = shown::path(path);
    Failure::Input(format!(
        "{path} has the checkpoint of a killed run; continue it with --continue {path}, choose \
         another --out, or discard it with --overwrite"
    ))
}

/// Sorted names of the entries of a directory; empty if it does not exist.
pub fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<_> =
        entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    names
}

fn cannot_be_removed(path: &Path, error: &io::Error) -> Failure {
    Failure::Other(format!(
        "{} is from an earlier run and cannot be removed: {error}",
        shown::path(path)
    ))
}

fn in_use(path: &Path) -> Failure {
    Failure::Other(format!(
        "another tumble process is writing to {}; wait for it, or choose another --out",
        shown::path(path)
    ))
}
