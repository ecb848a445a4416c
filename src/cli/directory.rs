//! The directory that files are written to: made, claimed, and cleared of what is no longer true.

use super::outcome::Failure;
use super::{file_names, shown};
use std::fs::{self, File, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

/// What files of pictures, pages and tables end in: a folder that is so called is a mistake, unless it is there.
const FILES: [&str; 9] = ["png", "svg", "pdf", "gif", "mp4", "html", "csv", "json", "zst"];

/// A directory that is written to. As long as this lives, no run of another process writes there;
/// the system itself ends the claim with the process, and no file stands for it.
pub struct OutputDirectory {
    path: PathBuf,
    claim: Option<File>,
}

impl OutputDirectory {
    /// For a run, whose files belong together: nobody else may write here. What a run that was killed
    /// left of its files is removed.
    pub fn for_run(path: &Path) -> Result<Self, Failure> {
        let directory = Self::claim(path, File::try_lock)?;
        if directory.claim.is_some() {
            directory.remove_leftovers();
        }
        Ok(directory)
    }

    /// For pictures, each a file by itself: others may make theirs, but no run.
    pub fn for_pictures(path: &Path) -> Result<Self, Failure> {
        Self::claim(path, File::try_lock_shared)
    }

    /// Makes and claims the directory.
    fn claim(
        path: &Path,
        lock: impl Fn(&File) -> Result<(), TryLockError>,
    ) -> Result<Self, Failure> {
        let ends = path.extension().and_then(std::ffi::OsStr::to_str).unwrap_or_default();
        if FILES.contains(&ends) && !path.is_dir() {
            return Err(names_a_file(path));
        }
        fs::create_dir_all(path).map_err(|error| cannot_be_made(path, &error))?;
        // A directory that cannot be opened to be read can still be written to; and there are
        // file systems without locks. Each file is whole all the same.
        let claim = match File::open(path).map(|directory| (lock(&directory), directory)) {
            Ok((Err(TryLockError::WouldBlock), _)) => return Err(in_use(path)),
            Ok((Ok(()), directory)) => Some(directory),
            Ok((Err(TryLockError::Error(_)), _)) | Err(_) => None,
        };
        Ok(Self { path: path.to_owned(), claim })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Removes the temporary files of runs that were killed. Nobody else writes here now; what
    /// cannot be removed is in nobody's way.
    fn remove_leftovers(&self) {
        let entries = fs::read_dir(&self.path).into_iter().flatten().flatten();
        for entry in entries {
            let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
            if is_file && entry.file_name().to_str().is_some_and(file_names::is_temporary) {
                let _ = fs::remove_file(entry.path());
            }
        }
    }

    /// Removes the files whose names `is_former` knows as those of an earlier run, and tells how many.
    pub fn remove_all(&self, is_former: impl Fn(&str) -> bool) -> Result<u64, Failure> {
        let mut removed = 0;
        for entry in fs::read_dir(&self.path).into_iter().flatten().flatten() {
            let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
            if is_folder || !entry.file_name().to_str().is_some_and(&is_former) {
                continue;
            }
            let file = entry.path();
            fs::remove_file(&file).map_err(|error| cannot_be_removed(&file, &error))?;
            removed += 1;
        }
        Ok(removed)
    }

    /// Removes what an earlier run left and this one, which wrote the files `written`, did not: its
    /// pictures, and the rows of the other format, are not true of what is there now. Only files of names
    /// that tumble gives are looked at. Returns their names.
    pub fn remove_former(&self, written: &[PathBuf]) -> Result<Vec<String>, Failure> {
        let mut removed = Vec::new();
        for name in file_names::of_runs() {
            let file = self.path.join(&name);
            if written.contains(&file) {
                continue;
            }
            match fs::symlink_metadata(&file) {
                Ok(metadata) if !metadata.is_dir() => {
                    fs::remove_file(&file).map_err(|error| cannot_be_removed(&file, &error))?;
                    removed.push(name);
                }
                Ok(_) | Err(_) => {}
            }
        }
        Ok(removed)
    }
}

fn cannot_be_made(path: &Path, error: &io::Error) -> Failure {
    Failure::Input(format!(
        "the output directory {} cannot be made: {error}; name another with --out",
        shown::path(path)
    ))
}

fn cannot_be_removed(path: &Path, error: &io::Error) -> Failure {
    Failure::Other(format!(
        "{} is of an earlier run and cannot be removed: {error}",
        shown::path(path)
    ))
}

fn names_a_file(path: &Path) -> Failure {
    let path = shown::path(path);
    Failure::Input(format!("--out {path} is the name of a file; that of a folder is needed"))
}

fn in_use(path: &Path) -> Failure {
    Failure::Other(format!(
        "another tumble is writing to {}; wait for it, or choose another --out",
        shown::path(path)
    ))
}
