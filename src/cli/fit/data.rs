//! The recordings that the user names: a file, or a folder of files.

use super::refused;
use crate::cli::outcome::Failure;
use crate::cli::{input, shown};
use std::fs;
use std::path::{Path, PathBuf};
use tumble::fit::FitError;
use tumble::fit::recording::{Toss, read_bodies, read_csv, read_torch};

/// More bytes than this are no recording.
const LARGEST_FILE: u64 = 1 << 28;

/// What was read.
pub struct Data {
    pub tosses: Vec<Toss>,
    /// The names of the files, and how many tosses come before each one's.
    files: Vec<(String, usize)>,
    /// Of all bytes, FNV-1a.
    pub digest: u64,
}

impl Data {
    /// What is wrong with a toss, with its file.
    pub fn named(&self, toss: &Toss, error: FitError) -> Failure {
        let place = self.tosses.iter().position(|other| other.name == toss.name).unwrap_or(0);
        let file = self.files.iter().rev().find(|(_, first)| *first <= place);
        match file {
            Some((file, _)) => Failure::Input(format!("{file}: {error}")),
            None => refused(error),
        }
    }

    pub fn files(&self) -> usize {
        self.files.len()
    }
}

/// Reads the recordings at `path`, of one body or of these `bodies`; `rate` is that of files that do not say.
pub fn read(path: &Path, rate: f64, bodies: Option<&[String]>) -> Result<Data, Failure> {
    let mut data = Data { tosses: Vec::new(), files: Vec::new(), digest: 0xcbf2_9ce4_8422_2325 };
    for file in files(path, bodies.is_some())? {
        let name = shown::path(&file);
        let bytes = input::bytes(&file, LARGEST_FILE)
            .map_err(|error| Failure::Input(format!("{name} cannot be read: {error}")))?;
        for byte in &bytes {
            data.digest = (data.digest ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3);
        }
        let tosses = match (kind(&file), bodies) {
            (_, Some(bodies)) => read_bodies(&bytes, bodies, &called(&file)),
            (Some(Kind::Tensor), None) => {
                let stem = file.file_stem().map(|stem| stem.to_string_lossy().into_owned());
                read_torch(&bytes, &stem.unwrap_or_default(), rate).map(|toss| vec![toss])
            }
            (Some(Kind::Table) | None, None) => read_csv(&bytes),
        };
        let tosses = tosses.map_err(|error| Failure::Input(format!("{name}: {error}")))?;
        data.files.push((name.clone(), data.tosses.len()));
        for toss in tosses {
            if data.tosses.iter().any(|other| other.name == toss.name) {
                let toss = &toss.name;
                return Err(Failure::Input(format!("{name}: toss {toss} is in another file too")));
            }
            data.tosses.push(toss);
        }
    }
    Ok(data)
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Table,
    Tensor,
}

fn kind(path: &Path) -> Option<Kind> {
    let name = path.file_name()?.to_string_lossy().to_lowercase();
    if name.ends_with(".csv") || name.ends_with(".csv.gz") {
        Some(Kind::Table)
    } else if name.ends_with(".pt") {
        Some(Kind::Tensor)
    } else {
        None
    }
}

/// The table of states in the folder of a run of several bodies.
const STATES: &str = "states.csv";

/// What the recording of a file without a column for it is called: as the file, or the folder of the run that it is of.
fn called(file: &Path) -> String {
    let is_of_run = file.file_name().is_some_and(|name| name == STATES);
    let folder = file.parent().filter(|_| is_of_run);
    let name = match folder.and_then(Path::file_name) {
        Some(folder) => folder,
        None => file.file_name().unwrap_or_default(),
    };
    let name = name.to_string_lossy();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    name.strip_suffix(".csv").unwrap_or(name).to_owned()
}

/// The file itself, or the recordings in a folder: in the order of the numbers in their names. Of `several` bodies the folder of
/// a run is its table of states, and may be in the folder.
fn files(path: &Path, several: bool) -> Result<Vec<PathBuf>, Failure> {
    let name = shown::path(path);
    let cannot = |error: std::io::Error| Failure::Input(format!("{name} cannot be read: {error}"));
    if !fs::metadata(path).map_err(cannot)?.is_dir() {
        let (is_one, needed) = match (kind(path), several) {
            (kind, false) => (kind.is_some(), ".csv, .csv.gz or .pt"),
            (kind, true) => (kind == Some(Kind::Table), ".csv or .csv.gz"),
        };
        if !is_one {
            let why = format!("{name} is no recording by its name; {needed} is needed");
            return Err(Failure::Input(why));
        }
        return Ok(vec![path.to_owned()]);
    }
    if several && path.join(STATES).is_file() {
        return Ok(vec![path.join(STATES)]);
    }
    let mut files = Vec::new();
    for entry in fs::read_dir(path).map_err(cannot)? {
        let file = entry.map_err(cannot)?.path();
        let of_run = file.join(STATES);
        if kind(&file).is_some() && file.is_file() {
            files.push(file);
        } else if several && of_run.is_file() {
            files.push(of_run);
        }
    }
    if files.is_empty() {
        let why = "has no recordings: no file .csv, .csv.gz or .pt";
        return Err(Failure::Input(format!("{name} {why}")));
    }
    files.sort_by_key(|file| (called(file).parse::<u64>().ok(), file.clone()));
    Ok(files)
}
