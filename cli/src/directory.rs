//! The directory that files are written to: made, claimed, and cleared of what is no longer true.

use super::file_names::{self, RUN_JSON};
use super::outcome::Failure;
use super::{checkpoint, input};
use std::ffi::OsStr;
use std::fs::{self, File, Metadata, TryLockError};
use std::io;
use std::path::{Path, PathBuf};
use tumble_model::shown;
use tumble_scene::run_file::{self, RunFile};

/// What files of pictures, pages and tables end in: a folder that is so called is a mistake, unless it is there.
const FILES: [&str; 9] = ["png", "svg", "pdf", "gif", "mp4", "html", "csv", "json", "zst"];

/// A directory that is written to. As long as this lives, no run of another process writes there;
/// the system itself ends the claim with the process, and no file stands for it.
pub struct OutputDirectory {
    path: PathBuf,
    claim: Option<File>,
    /// Files of the run before, and those that may be taken for such.
    former: Vec<String>,
    /// What runs that were killed left.
    leftovers: Vec<PathBuf>,
}

/// What a run does in its directory.
pub struct Claims {
    /// The names of the files that it writes.
    pub files: Vec<String>,
    /// The names of files that would be taken for its own.
    pub alike: Vec<String>,
    /// Whether it may replace and remove files of both that are not those of a run before.
    pub overwrite: bool,
    /// Whether it goes on with the run that was killed there.
    pub continues: bool,
}

impl OutputDirectory {
    /// For a run, whose files belong together: nobody else may write here. Of the files that are there, the run may
    /// replace and remove those that a run.json there lists, and others only with `overwrite`.
    pub fn for_run(path: &Path, claims: Claims) -> Result<Self, Failure> {
        let mut directory = Self::claim(path, File::try_lock)?;
        let Claims { files, alike, overwrite, continues } = claims;
        if !continues && !overwrite && fs::symlink_metadata(path.join(checkpoint::FILE)).is_ok() {
            return Err(is_unfinished(path));
        }
        let run_json = input::text(&path.join(RUN_JSON), run_file::LARGEST_FILE);
        let mut listed = run_json.map_or_else(|_| Vec::new(), |text| RunFile::listed_files(&text));
        // A link or a folder in the place of a file is not of the run.
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

    /// For pictures, each a file by itself: others may make theirs, but no run.
    pub fn for_pictures(path: &Path) -> Result<Self, Failure> {
        Self::claim(path, File::try_lock_shared)
    }

    /// Makes and claims the directory.
    fn claim(
        path: &Path,
        lock: impl Fn(&File) -> Result<(), TryLockError>,
    ) -> Result<Self, Failure> {
        let ends = path.extension().and_then(OsStr::to_str).unwrap_or_default();
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
        Ok(Self { path: path.to_owned(), claim, former: Vec::new(), leftovers: Vec::new() })
    }

    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The temporary files that are there. Nobody else writes here, where there is a claim.
    fn temporary_files(&self) -> Vec<PathBuf> {
        if self.claim.is_none() {
            return Vec::new();
        }
        let names = names_in(&self.path).into_iter().filter(|name| file_names::is_temporary(name));
        let is_file = |file: &PathBuf| fs::symlink_metadata(file).is_ok_and(|data| data.is_file());
        names.map(|name| self.path.join(name)).filter(is_file).collect()
    }

    /// Removes what runs that were killed left, their checkpoint too. What cannot be removed is in nobody's way.
    fn remove_leftovers(&self) {
        let checkpoint = self.path.join(checkpoint::FILE);
        for file in [&checkpoint].into_iter().chain(&self.leftovers) {
            let _ = fs::remove_file(file);
        }
    }

    /// Removes what is no longer true once this run has its files: those of the run before that are not
    /// `written` anew, and its own checkpoint. Returns the names of the former.
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

fn is_foreign(file: &Path, metadata: &Metadata) -> Failure {
    let shown = shown::path(file);
    if metadata.is_dir() {
        return Failure::Input(format!("{shown} is a directory; a file is to be written there"));
    }
    Failure::Input(format!(
        "{shown} is not of a run whose run.json lists it; move it, choose another --out, or have it replaced with \
         --overwrite"
    ))
}

fn is_unfinished(path: &Path) -> Failure {
    let path = shown::path(path);
    Failure::Input(format!(
        "{path} has the checkpoint of a run that was killed; go on with --continue {path}, choose another --out, or \
         give it up with --overwrite"
    ))
}

/// The names of what is in a folder, in their order; none where it is not there.
pub fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<_> =
        entries.filter_map(|entry| entry.file_name().into_string().ok()).collect();
    names.sort();
    names
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
